#pragma once

#include <filesystem>
#include <string>

#include "embrun/reproduce.h"
#include "image/image.h"
#include "reproduction/plan.h"

namespace embrun {

/// What making a picture took. Seconds are of the processor, all threads together.
struct PictureResult {
  std::string name, flags;
  int width = 0, height = 0, samples = 0, threads = 0;
  double build_seconds = 0;   ///< all that is done before the first ray; the less of two times
  double render_seconds = 0;  ///< of all samples
  double surface_bytes = 0;
  std::uint64_t triangles = 0, grid_cells = 0;
  std::uint64_t contradictions = 0, bad_samples = 0;
  std::string instruction_set;
  // The particles.
  std::uint64_t particles = 0;
  double radius = 0, spacing = 0, threshold = 0;
};

/// Thrown when a run was asked to stop.
struct Interrupted {};

/// Makes pictures in a folder, each as two halves with seeds of their own and their mean, and finds those again that an
/// earlier run has made by the same flags from the same file.
class PictureStore {
 public:
  PictureStore(const ReproduceOptions& options, const ReproduceHooks& hooks) : options_(options), hooks_(hooks) {}

  /// The picture, which is there afterwards. Throws Interrupted, and Error as the Renderer does.
  PictureResult make(const PictureSpec& spec);

  /// Files: NAME.exr of all samples, NAME-1.exr and NAME-2.exr of half of them each.
  std::filesystem::path mean_file(const std::string& name) const;
  std::filesystem::path half_file(const std::string& name, int half) const;
  Image read(const std::string& name) const;

  int rendered() const { return rendered_; }
  int kept() const { return kept_; }

 private:
  std::filesystem::path record_file(const std::string& name) const;
  std::string signature(const PictureSpec& spec) const;

  const ReproduceOptions& options_;
  const ReproduceHooks& hooks_;
  int rendered_ = 0, kept_ = 0;
  std::uint32_t next_seed_ = 0;
};

}  // namespace embrun

#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "backend/cpu/kernel_table.h"
#include "image/film.h"
#include "scene/flat_scene.h"

namespace embrun {

class EmbreeScene;
struct LearnedGuide;

/// What rendering some samples counted.
struct RenderCounts {
  PathCounters paths;
  std::vector<PixelSample> bad_samples;    ///< the first few, in the order of pixels and samples
  std::vector<PixelSample> contradicting;  ///< likewise, of those whose paths contradicted the medium
  bool cancelled = false;                  ///< some of the samples were not traced
};

/// Renders a compiled scene on the processor. Holds what rays need besides the flat scene, which must outlive it.
class CpuBackend {
 public:
  /// Prepares the meshes, finds what the camera is in, and learns where light comes from, on the threads of the enclosing
  /// TBB arena. Throws Error as instruction_set() does.
  explicit CpuBackend(const FlatScene& scene);
  CpuBackend(const FlatScene& scene, const KernelTable& kernels);
  ~CpuBackend();

  /// Adds samples first .. first + count - 1 of every pixel of the film's window, on the threads of the enclosing TBB
  /// arena. Each pixel's samples are added in order, so the film is the same for any number of threads and however the
  /// samples are divided among calls. `cancel` is looked at between batches of paths; what was traced until then is in
  /// the film. `done` is told the number of samples added, from any thread.
  RenderCounts render_samples(Film& film, std::uint32_t first, std::uint32_t count,
                              const std::atomic<bool>* cancel = nullptr,
                              const std::function<void(std::uint64_t)>& done = {}) const;

  const KernelTable& kernels() const { return kernels_; }
  /// What Embree's trees over meshes and balls took to build.
  double tree_seconds() const { return tree_seconds_; }
  const CpuSceneView& view() const { return view_; }
  const PathScene& path_scene() const { return path_scene_; }
  /// How light that reaches diffuse surfaces is sampled; for checks.
  void set_light_strategy(LightStrategy strategy) { path_scene_.settings.lights = strategy; }

 private:
  /// Those of a batch's samples whose paths contradict the medium, found by tracing each alone.
  std::vector<PixelSample> find_contradicting(const PixelSample* samples, int count, PathBatch& batch) const;

  const KernelTable& kernels_;
  double tree_seconds_ = 0;
  std::unique_ptr<EmbreeScene> embree_;
  std::unique_ptr<LearnedGuide> guide_;
  CpuSceneView view_;
  PathScene path_scene_;
};

}  // namespace embrun

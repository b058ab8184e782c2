#pragma once

#include <optional>
#include <string>
#include <vector>

#include "embrun/reproduce.h"

namespace embrun {

/// How a row of the tables is rendered: directly, as a mesh (what is inside on a grid), or by the thesis's own tracer.
enum class Way { direct, mesh, thesis };

/// A row of the tables. All of them are rendered both directly and as a mesh.
struct Row {
  int view = 1;
  int order = 3;
  int refractions = -1;   ///< after that many rays go straight on; -1: any number
  bool volume = false;    ///< particles scatter and absorb
  bool gradient = false;  ///< normals of the field's gradient instead of weighted ones

  bool operator==(const Row&) const = default;
};

/// Those of tables 1 to 3 and of gradient normals, for both views.
std::vector<Row> table_rows();

/// A picture to be made.
struct PictureSpec {
  std::string name;  ///< of its files
  std::string what;  ///< for people
  std::string particles;
  RenderOptions options;  ///< with the size, without samples and seed
  int samples = 2;        ///< even: half of them with a seed of their own
};

/// Sizes and samples with the defaults in place.
struct Scale {
  int width = 0, height = 0, samples = 0, thesis_samples = 0;
};
Scale scale_of(const ReproduceOptions& options);

/// By how much the one picture by the thesis's tracer is smaller along each side.
inline constexpr int thesis_shrink = 4;

PictureSpec picture_of(const Row& row, Way way, const std::string& particles, const ReproduceOptions& options);

/// The flags of `embrun render` that say of RenderOptions what the plan sets; also what tells whether a picture that is
/// there already is the one that is wanted.
std::string flags_of(const RenderOptions& options);

/// The file of that name in the folder of sample data, by any extension of a particle file; none if it is not there.
std::optional<std::string> find_particles(const std::string& folder, const std::string& name);

}  // namespace embrun

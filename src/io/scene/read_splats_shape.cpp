#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "base/error.h"
#include "io/read_particles.h"
#include "io/scene/reading.h"
#include "io/splat_file.h"
#include "io/text.h"
#include "scene/splats_of_cloud.h"

namespace embrun {
namespace {

SplatOptions read_options(SceneObject& shape) {
  SplatOptions options;
  if (const std::optional<std::string> normals = shape.text("normals")) {
    if (*normals != "auto" && *normals != "file" && *normals != "estimate")
      shape.fail(fmt::format("'normals' is {}: there are auto, file, estimate", quoted(*normals)));
    options.normals = *normals == "file"       ? NormalChoice::file
                      : *normals == "estimate" ? NormalChoice::estimate
                                               : NormalChoice::automatic;
  }
  if (const std::optional<int> neighbours = shape.integer("neighbours", 3, 256))
    options.neighbours = static_cast<std::size_t>(*neighbours);
  options.sensor = shape.vector("sensor");
  options.radius = shape.number("radius");
  options.radius_scale = shape.number("radius_scale", options.radius_scale);
  options.ellipses = shape.flag("ellipses").value_or(options.ellipses);
  options.closed = shape.flag("closed");
  options.keep_duplicates = shape.flag("keep_duplicates").value_or(options.keep_duplicates);
  options.outlier_ratio = shape.number("outlier_ratio", options.outlier_ratio);
  options.thin = shape.number("thin", options.thin);
  return options;
}

/// Which surface the points have, of those options.
void read_surface(SceneObject& shape, const SplatOptions& options, SplatsDescription& splats) {
  const std::string surface = shape.text("surface").value_or("splats");
  if (surface != "splats" && surface != "mls")
    shape.fail(fmt::format("'surface' is {}: there are splats, mls", quoted(surface)));
  splats.bent_normals = shape.flag("bent_normals").value_or(false);
  const bool given = shape.has("mls_support");
  splats.mls_support = shape.number("mls_support", splats.mls_support);
  if (surface == "splats") {
    if (given) shape.fail("'mls_support' is for the surface mls");
    return;
  }
  splats.surface = CloudSurface::mls;
  if (!(splats.mls_support >= 1 && splats.mls_support <= 16))
    shape.fail(fmt::format("'mls_support' is {}: it must be in [1, 16]", splats.mls_support));
  if (options.ellipses) shape.fail("'ellipses' is for splats: the surface mls takes points as round");
  if (splats.bent_normals) shape.fail("'bent_normals' is for splats: the surface mls is smooth");
}

/// Turns all round: what was inside is outside.
void flip(SplatsDescription& splats) {
  for (Vec3& n : splats.normals) n = -n;
}

SplatsDescription read_cloud(SceneReading& reading, SceneObject& shape, const std::string& path) {
  const SplatOptions options = read_options(shape);
  const std::vector<std::byte> bytes = reading.read_bytes(path);
  // What is wrong with the file says so itself; what it cannot be made into is this shape's matter.
  ParticleSet points = read_particles_from_memory(bytes, path);
  SplatsDescription splats;
  try {
    splats = splats_of_cloud(make_splats(std::move(points), options, path));
  } catch (const Error& error) {
    shape.fail(error.what());
  }
  splats.file = path;
  splats.options = options;
  splats.options.closed = splats.closed;
  read_surface(shape, options, splats);
  splats.flipped = shape.flag("flip_normals").value_or(false);
  if (splats.flipped) flip(splats);
  return splats;
}

/// What was decided when the file was made is not asked again.
SplatsDescription read_file_of_splats(SceneObject& shape, const std::string& path) {
  for (const char* name :
       {"normals", "radius", "closed", "ellipses", "bent_normals", "flip_normals", "thin", "surface"})
    if (shape.has(name))
      shape.fail(fmt::format("'{}': a file of splats has been made already, and says that itself", name));
  return splats_of_file(open_splat_file(path), path);
}

}  // namespace

void read_splats_shape(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  const std::optional<std::string> name = shape.text("filename");
  if (!name) shape.fail("'filename' is missing");
  const std::string path = reading.path_of(shape, *name);
  SplatsDescription splats = is_splat_file(path) ? read_file_of_splats(shape, path) : read_cloud(reading, shape, path);
  splats.detail = shape.number("detail", splats.detail);
  if (!(splats.detail >= 0) || std::isinf(splats.detail))
    shape.fail("'detail' is a number of footprints, 0 (every splat is met) or greater");
  if (splats.detail > 0 && splats.surface == CloudSurface::mls)
    shape.fail("'detail' is for splats, not for the surface mls");
  splats.placement = compose(outer, shape.placement("to_world"));
  splats.material = take_material(reading, shape, splats.material);
  // Splats that reach over an edge show their backs, which are to look as the surface does.
  if (splats.material.back == std::vector<MaterialDescription>{diffuse_material({0, 0, 0})})
    splats.material.back.clear();
  if (!is_black(take_emission(reading, shape))) shape.fail("splats cannot shine: use a mesh");
  if (has_inside(splats.material) && !splats.closed)
    shape.fail("the cloud is open, so that it has no inside for its material; 'closed' says otherwise");
  shape.finish();
  reading.result.scene.splats.push_back(std::move(splats));
}

}  // namespace embrun

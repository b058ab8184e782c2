#include "render/cloud_options.h"

#include "base/error.h"
#include "render/option_names.h"

namespace embrun {

SplatOptions splat_options(const CloudOptions& options) {
  SplatOptions splats;
  splats.normals = normal_choice_from_name(options.normals);
  if (options.neighbours)
    splats.neighbours = *options.neighbours > 0 ? static_cast<std::size_t>(*options.neighbours) : 0;
  if (options.sensor) splats.sensor = Vec3d{(*options.sensor)[0], (*options.sensor)[1], (*options.sensor)[2]};
  splats.radius = options.splat_radius;
  splats.radius_scale = options.splat_scale;
  splats.ellipses = ellipses_from_name(options.splat_shape);
  splats.closed = closed_from_name(options.closed);
  splats.keep_duplicates = options.keep_duplicates;
  splats.outlier_ratio = options.outlier_ratio;
  splats.thin = options.thin;
  return splats;
}

CloudVerdict cloud_verdict(const ParticleSet& particles, const CloudOptions& options) {
  const std::optional<bool> asked = surface_from_name(options.points);
  if (!asked) return tell_surface(particles);
  CloudVerdict verdict;
  verdict.is_surface = *asked;
  verdict.reason = "as asked";
  return verdict;
}

}  // namespace embrun

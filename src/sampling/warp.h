#pragma once

#include "math/vec.h"
#include "sampling/sampler.h"

namespace embrun {

// Maps from the unit square to domains, each with its density. Directions are unit vectors in a local frame whose
// third axis is the pole; densities are per steradian (directions) or per unit area (disk), and 0 outside the domain.

/// Uniform point of the unit disk, by the concentric map [ShirleyChiu1997]: keeps strata compact.
EMBRUN_FN Sample2 sample_disk(Sample2 u) {
  const float a = 2.0f * u.x - 1.0f, b = 2.0f * u.y - 1.0f;
  if (a == 0.0f && b == 0.0f) return {0.0f, 0.0f};
  const bool a_larger = a * a > b * b;
  const float radius = a_larger ? a : b;
  const float angle = a_larger ? 0.25f * pi * (b / a) : 0.5f * pi - 0.25f * pi * (a / b);
  return {radius * cosf(angle), radius * sinf(angle)};
}
EMBRUN_FN float disk_pdf() { return inv_pi; }

/// Direction with density cos(theta)/pi on the hemisphere z > 0. z is at least 1e-6, so never in the horizon.
EMBRUN_FN Vec3 sample_cosine_hemisphere(Sample2 u) {
  const Sample2 d = sample_disk(u);
  return {d.x, d.y, sqrtf(max_of(1e-12f, 1.0f - d.x * d.x - d.y * d.y))};
}
EMBRUN_FN float cosine_hemisphere_pdf(float cos_theta) { return max_of(cos_theta, 0.0f) * inv_pi; }

/// Unit vector at height `z` of the unit sphere, turned by the fraction `turn` of a circle.
EMBRUN_FN Vec3 direction_at_height(float z, float turn) {
  const float radius = sqrtf(max_of(0.0f, 1.0f - z * z));
  const float angle = 2.0f * pi * turn;
  return {radius * cosf(angle), radius * sinf(angle), z};
}

EMBRUN_FN Vec3 sample_uniform_sphere(Sample2 u) { return direction_at_height(1.0f - 2.0f * u.x, u.y); }
EMBRUN_FN float uniform_sphere_pdf() { return 0.25f * inv_pi; }

EMBRUN_FN Vec3 sample_uniform_hemisphere(Sample2 u) { return direction_at_height(1.0f - u.x, u.y); }
EMBRUN_FN float uniform_hemisphere_pdf(float cos_theta) { return cos_theta >= 0.0f ? 0.5f * inv_pi : 0.0f; }

/// 1 - cos(theta) from sin^2(theta), theta in [0, pi/2], without cancellation for narrow cones.
EMBRUN_FN float one_minus_cos_from_sin2(float sin2) { return sin2 / (1.0f + sqrtf(max_of(0.0f, 1.0f - sin2))); }

/// Uniform direction within the cone of half angle theta round +z, given as `h = 1 - cos(theta)`, which keeps its
/// precision for cones as narrow as the sun's.
EMBRUN_FN Vec3 sample_cone(Sample2 u, float h) {
  const float drop = u.x * h;  // 1 - z
  const float radius = sqrtf(max_of(0.0f, drop * (2.0f - drop)));
  const float angle = 2.0f * pi * u.y;
  return {radius * cosf(angle), radius * sinf(angle), 1.0f - drop};
}
EMBRUN_FN float cone_pdf(float h) { return 1.0f / (2.0f * pi * h); }

/// Uniform point of a triangle as barycentric weights of its second and third vertex [Heitz2019]; its density is
/// 1/area. No square root, and less distortion than the usual map.
EMBRUN_FN Sample2 sample_triangle(Sample2 u) {
  if (u.y > u.x) {
    const float half = 0.5f * u.x;
    return {half, u.y - half};
  }
  const float half = 0.5f * u.y;
  return {u.x - half, half};
}

}  // namespace embrun

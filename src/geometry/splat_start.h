#pragma once

#include "geometry/splat.h"
#include "geometry/surface_hit.h"

// Rays that leave a surface of splats. The splats round the one that was left lie a little above or below it, and the ray
// is not to meet them.

namespace embrun {

/// Two splats of one sheet lie so far apart, as a share of their radius, where they overlap: a sheet whose radius of
/// curvature is R has splats that differ by r^2 / (2 R) at a distance r from a centre, an eighth of r where R is 4 r.
inline constexpr float splat_sheet_depth = 0.125f;
/// Their normals differ by less than this cosine says: by 60 degrees. A sharper edge has two sheets.
inline constexpr float splat_sheet_cosine = 0.5f;

/// The surface of splats that a ray leaves.
struct SplatStart {
  Vec3 normal;          ///< unit, of the surface, out of the body
  float radius = 0;     ///< of the splat that was left; 0: the ray starts elsewhere
  bool behind = false;  ///< the ray leaves on the side that the normal does not point to
};

/// True when a splat whose normal has the cosine `along` with the ray is no meeting, as it belongs to the surface that the
/// ray leaves.
///
/// Near by, the back of a splat (as seen from the side that the ray leaves on) is one that reaches over the start, or over
/// an edge: a ray that leaves a body meets no back before a front. A front is that of the same sheet if it may overlap the
/// splat that was left, the start is hardly above it and its normal is much the same; else it is another wall of a
/// corner, which is to be met.
EMBRUN_FN bool of_the_sheet_left(const SplatStart& start, const Splat& splat, Vec3 origin, float along) {
  if (start.radius == 0.0f) return false;
  const Vec3 from_center = origin - splat.center;
  const float near = square(splat.radius + start.radius), distance = length_squared(from_center);
  if ((along < 0.0f) == start.behind) return distance <= 4.0f * near;
  if (distance > near) return false;
  const float height = dot(from_center, splat.normal) * (start.behind ? -1.0f : 1.0f);
  return height <= splat_sheet_depth * max_of(splat.radius, start.radius) &&
         dot(splat.normal, start.normal) >= splat_sheet_cosine;
}

/// A unit vector in 16 bits, to within a degree: the octahedron unfolded onto a square [Meyer2010].
EMBRUN_FN std::int16_t pack_direction(Vec3 v) {
  const float sum = fabsf(v.x) + fabsf(v.y) + fabsf(v.z);
  float a = v.x / sum, b = v.y / sum;
  if (v.z < 0.0f) {
    const float folded = (1.0f - fabsf(b)) * (a < 0.0f ? -1.0f : 1.0f);
    b = (1.0f - fabsf(a)) * (b < 0.0f ? -1.0f : 1.0f);
    a = folded;
  }
  const int i = static_cast<int>(floorf(a * 127.0f + 127.5f)), j = static_cast<int>(floorf(b * 127.0f + 127.5f));
  return static_cast<std::int16_t>(i << 8 | j);
}

EMBRUN_FN Vec3 unpack_direction(std::int16_t packed) {
  const auto bits = static_cast<std::uint16_t>(packed);
  Vec3 v{(static_cast<float>(bits >> 8) - 127.0f) / 127.0f, (static_cast<float>(bits & 255) - 127.0f) / 127.0f, 0.0f};
  v.z = 1.0f - fabsf(v.x) - fabsf(v.y);
  if (v.z < 0.0f) {
    const float x = v.x;
    v.x = (1.0f - fabsf(v.y)) * (x < 0.0f ? -1.0f : 1.0f);
    v.y = (1.0f - fabsf(x)) * (v.y < 0.0f ? -1.0f : 1.0f);
  }
  return normalize(v);
}

/// Clearances of splats carry the instance as one below -1, the splat's radius and the surface's normal.
EMBRUN_FN Clearance clearance_of_splats(const SurfaceHit& hit, int instance) {
  return {hit.splat_radius, pack_direction(hit.geometric_normal), static_cast<std::int16_t>(-2 - instance)};
}

/// What a ray that starts with a clearance leaves, if that is the splats of an instance.
EMBRUN_FN SplatStart splat_start_of(const Ray& ray, int instance) {
  if (ray.clearance.instance != -2 - instance) return {};
  const Vec3 normal = unpack_direction(ray.clearance.sheet);
  return {normal, ray.clearance.distance, dot(ray.direction, normal) < 0.0f};
}

}  // namespace embrun

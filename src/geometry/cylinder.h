#pragma once

#include "geometry/surface_hit.h"
#include "math/ray.h"

namespace embrun {

/// The side of a cylinder, without ends: the points at `radius` from the segment of `length` along the unit vector
/// `axis` from `start`.
struct Cylinder {
  Vec3 start;
  Vec3 axis{0, 0, 1};
  float length = 1;
  float radius = 1;
  Vec3 meridian{1, 0, 0};   ///< unit, at right angles to the axis: where its coordinate u is 0
  bool u_reversed = false;  ///< u grows to the left about the axis, not to the right
};

/// First crossing of the side with t in (t_min, t_max); false leaves `hit` alone. Normals point away from the axis;
/// `entering` says that the ray runs against them: the surface is open and has no inside.
EMBRUN_FN bool intersect_cylinder(const Cylinder& cylinder, const Ray& ray, SurfaceHit& hit) {
  const Vec3 from_start = ray.origin - cylinder.start;
  const float rise = dot(ray.direction, cylinder.axis), height = dot(from_start, cylinder.axis);
  const Vec3 across = ray.direction - rise * cylinder.axis, away = from_start - height * cylinder.axis;
  const float speed_squared = length_squared(across);
  if (!(speed_squared > 0.0f)) return false;
  // About the point of the ray nearest to the axis, as for a ball.
  const float t_middle = -dot(away, across) / speed_squared;
  const float half_chord_squared = square(cylinder.radius) - length_squared(away + t_middle * across);
  if (!(half_chord_squared > 0.0f)) return false;
  const float half_chord = sqrtf(half_chord_squared / speed_squared);
  for (int side = 0; side < 2; ++side) {
    const float t = side == 0 ? t_middle - half_chord : t_middle + half_chord;
    const float level = height + t * rise;
    if (!(t > ray.t_min && t < ray.t_max && level >= 0.0f && level <= cylinder.length)) continue;
    hit.t = t;
    hit.geometric_normal = hit.shading_normal = normalize(away + t * across);
    hit.position = cylinder.start + level * cylinder.axis + cylinder.radius * hit.geometric_normal;
    hit.entering = side == 0;
    return true;
  }
  return false;
}

}  // namespace embrun

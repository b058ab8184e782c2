#pragma once

#include "geometry/surface_hit.h"
#include "math/ray.h"

namespace embrun {

/// A flat rectangle: a floor, a wall, the shape of a lamp. `axis_u` and `axis_v` are unit vectors at
/// right angles, `normal` is cross(axis_u, axis_v), `half_u` and `half_v` may be infinite (a whole plane). A round one is
/// the ellipse in the rectangle.
struct Patch {
  Vec3 center;
  Vec3 axis_u{1, 0, 0};
  Vec3 axis_v{0, 0, -1};
  Vec3 normal{0, 1, 0};
  float half_u = infinity;
  float half_v = infinity;
  bool round = false;
  bool v_reversed = false;  ///< its coordinate v grows against axis_v
};

/// The crossing of the patch with t in (t_min, t_max); false leaves `hit` alone. `entering` says that the
/// ray runs against the normal; a patch has no inside.
EMBRUN_FN bool intersect_patch(const Patch& patch, const Ray& ray, SurfaceHit& hit) {
  const float slope = dot(ray.direction, patch.normal);
  if (slope == 0.0f) return false;
  const float t = dot(patch.center - ray.origin, patch.normal) / slope;
  if (!(t > ray.t_min && t < ray.t_max)) return false;
  const Vec3 offset = ray.at(t) - patch.center;
  const float u = dot(offset, patch.axis_u), v = dot(offset, patch.axis_v);
  if (!(fabsf(u) <= patch.half_u && fabsf(v) <= patch.half_v)) return false;
  if (patch.round && square(u / patch.half_u) + square(v / patch.half_v) > 1.0f) return false;
  hit.t = t;
  hit.position = patch.center + u * patch.axis_u + v * patch.axis_v;
  hit.geometric_normal = hit.shading_normal = patch.normal;
  hit.entering = slope < 0.0f;
  return true;
}

}  // namespace embrun

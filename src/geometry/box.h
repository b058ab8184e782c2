#pragma once

#include "geometry/surface_hit.h"
#include "math/ray.h"

namespace embrun {

/// The stretch [enter, exit] of a ray inside a box, and the axes of the faces it goes through there.
struct BoxSpan {
  float enter = -infinity, exit = infinity;
  int enter_axis = 0, exit_axis = 0;

  EMBRUN_FN bool empty() const { return !(enter < exit); }
};

/// Clips the whole line of a ray, in both directions, to a box. A ray parallel to a pair of faces is
/// in or out by its origin; one that lies in a face counts as inside.
EMBRUN_FN BoxSpan clip_line(const Box3& box, const Ray& ray) {
  BoxSpan span;
  for (int axis = 0; axis < 3; ++axis) {
    const float d = ray.direction[axis], to_low = box.low[axis] - ray.origin[axis],
                to_high = box.high[axis] - ray.origin[axis];
    if (d == 0.0f) {
      if (to_low > 0.0f || to_high < 0.0f) span.exit = -infinity;
      continue;
    }
    const float inverse = 1.0f / d;
    const float t_near = (d > 0.0f ? to_low : to_high) * inverse, t_far = (d > 0.0f ? to_high : to_low) * inverse;
    if (t_near > span.enter) {
      span.enter = t_near;
      span.enter_axis = axis;
    }
    if (t_far < span.exit) {
      span.exit = t_far;
      span.exit_axis = axis;
    }
  }
  return span;
}

/// The point of the ray at t, put exactly on the box's face, with the face's outward normal.
EMBRUN_FN void fill_box_face(const Box3& box, const Ray& ray, float t, int axis, bool entering, SurfaceHit& hit) {
  const bool high_face = (ray.direction[axis] > 0.0f) != entering;
  Vec3 normal;
  normal[axis] = high_face ? 1.0f : -1.0f;
  hit.t = t;
  hit.position = ray.at(t);
  hit.position[axis] = high_face ? box.high[axis] : box.low[axis];
  hit.geometric_normal = hit.shading_normal = normal;
  hit.entering = entering;
  hit.reach = 0;
}

/// First crossing of the box's faces with t in (t_min, t_max); false leaves `hit` alone.
EMBRUN_FN bool intersect_box(const Box3& box, const Ray& ray, SurfaceHit& hit) {
  const BoxSpan span = clip_line(box, ray);
  if (span.empty()) return false;
  const bool entering = span.enter > ray.t_min;
  const float t = entering ? span.enter : span.exit;
  if (!(t > ray.t_min && t < ray.t_max)) return false;
  fill_box_face(box, ray, t, entering ? span.enter_axis : span.exit_axis, entering, hit);
  return true;
}

}  // namespace embrun

#pragma once

#include "geometry/box.h"

namespace embrun {

/// How far rounding may have put the start of a ray: what stands at a face outside, as a floor does, is left within the box
/// by the last digits of a hit's position, and what left by the body's own surface within the body.
EMBRUN_FN float start_rounding(Vec3 start) {
  return 3e-5f * max_of(fabsf(start.x), max_of(fabsf(start.y), fabsf(start.z)));
}

/// Whether a ray that starts in the box came in that little before.
EMBRUN_FN bool starts_at_face(const Ray& ray, const BoxSpan& span, float rounding) {
  return (ray.t_min - span.enter) * fabsf(ray.direction[span.enter_axis]) <= rounding;
}

/// The intersection of a closed body with a box, whose faces close it where they cut through it: a fluid
/// in its container. `Body` has
///   bool intersect(const Ray&, Side, SurfaceHit&) const;   // first crossing with t in (t_min, t_max)
///   bool contains(Vec3) const;
/// First crossing of the clipped body with t in (t_min, t_max); false leaves `hit` unspecified.
/// `side` is the side of the clipped body that the ray starts on.
template <class Body>
EMBRUN_LOCAL_FN bool intersect_clipped(const Body& body, const Box3& box, const Ray& ray, Side side, SurfaceHit& hit) {
  if (side == Side::unknown) {
    side = box.contains(ray.origin) && body.contains(ray.origin) ? Side::inside : Side::outside;
  }
  const BoxSpan span = clip_line(box, ray);

  // From inside, the ray leaves by the body's own surface or by a face, whichever comes first. An origin
  // that rounding has put out of the box leaves at once.
  if (side == Side::inside) {
    const float t_face = span.empty() ? ray.t_min : max_of(span.exit, ray.t_min);
    Ray inner = ray;
    inner.t_max = min_of(ray.t_max, t_face);
    if (inner.t_max > ray.t_min && body.intersect(inner, Side::inside, hit)) return true;
    if (!(t_face < ray.t_max)) return false;
    fill_box_face(box, ray, t_face, span.exit_axis, false, hit);
    return true;
  }

  // From outside, a face is a way in where the body reaches it; elsewhere the body's surface in the box is.
  if (span.empty() || !(span.exit > ray.t_min && span.enter < ray.t_max)) return false;
  Ray inner = ray;
  inner.t_max = min_of(ray.t_max, span.exit);
  if (span.enter > ray.t_min) {
    SurfaceHit face;
    fill_box_face(box, ray, span.enter, span.enter_axis, true, face);
    if (body.contains(face.position)) {
      hit = face;
      return true;
    }
    inner.t_min = span.enter;
  } else if (const Vec3 start = ray.at(ray.t_min);
             starts_at_face(ray, span, start_rounding(start)) && body.contains(start)) {
    // In by the face; or just out by the body's own surface beside it, if a little further on it is out.
    const float further = ray.t_min + start_rounding(start);
    if (body.contains(ray.at(further))) {
      fill_box_face(box, ray, ray.t_min, span.enter_axis, true, hit);
      return true;
    }
    inner.t_min = further;
  }
  return body.intersect(inner, Side::outside, hit);
}

}  // namespace embrun

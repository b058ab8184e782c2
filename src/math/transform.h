#pragma once

#include "math/ray.h"

namespace embrun {

/// An affine map x -> x_axis x.x + y_axis x.y + z_axis x.z + origin.
struct Transform {
  Vec3 x_axis{1, 0, 0}, y_axis{0, 1, 0}, z_axis{0, 0, 1};
  Vec3 origin;

  EMBRUN_FN Vec3 vector(Vec3 v) const { return x_axis * v.x + y_axis * v.y + z_axis * v.z; }
  EMBRUN_FN Vec3 point(Vec3 p) const { return vector(p) + origin; }
  /// The transpose of the linear part: with the inverse of a map, it takes normals where the map takes points.
  EMBRUN_FN Vec3 transposed(Vec3 v) const { return {dot(x_axis, v), dot(y_axis, v), dot(z_axis, v)}; }
};

EMBRUN_FN bool operator==(const Transform& a, const Transform& b) {
  return a.x_axis == b.x_axis && a.y_axis == b.y_axis && a.z_axis == b.z_axis && a.origin == b.origin;
}

/// Volume factor of the map; 0 when it cannot be inverted, negative when it mirrors.
EMBRUN_FN float determinant(const Transform& m) { return dot(cross(m.x_axis, m.y_axis), m.z_axis); }

/// The inverse of a map whose determinant is not 0.
EMBRUN_FN Transform inverse_of(const Transform& m) {
  const float s = 1.0f / determinant(m);
  const Vec3 r0 = cross(m.y_axis, m.z_axis) * s, r1 = cross(m.z_axis, m.x_axis) * s, r2 = cross(m.x_axis, m.y_axis) * s;
  Transform inverse{{r0.x, r1.x, r2.x}, {r0.y, r1.y, r2.y}, {r0.z, r1.z, r2.z}, {}};
  inverse.origin = -inverse.vector(m.origin);
  return inverse;
}

/// The ray in the space that `m` leads to, its direction of unit length again and its footprint scaled as lengths along it
/// are; Ray::detail stays in world metres. `scale` receives the length of a unit of the old ray parameter in the new space.
EMBRUN_FN Ray transform_ray(const Transform& m, const Ray& ray, float& scale) {
  Ray out = ray;
  out.origin = m.point(ray.origin);
  out.direction = m.vector(ray.direction);
  scale = length(out.direction);
  out.direction = out.direction / scale;
  out.t_min = ray.t_min * scale;
  out.t_max = ray.t_max * scale;
  out.cone_width = ray.cone_width * scale;
  return out;
}

}  // namespace embrun

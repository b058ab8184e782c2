#pragma once

#include <algorithm>

#include "math/vec.h"

namespace embrun {

/// An affine map of the world in double precision: x -> x_axis x.x + y_axis x.y + z_axis x.z + origin.
struct Placement {
  Vec3d x_axis{1, 0, 0}, y_axis{0, 1, 0}, z_axis{0, 0, 1};
  Vec3d origin;

  bool operator==(const Placement&) const = default;
};

inline Vec3d place_vector(const Placement& p, Vec3d v) { return p.x_axis * v.x + p.y_axis * v.y + p.z_axis * v.z; }
inline Vec3d place(const Placement& p, Vec3d point) { return place_vector(p, point) + p.origin; }

/// First `inner`, then `outer`.
inline Placement compose(const Placement& outer, const Placement& inner) {
  return {place_vector(outer, inner.x_axis), place_vector(outer, inner.y_axis), place_vector(outer, inner.z_axis),
          place(outer, inner.origin)};
}

/// Volume factor; 0: it flattens, negative: it mirrors.
inline double determinant(const Placement& p) { return dot(cross(p.x_axis, p.y_axis), p.z_axis); }

/// How much larger lengths become, at most, along the axes.
inline double largest_scale(const Placement& p) {
  return std::max({length(p.x_axis), length(p.y_axis), length(p.z_axis)});
}

}  // namespace embrun

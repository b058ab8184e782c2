#pragma once

#include <algorithm>
#include <span>

#include "math/vec.h"

namespace embrun {

/// A box in double precision, of the world or of points as files have them; empty when low > high (as a fresh one is).
struct Box3d {
  Vec3d low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};

  bool operator==(const Box3d&) const = default;
  bool empty() const { return low.x > high.x; }
  void include(Vec3d p) {
    low = min_of(low, p);
    high = max_of(high, p);
  }
  void include(Vec3d p, double radius) {
    include(p - Vec3d{radius, radius, radius});
    include(p + Vec3d{radius, radius, radius});
  }
  /// Along the axis where it is longest; not of an empty box.
  double extent() const { return std::max({high.x - low.x, high.y - low.y, high.z - low.z}); }
};

inline Box3d box_of(std::span<const Vec3d> points) {
  Box3d box;
  for (const Vec3d p : points) box.include(p);
  return box;
}

}  // namespace embrun

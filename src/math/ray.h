#pragma once

#include <cstdint>

#include "math/vec.h"

namespace embrun {

/// What is known of the way ahead of a ray that leaves a surface: it meets that surface again after `distance` (metres)
/// at the earliest. Surfaces may have several sheets, numbered; it is the sheet `sheet` of the geometry instance
/// `instance` that is known of. For rays that leave splats (see geometry/splat_start.h) the numbers mean something else.
struct Clearance {
  float distance = 0.0f;  ///< 0: nothing is known
  std::int16_t sheet = 0;
  std::int16_t instance = -1;
};

/// A ray in scene coordinates. `direction` has unit length, so parameters are distances in metres.
/// `cone_width` (metres, at the origin) and `cone_spread` (radians) are its footprint.
struct Ray {
  Vec3 origin;
  float t_min = 0.0f;
  Vec3 direction{0, 0, 1};
  float t_max = infinity;
  float time = 0.0f;
  float cone_width = 0.0f;
  float cone_spread = 0.0f;
  /// What levels of detail go by that must not change along a path: the footprint where the path's first ray came to what
  /// has them, metres of the world in any space. 0: they are off, or not known.
  float detail = 0.0f;
  Clearance clearance;

  EMBRUN_FN Vec3 at(float t) const { return origin + direction * t; }
};

}  // namespace embrun

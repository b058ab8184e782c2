#pragma once

#include "math/vec.h"

namespace embrun {

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

  EMBRUN_FN Vec3 at(float t) const { return origin + direction * t; }
};

}  // namespace embrun

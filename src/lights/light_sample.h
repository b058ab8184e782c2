#pragma once

#include "math/rgb.h"

namespace embrun {

/// Light that may arrive at a point: what to trace a shadow ray for.
struct LightSample {
  Vec3 direction;      ///< unit, from the point towards the light
  float distance = 0;  ///< metres to the light; infinite for the environment and distant lights
  Rgb radiance;        ///< arriving along `direction` if nothing is in between
  float pdf = 0;       ///< per steradian round the point
  bool valid = false;  ///< false: no light can arrive; the other members mean nothing
};

}  // namespace embrun

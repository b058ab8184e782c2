#pragma once

#include "math/rgb.h"

namespace embrun {

/// Light that may arrive at a point: what to trace a shadow ray for. Of a light without extent no direction can be met by
/// chance: `radiance` is then the irradiance on a surface that faces it, and `pdf` the chance with which the light was
/// chosen, so that radiance / pdf times what scatters per steradian is right for all of them.
struct LightSample {
  Vec3 direction;      ///< unit, from the point towards the light
  float distance = 0;  ///< metres to the light; infinite for the environment and distant lights
  Rgb radiance;        ///< arriving along `direction` if nothing is in between
  float pdf = 0;       ///< per steradian round the point
  bool delta = false;  ///< from a light without extent: no other technique finds this light
  bool valid = false;  ///< false: no light can arrive; the other members mean nothing
};

}  // namespace embrun

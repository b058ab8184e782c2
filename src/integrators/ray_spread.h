#pragma once

#include "base/host_device.h"
#include "math/vec.h"

namespace embrun {

/// The spread of a ray's footprint (see Ray) that is one of those drawn with a density of `pdf` per steradian: as if some
/// hundreds of them shared the sphere's part that they fall on, a disc of the sphere for each. Radians.
inline constexpr float cone_of_density = 0.05f;
inline constexpr float widest_cone = 0.2f;
EMBRUN_FN float spread_of_density(float pdf) {
  return pdf > 0.0f ? min_of(cone_of_density / sqrtf(pdf), widest_cone) : 0.0f;
}

}  // namespace embrun

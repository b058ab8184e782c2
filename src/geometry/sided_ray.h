#pragma once

#include "geometry/surface_hit.h"
#include "math/ray.h"

namespace embrun {

/// A ray and the side of a surface that it is on where it starts.
struct SidedRay {
  Ray ray;
  Side side = Side::unknown;
};

}  // namespace embrun

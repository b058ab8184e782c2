#pragma once

#include "geometry/surface_hit.h"
#include "math/ray.h"

namespace embrun::test {

struct TestRay {
  Ray ray;
  Side side = Side::unknown;
};

}  // namespace embrun::test

#pragma once

#include "math/vec.h"

namespace embrun {

/// Where a ray is with respect to a closed surface when it starts.
enum class Side { unknown, outside, inside };

/// A crossing of a closed surface. Both normals are unit vectors that point out of the body.
struct SurfaceHit {
  float t = infinity;
  Vec3 position;
  Vec3 geometric_normal;  ///< minus the gradient of the field: decides sides
  Vec3 shading_normal;    ///< what reflects and refracts
  bool entering = false;  ///< from outside to inside
};

}  // namespace embrun

#pragma once

#include "math/vec.h"

namespace embrun {

/// Which scene axis points up. Solvers and tools disagree; everything that knows up from down asks this.
enum class UpAxis { y, z };

/// Right-handed basis (right, up, back) of a scene: `back` points from the scene to a viewer in front of it.
/// y up: (+x, +y, +z); z up: (+x, +z, -y).
struct UpBasis {
  Vec3 right{1, 0, 0};
  Vec3 up{0, 1, 0};
  Vec3 back{0, 0, 1};
};

EMBRUN_FN UpBasis up_basis(UpAxis axis) {
  return axis == UpAxis::y ? UpBasis{} : UpBasis{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}};
}

}  // namespace embrun

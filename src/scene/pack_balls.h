#pragma once

#include <vector>

#include "geometry/ball.h"

namespace embrun {

/// The balls in blocks of neighbours, in the order of a space-filling curve [Morton1966], so that a block's bounds are
/// small. The last block is filled up with lanes that stand for none. The same for any number of threads.
std::vector<BallBlock> pack_balls(const std::vector<Ball>& balls);

/// The bounds of a block's balls, wider by `margin` metres on every side.
Box3 bounds_of(const BallBlock& block, float margin);

}  // namespace embrun

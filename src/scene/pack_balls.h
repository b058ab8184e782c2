#pragma once

#include <vector>

#include "geometry/ball.h"

namespace embrun {

/// The balls in blocks of neighbours, in the order of a space-filling curve [Morton1966], so that a block's bounds are
/// small. The last block is filled up with lanes that stand for none. The same for any number of threads.
std::vector<BallBlock> pack_balls(const std::vector<Ball>& balls);

}  // namespace embrun

#pragma once

#include <cstdint>

#include "geometry/grid_walk.h"
#include "math/ray.h"

namespace embrun {

/// Coarsely, where the bodies are that have levels of detail by the path (see Ray::detail).
struct DetailBlocks {
  CellGrid blocks;
  const std::uint8_t* filled = nullptr;  ///< of each block: whether something may be in it
};

/// The footprint of a ray from the camera where it first comes to such a body, metres; where it comes to none, what it is at
/// the distance of their box: 0 where there are no such bodies.
EMBRUN_LOCAL_FN float footprint_at_blocks(const DetailBlocks& s, const Ray& ray) {
  if (s.blocks.nx == 0) return 0.0f;
  float distance = -1.0f;
  for (GridWalk walk(s.blocks, ray.origin, ray.direction, ray.t_min, ray.t_max); !walk.done; walk.advance()) {
    if (s.filled[walk.index()] == 0) continue;
    distance = walk.begin;
    break;
  }
  if (distance < 0.0f) {
    const Vec3 nearest = max_of(s.blocks.low, min_of(s.blocks.high(), ray.origin));
    distance = length(nearest - ray.origin);
  }
  return ray.cone_width + ray.cone_spread * distance;
}

}  // namespace embrun

#include "scene/pack_balls.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "base/parallel.h"

namespace embrun {
namespace {

/// Moves each of the low 21 bits to three times its place.
std::uint64_t spread_bits(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x001f00000000ffffu;
  v = (v | v << 16) & 0x001f0000ff0000ffu;
  v = (v | v << 8) & 0x100f00f00f00f00fu;
  v = (v | v << 4) & 0x10c30c30c30c30c3u;
  v = (v | v << 2) & 0x1249249249249249u;
  return v;
}

}  // namespace

std::vector<BallBlock> pack_balls(const std::vector<Ball>& balls) {
  Box3 bounds;
  for (const Ball& ball : balls) bounds.include(ball.center);
  const Vec3 size = bounds.high - bounds.low;
  const float longest = std::max({size.x, size.y, size.z, 1e-30f});
  const float scale = 2097151.0f / longest;

  // A place on the curve, and the ball there.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(balls.size());
  parallel_for(balls.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = (balls[i].center - bounds.low) * scale;
      const auto cell = [](float c) { return static_cast<std::uint64_t>(std::clamp(c, 0.0f, 2097151.0f)); };
      order[i] = {spread_bits(cell(p.x)) | spread_bits(cell(p.y)) << 1 | spread_bits(cell(p.z)) << 2,
                  static_cast<std::uint32_t>(i)};
    }
  });
  parallel_sort(order);

  std::vector<BallBlock> blocks((balls.size() + balls_per_block - 1) / balls_per_block);
  parallel_for(blocks.size(), 1 << 12, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      for (std::size_t lane = 0; lane < balls_per_block; ++lane) {
        const std::size_t i = b * balls_per_block + lane;
        // A lane that stands for none is at its neighbour's place.
        const Ball& ball = balls[order[std::min(i, order.size() - 1)].second];
        blocks[b].x[lane] = ball.center.x;
        blocks[b].y[lane] = ball.center.y;
        blocks[b].z[lane] = ball.center.z;
        blocks[b].radius[lane] = i < order.size() ? ball.radius : 0.0f;
      }
  });
  return blocks;
}

}  // namespace embrun

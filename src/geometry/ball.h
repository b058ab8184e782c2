#pragma once

#include "geometry/surface_hit.h"
#include "math/ray.h"

namespace embrun {

/// A solid ball.
struct Ball {
  Vec3 center;
  float radius = 0;
};

inline constexpr int balls_per_block = 8;

/// Balls side by side, for loops over all of them at once. A lane of radius 0 stands for none and is never met.
struct BallBlock {
  float x[balls_per_block], y[balls_per_block], z[balls_per_block];
  float radius[balls_per_block];

  EMBRUN_FN Ball ball(std::uint32_t lane) const { return {{x[lane], y[lane], z[lane]}, radius[lane]}; }
};

/// The bounds of a block's balls, wider by `margin` metres on every side.
inline Box3 bounds_of(const BallBlock& block, float margin) {
  Box3 bounds;
  for (std::uint32_t lane = 0; lane < balls_per_block; ++lane) {
    const Ball ball = block.ball(lane);
    if (ball.radius == 0.0f) continue;
    // A little more, for the rounding of the sums.
    const float reach = ball.radius * 1.00001f + margin;
    bounds.include(ball.center - Vec3{reach, reach, reach});
    bounds.include(ball.center + Vec3{reach, reach, reach});
  }
  return bounds;
}

/// The line of a ray against each ball of a block: the parameter nearest to the centre, and the square of half the length
/// in the ball (not positive: it is missed). The quadratic is solved about that nearest point, so that far or small
/// balls keep their precision [Haines2019].
struct BlockChords {
  float middle[balls_per_block], half_squared[balls_per_block];
};

EMBRUN_FN void chords_of(const BallBlock& block, const Ray& ray, BlockChords& chords) {
  const Vec3 o = ray.origin, d = ray.direction;
  for (int i = 0; i < balls_per_block; ++i) {
    const float x = block.x[i] - o.x, y = block.y[i] - o.y, z = block.z[i] - o.z;
    const float t = x * d.x + y * d.y + z * d.z;
    const float across_x = x - t * d.x, across_y = y - t * d.y, across_z = z - t * d.z;
    chords.middle[i] = t;
    chords.half_squared[i] =
        block.radius[i] * block.radius[i] - (across_x * across_x + across_y * across_y + across_z * across_z);
  }
}

/// The crossing of a ball's surface at `t`, put exactly on the ball.
EMBRUN_FN void fill_ball_hit(const Ball& ball, const Ray& ray, float t, bool entering, SurfaceHit& hit) {
  hit.t = t;
  hit.geometric_normal = normalize(ray.at(t) - ball.center);
  hit.position = ball.center + hit.geometric_normal * ball.radius;
  hit.shading_normal = hit.geometric_normal;
  hit.entering = entering;
  hit.reach = 0;
}

EMBRUN_FN bool ball_contains(const Ball& ball, Vec3 point) {
  return length_squared(point - ball.center) < square(ball.radius);
}

}  // namespace embrun

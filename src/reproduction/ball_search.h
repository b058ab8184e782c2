#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "math/vec.h"

// The two ways in which the thesis has its particles for the density integral (section 5.3.1): a uniform grid of cells of
// 2 R0, and a kd-tree by the surface area heuristic. A ray asks for all balls that it passes through, as Algorithm 1 does,
// not for the nearest. They are for this comparison alone: the renderer has a grid of its own (media/particle_density.h).

namespace embrun {

/// A ray's way through a ball.
struct BallChord {
  float enter = 0, exit = 0;
  std::uint32_t ball = 0;
};

/// Remembers which balls a ray has met: both structures hold a ball in several places.
class MetBalls {
 public:
  explicit MetBalls(std::size_t count) : last_ray_(count, 0) {}
  void next_ray() { ++ray_; }
  /// True the first time.
  bool meet(std::uint32_t ball) {
    if (last_ray_[ball] == ray_) return false;
    last_ray_[ball] = ray_;
    return true;
  }

 private:
  std::vector<std::uint32_t> last_ray_;
  std::uint32_t ray_ = 0;
};

class BallGrid {
 public:
  /// `radius` > 0, at least one ball.
  BallGrid(std::span<const Vec3> centers, float radius);
  /// Appends the chords of the ray's part with t in (0, t_end), `direction` unit, in no order. `met` is at a new ray.
  void gather(Vec3 origin, Vec3 direction, float t_end, MetBalls& met, std::vector<BallChord>& chords) const;
  std::size_t bytes() const;

 private:
  std::size_t index(const int cell[3]) const;

  std::span<const Vec3> centers_;
  float radius_, cell_;
  Vec3 low_, high_;
  int cells_[3];
  std::vector<std::uint32_t> starts_, balls_;
};

class BallKdTree {
 public:
  BallKdTree(std::span<const Vec3> centers, float radius);
  void gather(Vec3 origin, Vec3 direction, float t_end, MetBalls& met, std::vector<BallChord>& chords) const;
  std::size_t bytes() const;

 private:
  friend class BallTreeBuilder;
  struct Node {
    float split = 0;
    std::int32_t axis = -1;   ///< -1: a leaf
    std::uint32_t first = 0;  ///< the low child, the high one follows it; or the leaf's first ball
    std::uint32_t count = 0;  ///< of the leaf's balls
  };

  std::span<const Vec3> centers_;
  float radius_;
  Vec3 low_, high_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> balls_;
};

struct SearchFigures {
  double build_seconds = 0, rays_per_second = 0;
  double bytes_per_ball = 0;
};

struct BallSearchFigures {
  SearchFigures grid, tree;
  std::size_t balls = 0, rays = 0;
  double chords_per_ray = 0;
  bool agree = false;  ///< both found the same chords
};

/// Measures both on one thread with rays that begin in random balls and go in random directions to the end of the fluid.
/// Throws Error when there are no balls.
BallSearchFigures compare_ball_search(std::span<const Vec3> centers, float radius, std::size_t rays);

}  // namespace embrun

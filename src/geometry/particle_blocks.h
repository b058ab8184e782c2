#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "math/vec.h"

namespace embrun {

/// Sixteen particles of a field, one a lane. Lanes without a particle have weight 0.
struct alignas(64) ParticleBlock {
  float x[16], y[16], z[16];
  float inverse_influence_squared[16];  ///< 1/b^2, of b >= 1e-18
  float weight[16];
};

/// The box of a block's centres (or of a tree node's) and the distance from it that its particles are felt.
struct ReachBox {
  Vec3 low, high;
  float reach = 0;

  /// Squared distance from the box of centres to the box [a, b].
  EMBRUN_FN float distance_squared(Vec3 a, Vec3 b) const {
    // (x + |x|)/2 is max(x, 0) without a branch.
    const Vec3 gap = max_of(low - b, a - high);
    const float x = gap.x + fabsf(gap.x), y = gap.y + fabsf(gap.y), z = gap.z + fabsf(gap.z);
    return 0.25f * (x * x + y * y + z * z);
  }
};

/// Particles in blocks of sixteen neighbours, under a tree of boxes: finds what is felt in a box, whatever
/// the spread of the influence radii. Particles are sorted by size class (powers of two of b) and along a
/// Hilbert curve within a class, so that a block holds near particles of like size. Reads only its arrays once
/// built, so threads may share it.
class ParticleBlocks {
 public:
  ParticleBlocks() = default;
  /// `influence` holds b of each particle, or one value for all of them. `support` is the kernel's support in
  /// units of b. `weights` may be empty (all 1). Positions must be finite and influence radii positive.
  ParticleBlocks(std::span<const Vec3> positions, std::span<const float> influence, std::span<const float> weights,
                 float support);

  std::span<const ParticleBlock> blocks() const { return blocks_; }
  std::span<const ReachBox> bounds() const { return bounds_; }
  /// Index of the particle in each lane, 16 a block; `no_particle` in empty ones.
  std::span<const std::uint32_t> sources() const { return sources_; }
  static constexpr std::uint32_t no_particle = 0xffffffffu;

  /// Appends to `found` the blocks with particles that may be felt in the box [low, high], in rising order.
  void find_near(Vec3 low, Vec3 high, std::vector<std::uint32_t>& found) const;

 private:
  // A node of a level covers eight of the next finer level; level 0 covers the blocks. One tree a size class.
  struct Tree {
    std::size_t first_block = 0, block_count = 0;
    std::vector<std::vector<ReachBox>> levels;
  };
  void build_tree(std::size_t first_block, std::size_t block_count);
  void find_in_tree(const Tree& tree, std::size_t level, std::size_t begin, std::size_t end, Vec3 low, Vec3 high,
                    std::vector<std::uint32_t>& found) const;

  std::vector<ParticleBlock> blocks_;
  std::vector<ReachBox> bounds_;
  std::vector<std::uint32_t> sources_;
  std::vector<Tree> trees_;
};

}  // namespace embrun

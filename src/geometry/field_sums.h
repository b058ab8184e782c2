#pragma once

#include <cstddef>
#include <cstdint>

#include "geometry/particle_blocks.h"
#include "geometry/surface_settings.h"
#include "math/vec.h"

namespace embrun {

/// The field of some blocks of particles; what the sums below run over.
struct BlockList {
  const ParticleBlock* blocks;
  const ReachBox* bounds;
  const std::uint32_t* near;  ///< indices of the blocks to sum
  std::size_t count;
};

/// What the sums give at a point: D = sum w f, its gradient, and sum w f (x - p)/|x - p| (the weighted normal).
struct FieldSample {
  float value;
  Vec3 gradient;
  Vec3 weighted;
};

/// Sums over particles, compiled once for each instruction set: 16 particles (or points) at a time.
struct FieldSums {
  /// D at sixteen points. The sum may end once every point has reached `enough` (the largest float: never), so that
  /// a value is exact or a lower bound that is at least `enough`. List nearer blocks first to end sooner.
  void (*values)(Kernel kernel, const BlockList& list, const float* x, const float* y, const float* z, float enough,
                 float* values);
  /// D, gradient and weighted normal at each of the points.
  void (*samples)(Kernel kernel, const BlockList& list, const Vec3* points, std::size_t point_count,
                  FieldSample* samples);
  /// Adds D at the 8 x 8 x 8 points corner + cell (i, j, k), i fastest, to values.
  void (*lattice)(Kernel kernel, const BlockList& list, Vec3 corner, float cell, float* values);
  /// An upper bound of D in the box [low, high]: every particle as near as the box lets it be.
  float (*most)(Kernel kernel, const BlockList& list, Vec3 low, Vec3 high);
};

inline constexpr int lattice_side = 8;

/// The version for base/instruction_set.h's choice.
const FieldSums& field_sums();

extern const FieldSums field_sums_baseline, field_sums_avx2, field_sums_avx512;

}  // namespace embrun

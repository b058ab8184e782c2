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

/// D at a point and its derivative along an axis.
struct FieldSlope {
  float value, slope;
};

/// D at a point and a vector that points away from the particles there.
struct FieldNormal {
  float value;
  Vec3 normal;
};

/// Particles packed close, sixteen a block; lanes after the last have weight 0.
struct PackedParticles {
  const ParticleBlock* blocks;
  std::size_t count;  ///< of particles

  std::size_t block_count() const { return (count + 15) / 16; }
};

/// D and its gradient at a point, and -fall <= D'' <= rise in every direction within the distance asked for.
struct FieldBound {
  float value;
  Vec3 gradient;
  float rise, fall;
};

inline constexpr int lattice_side = 4;
inline constexpr int lattice_size = lattice_side * lattice_side * lattice_side;

/// Sums over particles, compiled once for each instruction set: 16 particles (or points) at a time.
struct FieldSums {
  /// D at sixteen points. The sum may end once every point has reached `enough` (the largest float: never), so that
  /// a value is exact or a lower bound that is at least `enough`. List nearer blocks first to end sooner.
  void (*values)(Kernel kernel, const BlockList& list, const float* x, const float* y, const float* z, float enough,
                 float* values);
  /// Packs those particles that may be felt in the box [low, high] into `packed`, which has room for all the list's
  /// blocks; returns their number.
  std::size_t (*pack)(Kernel kernel, const BlockList& list, Vec3 low, Vec3 high, ParticleBlock* packed);
  /// The same of packed ones, of which only those whose distance from the box's middle is within [shell_begin, shell_end)
  /// times their influence radius are taken.
  std::size_t (*repack)(Kernel kernel, const PackedParticles& particles, Vec3 low, Vec3 high, float shell_begin,
                        float shell_end, ParticleBlock* packed);
  FieldSlope (*slope)(Kernel kernel, const PackedParticles& particles, Vec3 point, int axis);
  /// The normal of any length: sum w f (x - p)/|x - p| (weighted), or minus the gradient.
  FieldNormal (*normal)(Kernel kernel, NormalMode mode, const PackedParticles& particles, Vec3 point);
  /// Adds D at the 4 x 4 x 4 points corner + cell (i, j, k), i fastest, to `values`.
  void (*lattice)(Kernel kernel, const PackedParticles& particles, Vec3 corner, float cell, float* values);
  /// D around a point, as far as `within`; the particles must include all that are felt there.
  FieldBound (*bound)(Kernel kernel, const PackedParticles& particles, Vec3 center, float within);
  /// An upper bound of D in the box [low, high]: every particle as near as the box lets it be.
  float (*most)(Kernel kernel, const PackedParticles& particles, Vec3 low, Vec3 high);
};

/// The version for base/instruction_set.h's choice.
const FieldSums& field_sums();

extern const FieldSums field_sums_baseline, field_sums_avx2, field_sums_avx512;

}  // namespace embrun

#pragma once

#include <cstddef>
#include <cstdint>

#include "geometry/implicit_surface.h"

namespace embrun {

/// Particles that may be felt in some box, as arrays. Coordinates are in list units: lattice steps when all radii
/// are equal, grid units otherwise; `reach` (support radius) likewise, unused when radii are equal.
struct ParticleArrays {
  float* x;
  float* y;
  float* z;
  float* reach;
};

/// A recovered particle near some box: grid units, relative to the tile's corner.
struct RecoveredParticle {
  float x, y, z;
  float inverse_radius;  ///< 1/b'
  float weight;          ///< w / T'
};

/// The relative field of recovered particles, which make a body from 1 on, less more than the rounding of its sum.
inline constexpr float recovered_reach = 0.9999f;

/// What the bounds on a cell's field need besides its particles.
struct CellFrame {
  Kernel kernel;
  bool equal_radii;
  float reach;              ///< support radius in list units (equal radii)
  float support;            ///< support radius over influence radius
  float units_per_grid;     ///< list units a grid unit
  float inverse_threshold;  ///< 1/T
};

/// The loops of the surface's build that are compiled once for each instruction set.
struct CellModelLoops {
  /// Copies those of `count` particles that are felt in the box center +- half to `out` (room for count + 16),
  /// in order, and returns how many.
  std::size_t (*gather)(const CellFrame& frame, const ParticleArrays& in, std::size_t count, Vec3 center, float half,
                        const ParticleArrays& out);
  /// Sets `bit` in the marks of those of `count` particles that gather would copy.
  void (*mark)(const CellFrame& frame, const ParticleArrays& in, std::size_t count, Vec3 center, float half,
               std::uint8_t bit, std::uint8_t* marks);
  /// Decides how the cell center +- half (list units) stands to the surface by bounds on its field, and for a near
  /// cell fills quadratic and slack. `list` has room for 16 more particles. Sets `cell.kind` to outside,
  /// inside or near. `near` is scratch with the same room.
  void (*examine)(const CellFrame& frame, const ParticleArrays& list, std::size_t count, const ParticleArrays& near,
                  Vec3 center, float half, SurfaceCell& cell);
  /// Bounds where in the box center +- half (grid units) the sum of the particles' weighted kernels may reach
  /// `recovered_reach`, for positions that are off by less than `slack`: `where`, relative to the centre. False if nowhere.
  bool (*bound_recovered)(const CellFrame& frame, const RecoveredParticle* particles, std::size_t count, Vec3 center,
                          float half, float slack, Box3& where);
};

/// The version for instruction_set().
const CellModelLoops& cell_model_loops();

extern const CellModelLoops cell_model_baseline, cell_model_avx2, cell_model_avx512;

}  // namespace embrun

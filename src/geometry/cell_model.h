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
  /// cell fills quadratic, upper and lower. `list` has room for 16 more particles. Sets `cell.kind` to outside,
  /// inside or near. `near` is scratch with the same room.
  void (*examine)(const CellFrame& frame, const ParticleArrays& list, std::size_t count, const ParticleArrays& near,
                  Vec3 center, float half, SurfaceCell& cell);
};

/// The version for instruction_set().
const CellModelLoops& cell_model_loops();

extern const CellModelLoops cell_model_baseline, cell_model_avx2, cell_model_avx512;

}  // namespace embrun

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/cell_model.h"
#include "geometry/surface_model.h"
#include "math/vec.h"

namespace embrun {

inline constexpr int tile_side = 4;
/// Cells a side of a brick, whose near cells share a list.
inline constexpr int brick_side = 2;
inline constexpr std::size_t tile_cells = 64;
/// How often a cell may be split.
inline constexpr int deepest_split = 12;

/// The grid and the particles sorted into it. Lengths in list units: lattice steps when radii are equal (an integer
/// lattice, so that every cell sees the same positions to the bit), grid units otherwise.
struct GridPlan {
  double origin[3];
  double cell_size;  ///< metres
  int tiles[3];
  int cells[3];
  bool equal_radii;
  double units_per_grid;           ///< list units a grid unit
  float recovered_units_per_grid;  ///< steps of the lattice of recovered particles' lists a grid unit (equal radii)
  double target;                   ///< cells larger than this many grid units are split where the surface is
  CellFrame frame;
};

/// Particles of equal radii on the lattice, sorted by cell. Relative to the cell's low corner: those of a whole long domain
/// are more than 32 bits hold.
struct SortedLattice {
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> starts;  ///< of each cell's particles; one more than cells
};

/// Chooses the grid for these particles: cells of two radii, or larger ones to be split in a domain that is wide for
/// `most` particles.
GridPlan plan_grid(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceModel& model,
                   std::size_t most);

/// Sorts particles of equal radii.
SortedLattice sort_particles(std::span<const Vec3> positions, const GridPlan& plan);

}  // namespace embrun

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/implicit_surface.h"

namespace embrun {

/// For each of the eight directions a ray may go and each cell, the edge of the largest cube of cells that starts at
/// the cell, extends forward and holds no near cell; 0 for a near cell, at most 250. Beyond the grid nothing is near.
/// Layout: [octant][tile][cell], octant bit a set where the ray goes up axis a.
std::vector<std::uint8_t> skip_distances(std::span<const SurfaceTile> tiles, const int tile_counts[3]);

}  // namespace embrun

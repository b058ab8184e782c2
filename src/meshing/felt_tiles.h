#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/particle_blocks.h"

namespace embrun {

// Tiles of a sparse grid: cubes, numbered along the axes from an origin below all of them. A key holds the three numbers
// of one, z above y above x.

inline constexpr int tile_axis_bits = 21;
inline constexpr std::uint64_t tile_axis_mask = (std::uint64_t{1} << tile_axis_bits) - 1;

inline std::uint64_t tile_key(int x, int y, int z) {
  return static_cast<std::uint64_t>(z) << 2 * tile_axis_bits | static_cast<std::uint64_t>(y) << tile_axis_bits |
         static_cast<std::uint64_t>(x);
}
inline std::array<int, 3> tile_place(std::uint64_t key) {
  return {static_cast<int>(key & tile_axis_mask), static_cast<int>(key >> tile_axis_bits & tile_axis_mask),
          static_cast<int>(key >> 2 * tile_axis_bits)};
}

/// The box of all that is felt; empty when there is nothing.
Box3 felt_box(std::span<const ReachBox> boxes);

/// Keys, rising, of the tiles of side `width` from which a particle is felt: a tile counts from `below` before its low
/// faces to `above` beyond its high ones. `cell` is what messages call the grid by. Throws Error when the tiles are too
/// many, or their samples, `cell` apart, cannot be told from each other in single precision.
std::vector<std::uint64_t> felt_tiles(std::span<const ReachBox> boxes, Vec3 origin, float width, float below,
                                      float above, float cell);

}  // namespace embrun

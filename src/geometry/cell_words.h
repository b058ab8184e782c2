#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/implicit_surface.h"

namespace embrun {

/// 4x4x4 cells as the build leaves them: which are near the surface, which of the others are inside, and where the
/// records of the near ones begin.
struct SurfaceTile {
  std::uint64_t near_mask = 0;
  std::uint64_t inside_mask = 0;
  std::uint32_t first_cell = 0;
};

/// The words that rays read (see cell_word), with the skips worked out. Beyond the grid nothing is near.
std::vector<std::uint32_t> make_cell_words(std::span<const SurfaceTile> tiles, const int tile_counts[3]);

}  // namespace embrun

#include <algorithm>
#include <cmath>

#include "geometry/splat_searches.h"

namespace embrun {
namespace {

/// Calls visit(cell) for the eight cells round a centre.
template <class Visit>
void cells_round(const SplatGrid& grid, Vec3 center, const Visit& visit) {
  int first[3];
  for (int axis = 0; axis < 3; ++axis)
    first[axis] = static_cast<int>(std::floor((center[axis] - grid.low[axis]) / grid.cell - 0.5f));
  for (int k = 0; k < 8; ++k) {
    std::size_t at = 0;
    for (int axis = 2; axis >= 0; --axis) {
      const int c = std::clamp(first[axis] + (k >> axis & 1), 0, grid.size[axis] - 1);
      at = at * static_cast<std::size_t>(grid.size[axis]) + static_cast<std::size_t>(c);
    }
    visit(at);
  }
}

}  // namespace

SplatGrid build_splat_grid(const std::vector<Splat>& splats, std::size_t most_cells) {
  SplatGrid grid;
  Box3 bounds;
  float largest = 0;
  for (const Splat& s : splats) {
    bounds.include(s.center);
    largest = std::max(largest, s.radius);
  }
  if (bounds.empty()) {
    grid.begins.assign(2, 0);
    return grid;
  }
  // Cells are a little longer than a diameter, so that rounding does not take a splat out of its eight.
  grid.cell = 2.001f * largest;
  for (;;) {
    double cells = 1;
    for (int axis = 0; axis < 3; ++axis) {
      grid.low[axis] = bounds.low[axis] - grid.cell;
      const double n =
          std::ceil(static_cast<double>(bounds.high[axis] - grid.low[axis]) / static_cast<double>(grid.cell)) + 1;
      cells *= n;
      grid.size[axis] = static_cast<int>(std::min(n, 1e9));
    }
    if (cells <= static_cast<double>(most_cells)) break;
    grid.cell *= 1.26f;
  }
  const std::size_t cells = static_cast<std::size_t>(grid.size[0]) * static_cast<std::size_t>(grid.size[1]) *
                            static_cast<std::size_t>(grid.size[2]);
  grid.begins.assign(cells + 1, 0);
  for (const Splat& s : splats) cells_round(grid, s.center, [&](std::size_t at) { ++grid.begins[at + 1]; });
  for (std::size_t i = 0; i < cells; ++i) grid.begins[i + 1] += grid.begins[i];
  grid.splats.resize(grid.begins[cells]);
  std::vector<std::uint32_t> next(grid.begins.begin(), grid.begins.end() - 1);
  for (std::uint32_t i = 0; i < splats.size(); ++i)
    cells_round(grid, splats[i].center, [&](std::size_t at) { grid.splats[next[at]++] = i; });
  return grid;
}

PackedSplats pack_splats(const SplatTree& tree) {
  PackedSplats packed;
  for (std::uint32_t i = 0; i < tree.order.size(); ++i) {
    if (tree.order[i] == no_splat) continue;
    packed.splats.push_back(tree.blocks[i / splats_per_block].splat(i % splats_per_block));
    packed.numbers.push_back(i);
  }
  packed.blocks.resize((packed.splats.size() + splats_per_block - 1) / splats_per_block);
  for (std::uint32_t i = 0; i < packed.splats.size(); ++i)
    packed.blocks[i / splats_per_block].set(i % splats_per_block, packed.splats[i]);
  return packed;
}

}  // namespace embrun

#include "media/grid_medium_build.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"

namespace embrun {
namespace {

/// The cells whose numbers count in a block: those that interpolation between centres reaches, and a little more, for the
/// rounding of points near its faces.
struct CellRange {
  int first, last;

  CellRange(int block, int blocks, int cells) {
    const double width = static_cast<double>(cells) / blocks, slack = 1e-3;
    const auto limit = [&](double c) { return std::clamp(static_cast<int>(std::floor(c)), 0, cells - 1); };
    first = limit(block * width - 0.5 - slack);
    last = limit((block + 1) * width - 0.5 + slack + 1);
  }
};

CellGrid blocks_over(const GridValues& grid, int block) {
  const auto count = [&](int cells) { return (cells + block - 1) / block; };
  CellGrid blocks;
  blocks.nx = count(grid.nx);
  blocks.ny = count(grid.ny);
  blocks.nz = count(grid.nz);
  blocks.cells_per_metre = {static_cast<float>(blocks.nx), static_cast<float>(blocks.ny),
                            static_cast<float>(blocks.nz)};
  blocks.cell = {1 / blocks.cells_per_metre.x, 1 / blocks.cells_per_metre.y, 1 / blocks.cells_per_metre.z};
  return blocks;
}

Rgb greatest_in(const ValueGrid& grid, CellRange x, CellRange y, CellRange z) {
  Rgb greatest;
  for (int k = z.first; k <= z.last; ++k)
    for (int j = y.first; j <= y.last; ++j)
      for (int i = x.first; i <= x.last; ++i) {
        const Rgb v = cell_value(grid, i, j, k);
        greatest = {std::max(greatest.r, v.r), std::max(greatest.g, v.g), std::max(greatest.b, v.b)};
      }
  return greatest;
}

void check(const GridValues& grid) {
  EMBRUN_CHECK(grid.nx > 0 && grid.ny > 0 && grid.nz > 0 && (grid.channels == 1 || grid.channels == 3));
  EMBRUN_CHECK(grid.values.size() == static_cast<std::size_t>(grid.nx) * static_cast<std::size_t>(grid.ny) *
                                         static_cast<std::size_t>(grid.nz) * static_cast<std::size_t>(grid.channels));
}

}  // namespace

GridMediumData::GridMediumData(GridValues extinction, GridValues albedo, Rgb constant_albedo, PhaseFunction phase,
                               int block)
    : extinction_(std::move(extinction)), albedo_(std::move(albedo)) {
  check(extinction_);
  view_.extinction = extinction_.view();
  view_.to_extinction = inverse_of(extinction_.to_world);
  view_.grey = extinction_.channels == 1;
  view_.constant_albedo = constant_albedo;
  view_.phase = phase;
  if (!albedo_.values.empty()) {
    check(albedo_);
    view_.albedo = albedo_.view();
    view_.to_albedo = inverse_of(albedo_.to_world);
  }
  view_.blocks = blocks_over(extinction_, block);
  const CellGrid& blocks = view_.blocks;
  const auto layer = static_cast<std::size_t>(blocks.nx) * static_cast<std::size_t>(blocks.ny);
  majorants_.resize(layer * static_cast<std::size_t>(blocks.nz));
  parallel_for(static_cast<std::size_t>(blocks.nz), 1, [&](std::size_t begin, std::size_t end) {
    for (int z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
      for (int y = 0; y < blocks.ny; ++y)
        for (int x = 0; x < blocks.nx; ++x)
          majorants_[static_cast<std::size_t>(blocks.index(x, y, z))] =
              greatest_in(view_.extinction, {x, blocks.nx, extinction_.nx}, {y, blocks.ny, extinction_.ny},
                          {z, blocks.nz, extinction_.nz});
  });
  view_.majorants = majorants_.data();
  double sum = 0;
  for (const float value : extinction_.values) sum += static_cast<double>(value);
  view_.mean_extinction = static_cast<float>(sum / static_cast<double>(extinction_.values.size()));
}

}  // namespace embrun

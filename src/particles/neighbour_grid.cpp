#include "particles/neighbour_grid.h"

#include <algorithm>
#include <bit>
#include <mutex>

#include "base/error.h"
#include "base/parallel.h"

namespace embrun {

GridCells::GridCells(const Box3d& bounds, double cell_size) : size_(cell_size) {
  EMBRUN_CHECK(cell_size > 0);
  if (bounds.empty()) return;
  origin_ = bounds.low;
  size_ = std::max(size_, bounds.extent() * 0x1p-48);
}

Vec3d GridCells::corner(const Key& cell) const {
  return origin_ + Vec3d{static_cast<double>(cell.x), static_cast<double>(cell.y), static_cast<double>(cell.z)} * size_;
}

GridCells::Key GridCells::cell_of(Vec3d p) const {
  // Queries may be far outside; clamping keeps the conversion defined and cannot meet a cell that exists.
  const auto coordinate = [this](double x) {
    return static_cast<std::int64_t>(std::floor(std::clamp(x / size_, -0x1p52, 0x1p52)));
  };
  const Vec3d from_origin = p - origin_;
  return {coordinate(from_origin.x), coordinate(from_origin.y), coordinate(from_origin.z)};
}

std::size_t GridCells::hash(const Key& cell) {
  // Odd multipliers spread each coordinate over the whole word, the shift brings the high bits down.
  std::uint64_t bits = static_cast<std::uint64_t>(cell.x) * 0x9e3779b97f4a7c15u ^
                       static_cast<std::uint64_t>(cell.y) * 0xc2b2ae3d27d4eb4fu ^
                       static_cast<std::uint64_t>(cell.z) * 0x165667b19e3779f9u;
  bits ^= bits >> 32;
  bits *= 0xd6e8feb86659fd93u;
  return static_cast<std::size_t>(bits ^ bits >> 32);
}

std::vector<std::size_t> points_sharing_cells(const GridCells& cells, std::span<const Vec3d> positions,
                                              std::span<const std::size_t> which) {
  // The cells asked about, by hash, with the numbers of those that ask.
  struct Asked {
    GridCells::Key cell;
    std::vector<std::size_t> by;
  };
  std::vector<Asked> asked;
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::vector<std::uint32_t> table(std::bit_ceil(4 * which.size() + 1), none);
  const std::size_t mask = table.size() - 1;
  const auto slot_of = [&](const GridCells::Key& cell) {
    std::size_t slot = GridCells::hash(cell) & mask;
    while (table[slot] != none && asked[table[slot]].cell != cell) slot = (slot + 1) & mask;
    return slot;
  };
  for (std::size_t w = 0; w < which.size(); ++w) {
    const GridCells::Key cell = cells.cell_of(positions[which[w]]);
    std::uint32_t& number = table[slot_of(cell)];
    if (number == none) {
      number = static_cast<std::uint32_t>(asked.size());
      asked.push_back({cell, {}});
    }
    asked[number].by.push_back(w);
  }
  std::vector<std::size_t> counts(asked.size());
  std::mutex adding;
  parallel_for(positions.size(), 32768, [&](std::size_t begin, std::size_t end) {
    std::vector<std::size_t> here(asked.size());
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t number = table[slot_of(cells.cell_of(positions[i]))];
      if (number != none) ++here[number];
    }
    const std::lock_guard lock(adding);
    for (std::size_t n = 0; n < here.size(); ++n) counts[n] += here[n];
  });
  std::vector<std::size_t> sharing(which.size());
  for (std::size_t n = 0; n < asked.size(); ++n) {
    for (const std::size_t w : asked[n].by) sharing[w] = counts[n];
  }
  return sharing;
}

NeighbourGrid::NeighbourGrid(std::span<const Vec3d> positions, double cell_size) : grid_(box_of(positions), cell_size) {
  EMBRUN_CHECK(positions.size() < no_cell);
  if (positions.empty()) return;
  // Counting sort by cell, cells in the order of their first point.
  std::vector<std::uint32_t> cell_of(positions.size());
  table_.assign(64, no_cell);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    cell_of[i] = find_or_add(grid_.cell_of(positions[i]));
    ++cells_[cell_of[i]].end;
  }
  std::uint32_t begin = 0;
  for (Cell& cell : cells_) {
    const std::uint32_t count = cell.end;
    cell.begin = cell.end = begin;
    begin += count;
  }
  points_.resize(positions.size());
  indices_.resize(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const std::uint32_t place = cells_[cell_of[i]].end++;
    points_[place] = positions[i];
    indices_[place] = static_cast<std::uint32_t>(i);
  }
}

std::uint32_t NeighbourGrid::find(const CellKey& key) const {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t slot = GridCells::hash(key) & mask; !table_.empty() && table_[slot] != no_cell;
       slot = (slot + 1) & mask) {
    if (cells_[table_[slot]].key == key) return table_[slot];
  }
  return no_cell;
}

std::uint32_t NeighbourGrid::find_or_add(const CellKey& key) {
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = GridCells::hash(key) & mask;
  for (; table_[slot] != no_cell; slot = (slot + 1) & mask) {
    if (cells_[table_[slot]].key == key) return table_[slot];
  }
  const std::uint32_t added = static_cast<std::uint32_t>(cells_.size());
  table_[slot] = added;
  cells_.push_back({key, 0, 0});
  if (cells_.size() * 2 > table_.size()) grow_table();
  return added;
}

void NeighbourGrid::grow_table() {
  table_.assign(table_.size() * 4, no_cell);
  const std::size_t mask = table_.size() - 1;
  for (std::uint32_t cell = 0; cell < cells_.size(); ++cell) {
    std::size_t slot = GridCells::hash(cells_[cell].key) & mask;
    while (table_[slot] != no_cell) slot = (slot + 1) & mask;
    table_[slot] = cell;
  }
}

}  // namespace embrun

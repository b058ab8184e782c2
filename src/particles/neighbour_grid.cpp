#include "particles/neighbour_grid.h"

#include <algorithm>

#include "base/error.h"

namespace embrun {

NeighbourGrid::NeighbourGrid(std::span<const Vec3d> positions, double cell_size) : cell_size_(cell_size) {
  EMBRUN_CHECK(cell_size > 0 && positions.size() < no_cell);
  if (positions.empty()) return;
  Vec3d low = positions[0], high = positions[0];
  for (const Vec3d p : positions) {
    low = min_of(low, p);
    high = max_of(high, p);
  }
  origin_ = low;
  const double extent = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  cell_size_ = std::max(cell_size_, extent * 0x1p-48);

  // Counting sort by cell, cells in the order of their first point.
  std::vector<std::uint32_t> cell_of(positions.size());
  table_.assign(64, no_cell);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    cell_of[i] = find_or_add(key_of(positions[i]));
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

Vec3d NeighbourGrid::cell_corner(std::size_t cell) const {
  const CellKey& key = cells_[cell].key;
  return origin_ +
         Vec3d{static_cast<double>(key.x), static_cast<double>(key.y), static_cast<double>(key.z)} * cell_size_;
}

std::size_t NeighbourGrid::points_in_cell_of(Vec3d p) const {
  const std::uint32_t cell = find(key_of(p));
  return cell == no_cell ? 0 : cell_points(cell);
}

std::size_t NeighbourGrid::hash(const CellKey& key) {
  // Odd multipliers spread each coordinate over the whole word, the shift brings the high bits down.
  std::uint64_t bits = static_cast<std::uint64_t>(key.x) * 0x9e3779b97f4a7c15u ^
                       static_cast<std::uint64_t>(key.y) * 0xc2b2ae3d27d4eb4fu ^
                       static_cast<std::uint64_t>(key.z) * 0x165667b19e3779f9u;
  bits ^= bits >> 32;
  bits *= 0xd6e8feb86659fd93u;
  return static_cast<std::size_t>(bits ^ bits >> 32);
}

NeighbourGrid::CellKey NeighbourGrid::key_of(Vec3d p) const {
  // Queries may be far outside; clamping keeps the conversion defined and cannot meet a cell that exists.
  const auto coordinate = [this](double x) {
    return static_cast<std::int64_t>(std::floor(std::clamp(x / cell_size_, -0x1p52, 0x1p52)));
  };
  const Vec3d from_origin = p - origin_;
  return {coordinate(from_origin.x), coordinate(from_origin.y), coordinate(from_origin.z)};
}

std::uint32_t NeighbourGrid::find(const CellKey& key) const {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t slot = hash(key) & mask; !table_.empty() && table_[slot] != no_cell; slot = (slot + 1) & mask) {
    if (cells_[table_[slot]].key == key) return table_[slot];
  }
  return no_cell;
}

std::uint32_t NeighbourGrid::find_or_add(const CellKey& key) {
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = hash(key) & mask;
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
    std::size_t slot = hash(cells_[cell].key) & mask;
    while (table_[slot] != no_cell) slot = (slot + 1) & mask;
    table_[slot] = cell;
  }
}

}  // namespace embrun

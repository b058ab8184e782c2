#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "math/box3d.h"
#include "math/vec.h"

namespace embrun {

/// The cells of a uniform grid over points, by exact coordinates.
class GridCells {
 public:
  struct Key {
    std::int64_t x = 0, y = 0, z = 0;
    bool operator==(const Key&) const = default;
  };

  /// `bounds`: of the points. `cell_size` as for NeighbourGrid.
  GridCells(const Box3d& bounds, double cell_size);

  double size() const { return size_; }
  /// The corner of the lowest coordinates.
  Vec3d corner(const Key& cell) const;
  Key cell_of(Vec3d p) const;
  static std::size_t hash(const Key& cell);

 private:
  double size_;
  Vec3d origin_;
};

/// For each of some points, by index, how many share its cell. In parallel, and without a grid of all.
std::vector<std::size_t> points_sharing_cells(const GridCells& cells, std::span<const Vec3d> positions,
                                              std::span<const std::size_t> which);

/// A uniform grid over points, sorted by cell, for range queries. Only cells that hold a point exist (found by a hash of
/// the exact cell coordinates), so memory is proportional to the points, however far apart they are.
/// The order of cells and of points in a cell is a function of the input alone.
class NeighbourGrid {
 public:
  /// `cell_size` > 0, best about the radius of the queries; positions finite, fewer than 2^32. Where the points are
  /// so far apart that cell numbers would pass 2^48, cells are larger.
  NeighbourGrid(std::span<const Vec3d> positions, double cell_size);

  double cell_size() const { return grid_.size(); }
  std::size_t cell_count() const { return cells_.size(); }
  /// The corner of the lowest coordinates of an existing cell.
  Vec3d cell_corner(std::size_t cell) const { return grid_.corner(cells_[cell].key); }
  /// Number of points in a cell.
  std::size_t cell_points(std::size_t cell) const { return cells_[cell].end - cells_[cell].begin; }

  /// Calls visit(index, point, distance_squared) for every point within `radius` of p, each once. Where visit returns
  /// a bool, false ends the query.
  template <class Visit>
  void for_each_within(Vec3d p, double radius, const Visit& visit) const;

 private:
  using CellKey = GridCells::Key;
  struct Cell {
    CellKey key;
    std::uint32_t begin = 0, end = 0;  // its points: [begin, end)
  };
  static constexpr std::uint32_t no_cell = ~std::uint32_t{0};

  GridCells grid_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> table_;  // open addressing: numbers of cells, no_cell where free
  std::vector<Vec3d> points_;         // by cell
  std::vector<std::uint32_t> indices_;

  std::uint32_t find(const CellKey& key) const;
  std::uint32_t find_or_add(const CellKey& key);
  void grow_table();

  // False when the query is to end.
  template <class Visit>
  bool visit_cell(const Cell& cell, Vec3d p, double radius_squared, const Visit& visit) const {
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
      const Vec3d offset = points_[i] - p;
      const double distance_squared = dot(offset, offset);
      if (!(distance_squared <= radius_squared)) continue;
      if constexpr (std::is_same_v<decltype(visit(indices_[i], points_[i], distance_squared)), bool>) {
        if (!visit(indices_[i], points_[i], distance_squared)) return false;
      } else {
        visit(indices_[i], points_[i], distance_squared);
      }
    }
    return true;
  }
};

template <class Visit>
void NeighbourGrid::for_each_within(Vec3d p, double radius, const Visit& visit) const {
  const double radius_squared = radius * radius;
  const double cells_across = std::ceil(2 * radius / grid_.size()) + 1;
  // A query wider than the grid is cheaper cell by cell.
  if (cells_across * cells_across * cells_across > static_cast<double>(cells_.size())) {
    for (const Cell& cell : cells_) {
      if (!visit_cell(cell, p, radius_squared, visit)) return;
    }
    return;
  }
  const CellKey low = grid_.cell_of(p - Vec3d{radius, radius, radius});
  const CellKey high = grid_.cell_of(p + Vec3d{radius, radius, radius});
  for (std::int64_t z = low.z; z <= high.z; ++z) {
    for (std::int64_t y = low.y; y <= high.y; ++y) {
      for (std::int64_t x = low.x; x <= high.x; ++x) {
        const std::uint32_t cell = find({x, y, z});
        if (cell != no_cell && !visit_cell(cells_[cell], p, radius_squared, visit)) return;
      }
    }
  }
}

}  // namespace embrun

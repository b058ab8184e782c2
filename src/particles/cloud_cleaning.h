#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "math/vec.h"
#include "particles/point_tree.h"

namespace embrun {

/// Which points of a cloud stay: one byte a point for keep_particles(), and how many go.
struct PointSelection {
  std::vector<std::uint8_t> keep;
  std::size_t removed = 0;
};

/// A space-filling curve through the cells of a grid of 2^21 of them along the longest side of a box [Morton1966].
class CurveGrid {
 public:
  CurveGrid(Vec3d low, Vec3d high);
  /// The number of the point's cell along the curve.
  std::uint64_t key(Vec3d point) const;

 private:
  Vec3d origin_;
  double scale_ = 0;
};

/// The points' indices along a space-filling curve [Morton1966], those in one place in their own order: what is near in space
/// is then mostly near in memory.
std::vector<std::uint32_t> order_along_curve(std::span<const Vec3d> points);

/// Leaves out all but the first of the points that have exactly the same position.
PointSelection without_duplicates(std::span<const Vec3d> points);

/// Leaves out points that stand alone for where they are: whose mean distance to their k nearest neighbours is more than
/// `ratio` times the median of their neighbours' own [Breunig2000]. As neighbours are compared, sparse parts of a cloud are no
/// outliers. k from 1 to 256.
PointSelection without_outliers(const PointTree& tree, std::span<const Vec3d> points, std::size_t k = 16,
                                double ratio = 3);

/// Leaves one point in each cube of a grid of that edge (> 0, metres): the one nearest to the mean of the cube's points.
PointSelection thinned_by_voxels(std::span<const Vec3d> points, double edge);

}  // namespace embrun

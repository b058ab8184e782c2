#include "particles/point_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.h"

namespace embrun {

namespace {

constexpr std::size_t leaf_points = 12;

double coordinate(Vec3d p, std::size_t axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

double& coordinate_of(Vec3d& p, std::size_t axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

std::uint8_t widest_axis(std::span<const Vec3d> points, std::span<const std::uint32_t> indices) {
  Vec3d low = points[indices[0]], high = low;
  for (const std::uint32_t i : indices) {
    const Vec3d p = points[i];
    low = min_of(low, p);
    high = max_of(high, p);
  }
  const Vec3d extent = high - low;
  if (extent.x >= extent.y && extent.x >= extent.z) return 0;
  return extent.y >= extent.z ? 1 : 2;
}

}  // namespace

PointTree::PointTree(std::span<const Vec3d> points) : points_(points.size()), indices_(points.size()) {
  EMBRUN_CHECK(points.size() < none);
  std::iota(indices_.begin(), indices_.end(), std::uint32_t{0});
  while (points.size() >> levels_ > leaf_points) ++levels_;
  axes_.resize((std::size_t{1} << levels_) - 1);
  splits_.resize(axes_.size());
  // Level by level: the ranges of a level are independent, and each is the same for any number of threads.
  std::vector<std::size_t> bounds{0, points.size()};
  for (std::size_t level = 0; level < levels_; ++level) {
    std::vector<std::size_t> halves;
    for (std::size_t i = 0; i + 1 < bounds.size(); ++i) {
      halves.push_back(bounds[i]);
      halves.push_back((bounds[i] + bounds[i + 1]) / 2);
    }
    halves.push_back(points.size());
    const std::size_t first_node = (std::size_t{1} << level) - 1;
    parallel_for(bounds.size() - 1, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::span<std::uint32_t> range(indices_.data() + bounds[i], bounds[i + 1] - bounds[i]);
        const std::uint8_t axis = widest_axis(points, range);
        const auto middle = range.begin() + static_cast<std::ptrdiff_t>(halves[2 * i + 1] - bounds[i]);
        std::nth_element(range.begin(), middle, range.end(), [&](std::uint32_t a, std::uint32_t b) {
          const double x = coordinate(points[a], axis), y = coordinate(points[b], axis);
          return x != y ? x < y : a < b;
        });
        axes_[first_node + i] = axis;
        splits_[first_node + i] = coordinate(points[*middle], axis);
      }
    });
    bounds = std::move(halves);
  }
  places_.resize(points.size());
  for (std::size_t place = 0; place < points.size(); ++place) {
    points_[place] = points[indices_[place]];
    places_[indices_[place]] = static_cast<std::uint32_t>(place);
  }
}

/// The nearest points so far, as a heap whose top is the farthest.
struct PointTree::Query {
  Vec3d p;
  std::uint32_t except;
  std::span<Neighbour> found;
  double limit = 0;  // the squared distance beyond which nothing is wanted
  std::size_t count = 0;

  bool is_full() const { return count == found.size(); }
  void add(const Neighbour& neighbour) {
    const auto begin = found.begin();
    if (!is_full()) {
      found[count++] = neighbour;
      std::push_heap(begin, begin + static_cast<std::ptrdiff_t>(count));
      if (is_full()) limit = found[0].distance_squared;
    } else if (neighbour < found[0]) {
      std::pop_heap(begin, found.end());
      found.back() = neighbour;
      std::push_heap(begin, found.end());
      limit = found[0].distance_squared;
    }
  }
};

std::size_t PointTree::nearest(Vec3d p, std::span<Neighbour> found, std::uint32_t except, double within) const {
  if (points_.empty() || found.empty()) return 0;
  Query query{p, except, found, within * within};
  visit(query, 0, 0, 0, points_.size(), 0, {});
  std::sort_heap(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(query.count));
  return query.count;
}

void PointTree::remember_neighbours(std::size_t k) {
  k = std::min(k, points_.empty() ? 0 : points_.size() - 1);
  if (k <= remembered_count_) return;
  std::vector<std::uint32_t> all(k * points_.size());
  constexpr std::size_t grain = 512;
  parallel_for(points_.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<Neighbour> found(k);
    // The k nearest others of the point before, or itself in place of this point, are others of this point.
    constexpr double rounding = 1 + 1e-9;
    double within = std::numeric_limits<double>::infinity();
    for (std::size_t place = begin; place < end; ++place) {
      const std::uint32_t i = indices_[place];
      if (place > begin) within = rounding * (within + length(points_[place] - points_[place - 1]));
      nearest(points_[place], found, i, within);
      within = std::sqrt(found.back().distance_squared);
      for (std::size_t n = 0; n < k; ++n) all[k * i + n] = found[n].index;
    }
  });
  remembered_ = std::move(all);
  remembered_count_ = k;
}

std::size_t PointTree::nearest_others(std::uint32_t i, std::span<Neighbour> found) const {
  const std::size_t count = std::min(found.size(), points_.empty() ? 0 : points_.size() - 1);
  if (count > remembered_count_) return nearest(point(i), found, i);
  const Vec3d p = point(i);
  for (std::size_t n = 0; n < count; ++n) {
    const std::uint32_t other = remembered_[remembered_count_ * i + n];
    const Vec3d offset = point(other) - p;
    found[n] = {dot(offset, offset), other};
  }
  return count;
}

// `distance` is the squared distance from p to the node's region, `outside` its part along each axis [AryaMount1993].
void PointTree::visit(Query& query, std::size_t node, std::size_t level, std::size_t begin, std::size_t end,
                      double distance, Vec3d outside) const {
  // At an equal distance a lower index may still be in there.
  if (distance > query.limit) return;
  if (level == levels_) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3d offset = points_[i] - query.p;
      const double squared = dot(offset, offset);
      if (squared <= query.limit && indices_[i] != query.except) query.add({squared, indices_[i]});
    }
    return;
  }
  const std::size_t middle = (begin + end) / 2, axis = axes_[node];
  const double side = coordinate(query.p, axis) - splits_[node];
  Vec3d beyond = outside;
  coordinate_of(beyond, axis) = side;
  // Rounding must not make the bound greater than a distance that is computed point by point.
  const double bound = dot(beyond, beyond) * (1 - 0x1p-50);
  if (side < 0) {
    visit(query, 2 * node + 1, level + 1, begin, middle, distance, outside);
    visit(query, 2 * node + 2, level + 1, middle, end, bound, beyond);
  } else {
    visit(query, 2 * node + 2, level + 1, middle, end, distance, outside);
    visit(query, 2 * node + 1, level + 1, begin, middle, bound, beyond);
  }
}

}  // namespace embrun

#include "particles/cloud_cleaning.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "math/median.h"

namespace embrun {

namespace {

PointSelection select(std::vector<std::uint8_t> keep) {
  PointSelection selection{std::move(keep), 0};
  selection.removed =
      static_cast<std::size_t>(std::count(selection.keep.begin(), selection.keep.end(), std::uint8_t{0}));
  return selection;
}

/// A point's place under a key, to bring equal keys together.
template <class Key>
struct Keyed {
  Key key;
  std::uint32_t index = 0;
  bool operator<(const Keyed& other) const { return key != other.key ? key < other.key : index < other.index; }
};

template <class Key, class KeyOf>
std::vector<Keyed<Key>> sorted_by_key(std::span<const Vec3d> points, const KeyOf& key_of) {
  std::vector<Keyed<Key>> sorted(points.size());
  constexpr std::size_t grain = 4096;
  parallel_for(points.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) sorted[i] = {key_of(points[i]), static_cast<std::uint32_t>(i)};
  });
  parallel_sort(sorted);
  return sorted;
}

/// Two zeros after each of the lower 21 bits.
std::uint64_t spread_bits(std::uint64_t bits) {
  bits = (bits | bits << 32) & 0x1f00000000ffff;
  bits = (bits | bits << 16) & 0x1f0000ff0000ff;
  bits = (bits | bits << 8) & 0x100f00f00f00f00f;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
  return (bits | bits << 2) & 0x1249249249249249;
}

struct Bounds {
  Vec3d low, high;
};
Bounds bounds_of(std::span<const Vec3d> points) {
  Bounds bounds{points[0], points[0]};
  for (const Vec3d p : points) {
    bounds.low = min_of(bounds.low, p);
    bounds.high = max_of(bounds.high, p);
  }
  return bounds;
}

}  // namespace

constexpr double curve_cells = 1 << 21;  // along an axis: three numbers of 21 bits make a key

CurveGrid::CurveGrid(Vec3d low, Vec3d high) : origin_(low) {
  const double extent = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  if (extent > 0) scale_ = curve_cells / extent;
}

std::uint64_t CurveGrid::key(Vec3d point) const {
  const Vec3d at = (point - origin_) * scale_;
  const auto cell = [](double x) { return static_cast<std::uint64_t>(std::clamp(x, 0.0, curve_cells - 1)); };
  return spread_bits(cell(at.x)) | spread_bits(cell(at.y)) << 1 | spread_bits(cell(at.z)) << 2;
}

std::vector<std::uint32_t> order_along_curve(std::span<const Vec3d> points) {
  if (points.empty()) return {};
  const auto [low, high] = bounds_of(points);
  const CurveGrid grid(low, high);
  const auto sorted = sorted_by_key<std::uint64_t>(points, [&](Vec3d p) { return grid.key(p); });
  std::vector<std::uint32_t> order;
  order.reserve(points.size());
  for (const auto& one : sorted) order.push_back(one.index);
  return order;
}

PointSelection without_duplicates(std::span<const Vec3d> points) {
  using Key = std::array<double, 3>;
  const auto sorted = sorted_by_key<Key>(points, [](Vec3d p) { return Key{p.x, p.y, p.z}; });
  std::vector<std::uint8_t> keep(points.size(), 1);
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i].key == sorted[i - 1].key) keep[sorted[i].index] = 0;
  }
  return select(std::move(keep));
}

PointSelection without_outliers(const PointTree& tree, std::span<const Vec3d> points, std::size_t k, double ratio) {
  constexpr std::size_t most = 256;
  EMBRUN_CHECK(k >= 1 && k <= most && ratio > 0);
  std::vector<double> mean(points.size(), 0);
  for_each_neighbourhood(tree, k, [&](std::size_t i, std::span<const PointTree::Neighbour> neighbours) {
    double sum = 0;
    for (const auto& neighbour : neighbours) sum += std::sqrt(neighbour.distance_squared);
    if (!neighbours.empty()) mean[i] = sum / static_cast<double>(neighbours.size());
  });
  // Only who stands out against the whole cloud's least can do so against its neighbours.
  const double least = mean.empty() ? 0 : *std::min_element(mean.begin(), mean.end());
  std::vector<std::uint32_t> suspects;
  for (const std::uint32_t i : tree.order()) {
    if (mean[i] > ratio * least) suspects.push_back(i);
  }
  std::vector<std::uint8_t> keep(points.size(), 1);
  constexpr std::size_t grain = 512;
  parallel_for(suspects.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<PointTree::Neighbour> found(k);
    std::vector<double> theirs;
    for (std::size_t s = begin; s < end; ++s) {
      const std::uint32_t i = suspects[s];
      const std::size_t count = tree.nearest_others(i, found);
      if (count == 0) continue;
      theirs.clear();
      for (std::size_t n = 0; n < count; ++n) theirs.push_back(mean[found[n].index]);
      keep[i] = !(mean[i] > ratio * median_of(theirs));
    }
  });
  return select(std::move(keep));
}

PointSelection thinned_by_voxels(std::span<const Vec3d> points, double edge) {
  EMBRUN_CHECK(edge > 0);
  if (points.empty()) return {};
  const Vec3d low = bounds_of(points).low;
  // Numbers of cubes, whole but as doubles: any extent over any edge has one.
  using Key = std::array<double, 3>;
  const auto sorted = sorted_by_key<Key>(points, [&](Vec3d p) {
    const Vec3d at = (p - low) * (1 / edge);
    return Key{std::floor(at.x), std::floor(at.y), std::floor(at.z)};
  });
  std::vector<std::uint8_t> keep(points.size(), 0);
  for (auto begin = sorted.begin(); begin != sorted.end();) {
    const auto end = std::find_if(begin, sorted.end(), [&](const auto& other) { return other.key != begin->key; });
    Vec3d sum;
    for (auto i = begin; i != end; ++i) sum = sum + (points[i->index] - low);
    const Vec3d mean = low + sum * (1 / static_cast<double>(end - begin));
    const auto distance = [&](const auto& one) { return length(points[one.index] - mean); };
    const auto best =
        std::min_element(begin, end, [&](const auto& x, const auto& y) { return distance(x) < distance(y); });
    keep[best->index] = 1;
    begin = end;
  }
  return select(std::move(keep));
}

}  // namespace embrun

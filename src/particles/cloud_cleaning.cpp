#include "particles/cloud_cleaning.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"

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

}  // namespace

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
  for_each_neighbourhood(tree, points, k, [&](std::size_t i, std::span<const PointTree::Neighbour> neighbours) {
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
      const std::size_t count = tree.nearest(points[i], found, i);
      if (count == 0) continue;
      theirs.clear();
      for (std::size_t n = 0; n < count; ++n) theirs.push_back(mean[found[n].index]);
      const auto middle = theirs.begin() + static_cast<std::ptrdiff_t>(count / 2);
      std::nth_element(theirs.begin(), middle, theirs.end());
      keep[i] = !(mean[i] > ratio * *middle);
    }
  });
  return select(std::move(keep));
}

PointSelection thinned_by_voxels(std::span<const Vec3d> points, double edge) {
  EMBRUN_CHECK(edge > 0);
  if (points.empty()) return {};
  Vec3d low = points[0];
  for (const Vec3d p : points) low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
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

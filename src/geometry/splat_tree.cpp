#include "geometry/splat_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "base/parallel.h"

namespace embrun {
namespace {

constexpr int bins = 16;
/// Below that depth ranges are halved by count, so that the tree ends: 24 + log2(2^32 / 8) / 3 levels at most.
constexpr int deepest_by_area = 24;

bool is_splat(const Splat& s) {
  return s.radius > 0.0f && is_finite(s.radius) && is_finite(s.center) && is_finite(s.squeeze) &&
         std::fabs(length_squared(s.normal) - 1.0f) < 1e-3f;
}

float half_area(const Box3& box) {
  if (box.empty()) return 0;
  const Vec3 d = box.high - box.low;
  return d.x * d.y + d.y * d.z + d.z * d.x;
}

/// Blocks that so many splats fill.
float blocks_of(std::size_t count) {
  const std::size_t blocks = (count + splats_per_block - 1) / splats_per_block;
  return static_cast<float>(blocks);
}

/// A stretch of the order, and the box of its splats.
struct Range {
  std::size_t begin = 0, end = 0;
  Box3 bounds;

  std::size_t size() const { return end - begin; }
};

class Builder {
 public:
  /// `balls`: see build_ball_tree().
  Builder(const std::vector<Splat>& splats, bool balls) : splats_(splats), balls_(balls) {
    for (std::size_t i = 0; i < splats_.size(); ++i)
      if (is_splat(splats_[i])) order_.push_back(static_cast<std::uint32_t>(i));
  }

  SplatTree run() {
    if (order_.empty()) return std::move(tree_);
    boxes_.resize(splats_.size());
    Range all{0, order_.size(), {}};
    float reach = 0;
    for (const std::uint32_t i : order_) {
      all.bounds.include(box_of(splats_[i]));
      const Vec3 c = splats_[i].center;
      reach = std::max({reach, std::fabs(c.x), std::fabs(c.y), std::fabs(c.z)});
    }
    // Room for the rounding of what is computed with coordinates of that size.
    const float margin = 4e-6f * (reach + length(all.bounds.high - all.bounds.low));
    all.bounds = {};
    for (const std::uint32_t i : order_) {
      const Box3 own = box_of(splats_[i]);
      const float more = margin + 1e-3f * splats_[i].radius;
      boxes_[i] = {own.low - Vec3{more, more, more}, own.high + Vec3{more, more, more}};
      all.bounds.include(boxes_[i]);
    }
    build(all);
    return std::move(tree_);
  }

  SplatTree run(std::vector<Box3> boxes) {
    boxes_ = std::move(boxes);
    if (order_.empty()) return std::move(tree_);
    build(range_of(0, order_.size()));
    return std::move(tree_);
  }

 private:
  const std::vector<Splat>& splats_;
  const bool balls_;
  std::vector<Box3> boxes_;
  std::vector<std::uint32_t> order_;
  SplatTree tree_;

  Box3 box_of(const Splat& s) const {
    if (!balls_) return bounds_of(s);
    const Vec3 reach{s.radius, s.radius, s.radius};
    return {s.center - reach, s.center + reach};
  }

  /// Makes the nodes level by level; a level's are independent of each other.
  void build(const Range& all) {
    struct Task {
      Range range;
      std::vector<Range> children;
    };
    tree_.bounds = all.bounds;
    tree_.nodes.emplace_back();
    std::vector<Task> level{{all, {}}};
    for (int depth = 0; !level.empty(); ++depth) {
      parallel_for(level.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) level[i].children = divide(level[i].range, depth);
      });
      std::vector<Task> next;
      std::size_t node = tree_.nodes.size() - level.size();
      for (const Task& task : level) {
        SplatNode filled = empty_node();
        for (std::size_t k = 0; k < task.children.size(); ++k) {
          const Range& child = task.children[k];
          set_box(filled, k, child.bounds);
          if (child.size() <= std::size_t{splats_per_block}) {
            filled.child[k] = add_block(child) | splat_leaf;
          } else {
            // Its place is after all nodes of this level.
            filled.child[k] = static_cast<std::uint32_t>(tree_.nodes.size() + next.size());
            next.push_back({child, {}});
          }
        }
        tree_.nodes[node++] = filled;
      }
      tree_.nodes.resize(tree_.nodes.size() + next.size());
      level = std::move(next);
    }
  }

  static SplatNode empty_node() {
    SplatNode node;
    for (std::size_t k = 0; k < std::size_t{splat_tree_width}; ++k) {
      set_box(node, k, Box3{});
      node.child[k] = 0;
      node.extent[k] = infinity;
    }
    return node;
  }

  static void set_box(SplatNode& node, std::size_t k, const Box3& box) {
    for (int axis = 0; axis < 3; ++axis) {
      node.face[axis][0][k] = box.low[axis];
      node.face[axis][1][k] = box.high[axis];
    }
  }

  std::uint32_t add_block(const Range& range) {
    SplatBlock block;
    for (std::size_t lane = 0; lane < std::size_t{splats_per_block}; ++lane) {
      const bool there = lane < range.size();
      tree_.order.push_back(there ? order_[range.begin + lane] : no_splat);
      if (there) block.set(static_cast<std::uint32_t>(lane), splats_[order_[range.begin + lane]]);
    }
    tree_.blocks.push_back(block);
    return static_cast<std::uint32_t>(tree_.blocks.size() - 1);
  }

  /// Cuts a range into at most eight: the one with the largest area first.
  std::vector<Range> divide(const Range& range, int depth) {
    std::vector<Range> parts{range};
    while (parts.size() < std::size_t{splat_tree_width}) {
      std::size_t largest = parts.size();
      float area = -1;
      for (std::size_t i = 0; i < parts.size(); ++i) {
        if (parts[i].size() > std::size_t{splats_per_block} && half_area(parts[i].bounds) > area) {
          area = half_area(parts[i].bounds);
          largest = i;
        }
      }
      if (largest == parts.size()) break;
      const auto [left, right] = split(parts[largest], depth);
      parts[largest] = left;
      parts.push_back(right);
    }
    return parts;
  }

  Range range_of(std::size_t begin, std::size_t end) const {
    Range range{begin, end, {}};
    for (std::size_t i = begin; i < end; ++i) range.bounds.include(boxes_[order_[i]]);
    return range;
  }

  /// Two parts by the surface area heuristic over bins of centres, or by halves where that tells nothing.
  std::array<Range, 2> split(const Range& range, int depth) {
    Box3 centers;
    for (std::size_t i = range.begin; i < range.end; ++i) centers.include(splats_[order_[i]].center);
    int best_axis = -1, best_bin = 0;
    float best = infinity;
    if (depth < deepest_by_area) {
      for (int axis = 0; axis < 3; ++axis) find_cut(range, centers, axis, best, best_axis, best_bin);
    }
    const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(range.begin);
    const auto end = order_.begin() + static_cast<std::ptrdiff_t>(range.end);
    auto middle = begin + (end - begin) / 2;
    if (best_axis >= 0) {
      middle = std::partition(
          begin, end, [&](std::uint32_t i) { return bin_of(splats_[i].center, centers, best_axis) <= best_bin; });
    } else {
      const Vec3 size = centers.high - centers.low;
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      std::nth_element(begin, middle, end, [&](std::uint32_t a, std::uint32_t b) {
        const float x = splats_[a].center[axis], y = splats_[b].center[axis];
        return x < y || (x == y && a < b);
      });
    }
    const auto cut = static_cast<std::size_t>(middle - order_.begin());
    return {range_of(range.begin, cut), range_of(cut, range.end)};
  }

  static int bin_of(Vec3 center, const Box3& centers, int axis) {
    const float size = centers.high[axis] - centers.low[axis];
    return std::clamp(static_cast<int>((center[axis] - centers.low[axis]) / size * static_cast<float>(bins)), 0,
                      bins - 1);
  }

  void find_cut(const Range& range, const Box3& centers, int axis, float& best, int& best_axis, int& best_bin) const {
    if (!(centers.high[axis] - centers.low[axis] > 0)) return;
    std::array<Box3, bins> boxes;
    std::array<std::size_t, bins> counts{};
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const auto bin = static_cast<std::size_t>(bin_of(splats_[order_[i]].center, centers, axis));
      boxes[bin].include(boxes_[order_[i]]);
      ++counts[bin];
    }
    std::array<float, bins> right{};
    Box3 box;
    std::size_t count = 0;
    for (std::size_t k = bins - 1; k > 0; --k) {
      box.include(boxes[k]);
      count += counts[k];
      right[k] = half_area(box) * blocks_of(count);
    }
    box = {};
    count = 0;
    for (std::size_t k = 0; k + 1 < static_cast<std::size_t>(bins); ++k) {
      box.include(boxes[k]);
      count += counts[k];
      const float cost = half_area(box) * blocks_of(count) + right[k + 1];
      if (count == 0 || count == range.size() || !(cost < best)) continue;
      best = cost;
      best_axis = axis;
      best_bin = static_cast<int>(k);
    }
  }
};

}  // namespace

SplatTree build_splat_tree(const std::vector<Splat>& splats) { return Builder(splats, false).run(); }

SplatTree build_ball_tree(const std::vector<Splat>& splats) { return Builder(splats, true).run(); }

SplatTree build_splat_tree(const std::vector<Splat>& splats, std::vector<Box3> boxes) {
  EMBRUN_CHECK(boxes.size() == splats.size());
  return Builder(splats, false).run(std::move(boxes));
}

}  // namespace embrun

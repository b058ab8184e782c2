#include "geometry/splat_bricks.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "base/error.h"

namespace embrun {
namespace {

void set_child(SplatNode& node, std::uint32_t i, const Box3& box, std::uint32_t child) {
  for (int axis = 0; axis < 3; ++axis) {
    node.face[axis][0][i] = box.low[axis];
    node.face[axis][1][i] = box.high[axis];
  }
  node.child[i] = child;
  node.extent[i] = infinity;
}

/// Nodes of a tree from the last to the first. Links to nodes are `first` + their place then, to blocks what
/// link(block) says.
template <class Link>
SplatNodes turned(const SplatTree& tree, SplatLevels levels, std::uint32_t first, const Link& link) {
  SplatNodes result;
  const auto count = static_cast<std::uint32_t>(tree.nodes.size());
  result.nodes.assign(tree.nodes.rbegin(), tree.nodes.rend());
  for (SplatNode& node : result.nodes)
    for (std::uint32_t i = 0; i < splat_tree_width; ++i) {
      if (!has_child(node, i)) continue;
      const std::uint32_t child = node.child[i];
      node.child[i] = (child & splat_leaf) != 0 ? link(child & ~splat_leaf) : first + (count - 1 - child);
    }
  result.stand_ins.assign(levels.blocks.rbegin(), levels.blocks.rend());
  // Eight lanes at a time.
  for (std::size_t n = levels.colors.size() / splat_tree_width; n-- > 0;) {
    const auto begin = levels.colors.begin() + static_cast<std::ptrdiff_t>(n * splat_tree_width);
    result.colors.insert(result.colors.end(), begin, begin + splat_tree_width);
  }
  return result;
}

template <class T>
void append(std::vector<T>& to, const std::vector<T>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

}  // namespace

SplatBrick build_splat_brick(const std::vector<Splat>& splats, std::span<const Rgb> colors) {
  SplatBrick brick;
  SplatTree tree = build_splat_tree(splats);
  if (tree.nodes.empty()) return brick;
  if (!colors.empty()) brick.colors.resize(tree.order.size());
  for (std::size_t i = 0; i < tree.order.size(); ++i) {
    if (tree.order[i] == no_splat) continue;
    ++brick.splat_count;
    if (!colors.empty()) brick.colors[i] = colors[tree.order[i]];
  }
  SplatLevels levels = make_splat_levels(tree, brick.colors);
  brick.whole = levels.whole;
  brick.bounds = tree.bounds;
  brick.nodes = turned(tree, std::move(levels), 0, [](std::uint32_t block) { return block | splat_leaf; });
  brick.blocks = std::move(tree.blocks);
  return brick;
}

void place_brick(SplatBrick& brick, std::uint32_t first_node, std::uint32_t first_block) {
  for (SplatNode& node : brick.nodes.nodes)
    for (std::uint32_t i = 0; i < splat_tree_width; ++i)
      if (has_child(node, i)) node.child[i] += (node.child[i] & splat_leaf) != 0 ? first_block : first_node;
}

SplatNodes join_splat_bricks(std::span<const BrickRoot> roots, std::uint32_t first_node, bool has_colors) {
  EMBRUN_CHECK(roots.size() >= 2);
  std::vector<Splat> wholes;
  std::vector<Box3> boxes;
  std::vector<SplatStandIn> members;
  for (const BrickRoot& root : roots) {
    wholes.push_back(root.whole.splat);
    boxes.push_back(root.bounds);
    members.push_back(root.whole);
  }
  SplatTree tree = build_splat_tree(wholes, std::move(boxes));

  // What would be a block of splats is a node whose children are bricks.
  SplatNodes result;
  for (std::size_t b = 0; b < tree.blocks.size(); ++b) {
    SplatNode node;
    SplatBlock stand_ins;
    std::vector<Rgb> colors(splat_tree_width);
    for (std::uint32_t i = 0; i < splat_tree_width; ++i) {
      const std::uint32_t brick = tree.order[b * splats_per_block + i];
      set_child(node, i, brick == no_splat ? Box3{} : roots[brick].bounds, brick == no_splat ? 0 : roots[brick].node);
      if (brick == no_splat) continue;
      stand_ins.set(i, roots[brick].whole.splat);
      node.extent[i] = roots[brick].whole.extent;
      colors[i] = roots[brick].whole.color;
    }
    result.nodes.push_back(node);
    result.stand_ins.push_back(stand_ins);
    if (has_colors) append(result.colors, colors);
  }
  SplatLevels levels = make_splat_levels(tree, members, has_colors);
  const auto leaves = static_cast<std::uint32_t>(result.nodes.size());
  const SplatNodes upper =
      turned(tree, std::move(levels), first_node + leaves, [=](std::uint32_t block) { return first_node + block; });
  append(result.nodes, upper.nodes);
  append(result.stand_ins, upper.stand_ins);
  append(result.colors, upper.colors);
  return result;
}

std::size_t brick_length(std::span<const std::uint64_t> keys, std::size_t most) {
  if (keys.size() <= most) return keys.size();
  std::size_t best = most;
  int largest = -1;
  for (std::size_t i = most; i > most / 2; --i) {
    // The higher the first bit in which neighbours differ, the larger the cell that ends between them.
    const int bit = 64 - std::countl_zero(keys[i - 1] ^ keys[i]);
    if (bit <= largest) continue;
    largest = bit;
    best = i;
  }
  return best;
}

}  // namespace embrun

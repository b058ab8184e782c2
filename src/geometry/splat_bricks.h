#pragma once

#include <span>
#include <vector>

#include "geometry/splat_levels.h"

// A tree and its levels of detail that are made a part at a time, as clouds are that do not fit into memory: each brick is
// a stretch of the cloud with a tree of its own, and one more tree joins them. Nodes are numbered bottom up, so that a
// brick is finished when the next one comes: children before their parents, the root of all last.

namespace embrun {

/// Nodes and their stand-ins, by node.
struct SplatNodes {
  std::vector<SplatNode> nodes;
  std::vector<SplatBlock> stand_ins;
  std::vector<Rgb> colors;  ///< by lane of `stand_ins`; empty where there are none
};

struct SplatBrick {
  std::vector<SplatBlock> blocks;
  std::vector<Rgb> colors;  ///< by lane of `blocks`; empty where there are none
  SplatNodes nodes;         ///< links count from the brick's first node and block
  SplatStandIn whole;
  Box3 bounds;
  std::size_t splat_count = 0;
};

/// Of splats with a colour each, or without. Splats that are none are left out; no nodes where none stays.
SplatBrick build_splat_brick(const std::vector<Splat>& splats, std::span<const Rgb> colors);

/// Makes a brick's links count from the first node and block of the cloud, given its own first.
void place_brick(SplatBrick& brick, std::uint32_t first_node, std::uint32_t first_block);

/// What joins bricks to a cloud.
struct BrickRoot {
  SplatStandIn whole;
  Box3 bounds;
  std::uint32_t node = 0;
};

/// The nodes over those of at least two bricks, to follow them as number `first_node` and up.
SplatNodes join_splat_bricks(std::span<const BrickRoot> roots, std::uint32_t first_node, bool has_colors);

/// Cuts points that lie along a space-filling curve into bricks: how many of the first keys, in order, make one. Up to
/// `most`; if there are more keys, the cut is where the curve leaves the largest cell, and no less than half of that.
std::size_t brick_length(std::span<const std::uint64_t> keys, std::size_t most);

}  // namespace embrun

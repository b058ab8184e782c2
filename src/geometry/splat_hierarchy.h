#pragma once

#include <cstdint>

#include "geometry/splat_set.h"
#include "geometry/splat_tree.h"

namespace embrun {

/// A cloud's splats and their levels of detail as arrays, wherever they lie: in a file that is mapped into memory, as a rule.
/// The root is the last node, and children come before parents.
struct SplatHierarchy {
  const SplatBlock* blocks = nullptr;  ///< those of splats, then those of stand-ins, one a node
  const Rgb* colors = nullptr;         ///< linear, by lane of `blocks`; or null
  const SplatNode* nodes = nullptr;
  std::uint32_t splat_blocks = 0, node_count = 0;
  std::uint64_t splat_count = 0;
  Vec3d center;  ///< what all coordinates are relative to, metres
  Box3 bounds;   ///< of all splats and a little more
  float median_radius = 0;
  bool closed = false;  ///< the splats bound a body

  SplatSet set() const {
    SplatSet view;
    view.blocks = blocks;
    view.block_count = splat_blocks + node_count;
    view.colors = colors;
    view.closed = closed;
    view.bounds = bounds;
    return view;
  }
  SplatTreeView tree(float detail) const {
    SplatTreeView view;
    view.nodes = nodes;
    view.blocks = blocks;
    view.node_count = node_count;
    view.root = node_count - 1;
    view.first_stand_in = splat_blocks;
    view.detail = detail;
    return view;
  }
};

}  // namespace embrun

#pragma once

#include <vector>

#include "geometry/splat_set.h"

// The search that users get: a tree of boxes, eight to a node, over blocks of splats.

namespace embrun {

inline constexpr std::uint32_t splat_tree_width = 8;

/// Boxes of a node's children side by side. A child is a node, or a block where `splat_leaf` is set; one whose box is empty
/// is none.
struct alignas(64) SplatNode {
  float face[3][2][splat_tree_width];  ///< by axis: the low ones, the high ones
  std::uint32_t child[splat_tree_width];
  /// The least footprint of a ray, metres, that may take a child's stand-in for all its splats; infinity where there is
  /// none. Greater than 0.
  float extent[splat_tree_width];
};
inline constexpr std::uint32_t splat_leaf = 0x80000000u;

/// True where a node has a child i.
EMBRUN_FN bool has_child(const SplatNode& node, std::uint32_t i) { return node.face[0][0][i] <= node.face[0][1][i]; }

/// A view of a tree; it has a root where there are any splats.
///
/// Where it has stand-ins (see splat_levels.h) a ray is shown those of the children whose extent is at most `detail` times
/// its footprint at their distance, in place of the splats below. Which ones depends on the ray alone and not on what
/// it met so far, so that every splat or one stand-in for it is there, once, however often the ray is searched along. Nodes
/// near by that are just above and just below that size meet as splats of different radii do.
struct SplatTreeView {
  const SplatNode* nodes = nullptr;
  const SplatBlock* blocks = nullptr;  ///< the splats'; after them the stand-ins', by node
  std::uint32_t node_count = 0;
  std::uint32_t root = 0;
  std::uint32_t first_stand_in = 0;  ///< block of node 0's
  float detail = 0;                  ///< footprints, >= 0; 0: splats alone, as must be where there are no stand-ins

  /// The search for intersect_splats().
  template <class Query>
  EMBRUN_FN void operator()(Query& query) const {
    const auto visit = [&](std::uint32_t block, float) { offer(block, ~0u, query); };
    if (detail > 0.0f)
      search<true>(query, visit);
    else
      search<false>(query, visit);
  }

  /// visit(block, enter) for every block whose box query.ray() is in somewhere in [query.near(), query.limit()], roughly
  /// from the nearest on; `enter` is where it comes in, not before near().
  template <class Query, class Visit>
  EMBRUN_FN void walk(Query& query, const Visit& visit) const {
    search<false>(query, visit);
  }

 private:
  template <bool by_level, class Query, class Visit>
  EMBRUN_FN void search(Query& query, const Visit& visit) const;

  template <class Query>
  EMBRUN_FN void offer(std::uint32_t block, std::uint32_t wanted, Query& query) const {
    offer_block(
        blocks[block], query, [=](std::uint32_t lane) { return block * splats_per_block + lane; }, wanted);
  }

  /// Bit i: the stand-in of the node's child i is enough for the ray.
  EMBRUN_FN std::uint32_t coarse_children(std::uint32_t node, const Ray& ray) const {
    const SplatBlock& stand_ins = blocks[first_stand_in + node];
    const float* least = nodes[node].extent;
    const Vec3 o = ray.origin, d = ray.direction;
    const float width = detail * ray.cone_width, spread = detail * ray.cone_spread;
    std::int32_t enough[splat_tree_width];
    for (std::uint32_t i = 0; i < splat_tree_width; ++i) {
      const float along = (stand_ins.x[i] - o.x) * d.x + (stand_ins.y[i] - o.y) * d.y + (stand_ins.z[i] - o.z) * d.z;
      enough[i] = static_cast<int>(least[i] <= width + spread * max_of(along, 0.0f));
    }
    std::uint32_t bits = 0;
    for (std::uint32_t i = 0; i < splat_tree_width; ++i) bits |= static_cast<std::uint32_t>(enough[i]) << i;
    return bits;
  }
};

inline constexpr std::uint32_t no_splat = ~0u;

/// The owner of a tree and of what splats are by number.
struct SplatTree {
  std::vector<SplatNode> nodes;
  std::vector<SplatBlock> blocks;
  std::vector<std::uint32_t> order;  ///< for each lane of each block the number the splat was given, or no_splat
  Box3 bounds;                       ///< of all splats and a little more

  SplatTreeView view() const {
    SplatTreeView view;
    view.nodes = nodes.data();
    view.blocks = blocks.data();
    view.node_count = static_cast<std::uint32_t>(nodes.size());
    return view;
  }
};

/// Builds the tree on the threads of the enclosing TBB arena: the same bits for any number of them. Splats that are no
/// splats (a radius that is not positive, anything not finite) are left out.
SplatTree build_splat_tree(const std::vector<Splat>& splats);
/// The same for the balls round the centres that have the splats' radii.
SplatTree build_ball_tree(const std::vector<Splat>& splats);

/// The same with boxes of what the splats stand for in place of their own.
SplatTree build_splat_tree(const std::vector<Splat>& splats, std::vector<Box3> boxes);

/// Where a ray enters and leaves boxes: divisions done once. A direction of 0 is as good as a very small one.
struct BoxRay {
  Vec3 origin, inverse;
  int first[3];  ///< which faces are met first: 0 the low ones, 1 the high ones

  EMBRUN_FN explicit BoxRay(const Ray& ray) : origin(ray.origin) {
    for (int axis = 0; axis < 3; ++axis) {
      const float d = ray.direction[axis];
      inverse[axis] = 1.0f / (fabsf(d) > 1e-20f ? d : (d < 0.0f ? -1e-20f : 1e-20f));
      first[axis] = inverse[axis] < 0.0f ? 1 : 0;
    }
  }
};

/// Bit i: the ray is in the box of child i somewhere in [near, far]; `enter` receives where it comes in.
EMBRUN_FN std::uint32_t children_to_visit(const SplatNode& node, const BoxRay& ray, float near, float far,
                                          float enter[splat_tree_width]) {
  const float *x0 = node.face[0][ray.first[0]], *x1 = node.face[0][1 - ray.first[0]];
  const float *y0 = node.face[1][ray.first[1]], *y1 = node.face[1][1 - ray.first[1]];
  const float *z0 = node.face[2][ray.first[2]], *z1 = node.face[2][1 - ray.first[2]];
  const Vec3 o = ray.origin, k = ray.inverse;
  std::int32_t met[splat_tree_width];
  for (std::uint32_t i = 0; i < splat_tree_width; ++i) {
    const float first = max_of(max_of((x0[i] - o.x) * k.x, (y0[i] - o.y) * k.y), max_of((z0[i] - o.z) * k.z, near));
    const float last = min_of(min_of((x1[i] - o.x) * k.x, (y1[i] - o.y) * k.y), min_of((z1[i] - o.z) * k.z, far));
    enter[i] = first;
    // The boxes have room for rounding of what is near them; this is for that of far ends.
    met[i] = static_cast<int>(first <= last + 1e-6f * fabsf(last));
  }
  std::uint32_t bits = 0;
  for (std::uint32_t i = 0; i < splat_tree_width; ++i) bits |= static_cast<std::uint32_t>(met[i]) << i;
  return bits;
}

template <bool by_level, class Query, class Visit>
EMBRUN_FN void SplatTreeView::search(Query& query, const Visit& visit) const {
  // Of a ray that is no ray (files of splats may hold anything, and short rays start from what is met) nothing can be told, and
  // boxes of no child would be met by it.
  if (node_count == 0 || !is_finite(query.ray().origin) || !is_finite(query.ray().direction)) return;
  // Eight children at each of at most 36 levels: see build_splat_tree().
  struct Pending {
    float enter;
    std::uint32_t child;
  };
  constexpr int most_pending = 256;
  const BoxRay box_ray(query.ray());
  Pending pending[most_pending];
  int count = 0;
  Pending next{query.near(), root};
  for (;;) {
    if (next.enter <= query.limit()) {
      if ((next.child & splat_leaf) != 0) {
        visit(next.child & ~splat_leaf, next.enter);
      } else {
        // The nearest child comes next, the others wait with the farthest at the bottom.
        const SplatNode& node = nodes[next.child];
        float enter[splat_tree_width];
        std::uint32_t children = children_to_visit(node, box_ray, query.near(), query.limit(), enter);
        if constexpr (by_level) {
          const std::uint32_t coarse = children == 0 ? 0 : children & coarse_children(next.child, query.ray());
          if (coarse != 0) offer(first_stand_in + next.child, coarse, query);
          children &= ~coarse;
        }
        const int bottom = count;
        for (std::uint32_t i = 0; children != 0; ++i, children >>= 1) {
          if ((children & 1u) == 0) continue;
          int place = count++;
          for (; place > bottom && pending[place - 1].enter < enter[i]; --place) pending[place] = pending[place - 1];
          pending[place] = {enter[i], node.child[i]};
        }
      }
    }
    if (count == 0) return;
    next = pending[--count];
  }
}

}  // namespace embrun

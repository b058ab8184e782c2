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
};
inline constexpr std::uint32_t splat_leaf = 0x80000000u;

/// A view of a tree; node 0 is the root, where there are any splats.
struct SplatTreeView {
  const SplatNode* nodes = nullptr;
  const SplatBlock* blocks = nullptr;
  std::uint32_t node_count = 0;

  /// The search for intersect_splats().
  template <class Query>
  EMBRUN_FN void operator()(Query& query) const;

  /// visit(block, enter) for every block whose box query.ray() is in somewhere in [query.near(), query.limit()], roughly
  /// from the nearest on; `enter` is where it comes in, not before near().
  template <class Query, class Visit>
  EMBRUN_FN void walk(Query& query, const Visit& visit) const;
};

inline constexpr std::uint32_t no_splat = ~0u;

/// The owner of a tree and of what splats are by number.
struct SplatTree {
  std::vector<SplatNode> nodes;
  std::vector<SplatBlock> blocks;
  std::vector<std::uint32_t> order;  ///< for each lane of each block the number the splat was given, or no_splat
  Box3 bounds;                       ///< of all splats and a little more

  SplatTreeView view() const { return {nodes.data(), blocks.data(), static_cast<std::uint32_t>(nodes.size())}; }
};

/// Builds the tree on the threads of the enclosing TBB arena: the same bits for any number of them. Splats that are no
/// splats (a radius that is not positive, anything not finite) are left out.
SplatTree build_splat_tree(const std::vector<Splat>& splats);
/// The same for the balls round the centres that have the splats' radii.
SplatTree build_ball_tree(const std::vector<Splat>& splats);

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

template <class Query>
EMBRUN_FN void SplatTreeView::operator()(Query& query) const {
  walk(query, [&](std::uint32_t block, float) {
    offer_block(blocks[block], query, [=](std::uint32_t lane) { return block * splats_per_block + lane; });
  });
}

template <class Query, class Visit>
EMBRUN_FN void SplatTreeView::walk(Query& query, const Visit& visit) const {
  // Eight children at each of at most 36 levels: see build_splat_tree().
  struct Pending {
    float enter;
    std::uint32_t child;
  };
  constexpr int most_pending = 256;
  if (node_count == 0) return;
  const BoxRay box_ray(query.ray());
  Pending pending[most_pending];
  int count = 0;
  Pending next{query.near(), 0};
  for (;;) {
    if (next.enter <= query.limit()) {
      if ((next.child & splat_leaf) != 0) {
        visit(next.child & ~splat_leaf, next.enter);
      } else {
        // The nearest child comes next, the others wait with the farthest at the bottom.
        const SplatNode& node = nodes[next.child];
        float enter[splat_tree_width];
        std::uint32_t children = children_to_visit(node, box_ray, query.near(), query.limit(), enter);
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

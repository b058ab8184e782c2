#pragma once

#include <vector>

#include "geometry/splat_set.h"
#include "geometry/splat_tree.h"

// Searches for intersect_splats() that the tree is judged against: every splat tested, and the thesis's three
// accelerations [Beddiaf2018, 2.2], each on or off. All find the same hits as the tree.

namespace embrun {

/// A tree's splats without gaps, one by one and in blocks, and the number that each has in the tree.
struct PackedSplats {
  std::vector<Splat> splats;
  std::vector<SplatBlock> blocks;
  std::vector<std::uint32_t> numbers;
};

PackedSplats pack_splats(const SplatTree& tree);

/// What may be on: bounding spheres first; no more work on a splat whose plane is met outside the stretch that matters.
template <bool use_spheres, bool use_early_outs>
struct SplatScan {
  /// Shows the query those of some splats that it may meet.
  template <class Query>
  EMBRUN_FN static void test(const Splat& splat, std::uint32_t index, Query& query) {
    const Ray& ray = query.ray();
    const Vec3 to_center = splat.center - ray.origin;
    if constexpr (use_spheres) {
      const float middle = dot(to_center, ray.direction);
      const Vec3 across = to_center - middle * ray.direction;
      if (length_squared(across) > 1.001f * square(splat.radius)) return;
    }
    const float along = dot(ray.direction, splat.normal);
    const float t = dot(to_center, splat.normal) / along;
    if constexpr (use_early_outs) {
      const float slack = 0.01f * splat.radius;
      if ((t > query.limit() + slack || t < query.near() - slack) && fabsf(along) > 0.02f) return;
    }
    // The last word is meet_splat()'s; rounding gets larger where the ray is oblique.
    if (squared_splat_reach(splat, ray.direction * t - to_center) > 1.02f && fabsf(along) > 0.02f) return;
    query.consider(splat, index);
  }
};

/// Every splat, one after the other.
template <class Scan>
struct SplatLoop {
  const PackedSplats& packed;

  template <class Query>
  EMBRUN_FN void operator()(Query& query) const {
    const std::uint32_t count = static_cast<std::uint32_t>(packed.splats.size());
    for (std::uint32_t i = 0; i < count; ++i) Scan::test(packed.splats[i], packed.numbers[i], query);
  }
};

/// Every splat, a block at a time.
struct SplatBlockLoop {
  const PackedSplats& packed;

  template <class Query>
  EMBRUN_FN void operator()(Query& query) const {
    const std::uint32_t count = static_cast<std::uint32_t>(packed.blocks.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      offer_block(packed.blocks[i], query,
                  [&](std::uint32_t lane) { return packed.numbers[i * splats_per_block + lane]; });
    }
  }
};

/// A uniform grid whose cells are as long as the largest splat's diameter. A splat is listed in the eight cells round its
/// centre, which hold it whole.
struct SplatGrid {
  Vec3 low;
  float cell = 1;
  int size[3] = {1, 1, 1};
  std::vector<std::uint32_t> begins;  ///< of each cell's stretch of `splats`, and an end
  std::vector<std::uint32_t> splats;
};

/// Where the grid would have more than `most_cells` its cells are larger: clouds with a few small splats far apart.
SplatGrid build_splat_grid(const std::vector<Splat>& splats, std::size_t most_cells = std::size_t{1} << 27);

/// The grid's cells along the ray, one after the other [AmanatidesWoo1987].
template <class Scan>
struct SplatGridWalk {
  const SplatGrid& grid;
  const PackedSplats& packed;

  template <class Query>
  EMBRUN_FN void operator()(Query& query) const {
    const Ray& ray = query.ray();
    Box3 whole{grid.low, grid.low};
    for (int axis = 0; axis < 3; ++axis) whole.high[axis] += grid.cell * static_cast<float>(grid.size[axis]);
    const BoxSpan span = clip_line(whole, ray);
    if (span.empty() || span.exit < query.near()) return;
    const float start = max_of(span.enter, query.near());
    const Vec3 p = ray.at(start);
    int cell[3], step[3];
    float next[3], delta[3];
    for (int axis = 0; axis < 3; ++axis) {
      const float place = (p[axis] - grid.low[axis]) / grid.cell;
      cell[axis] = min_of(max_of(static_cast<int>(floorf(place)), 0), grid.size[axis] - 1);
      const float d = ray.direction[axis];
      step[axis] = d < 0.0f ? -1 : 1;
      const float face = grid.low[axis] + grid.cell * static_cast<float>(cell[axis] + (d < 0.0f ? 0 : 1));
      next[axis] = d == 0.0f ? infinity : (face - ray.origin[axis]) / d;
      delta[axis] = d == 0.0f ? infinity : grid.cell / fabsf(d);
    }
    float enter = start;
    for (;;) {
      // A little later than that, for rounding.
      if (enter > query.limit() + 1e-3f * grid.cell) return;
      const std::size_t at = static_cast<std::size_t>(cell[0]) +
                             static_cast<std::size_t>(grid.size[0]) *
                                 (static_cast<std::size_t>(cell[1]) +
                                  static_cast<std::size_t>(grid.size[1]) * static_cast<std::size_t>(cell[2]));
      for (std::uint32_t i = grid.begins[at]; i < grid.begins[at + 1]; ++i)
        Scan::test(packed.splats[grid.splats[i]], packed.numbers[grid.splats[i]], query);
      const int axis = next[0] <= next[1] && next[0] <= next[2] ? 0 : next[1] <= next[2] ? 1 : 2;
      cell[axis] += step[axis];
      if (cell[axis] < 0 || cell[axis] >= grid.size[axis]) return;
      enter = next[axis];
      next[axis] += delta[axis];
    }
  }
};

}  // namespace embrun

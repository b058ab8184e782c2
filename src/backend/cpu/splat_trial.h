#pragma once

#include <cstdint>

#include "geometry/splat_searches.h"
#include "geometry/splat_tree.h"

struct RTCSceneTy;

namespace embrun {

/// Who finds the splats along a ray. All but the tree are for measurements.
enum class SplatSearchKind : std::uint8_t {
  tree,
  thesis,         ///< one splat after the other, with the thesis's accelerations as far as they are on
  blocks,         ///< every splat, a block at a time
  embree,         ///< Embree's oriented discs: all along the ray in one query
  embree_nearest  ///< the same after a query for the nearest one, which tells how far to look
};

struct SplatSearchChoice {
  SplatSearchKind kind = SplatSearchKind::tree;
  // Of `thesis`.
  bool spheres = false, grid = false, early_outs = false;
};

/// A cloud and what its searches need; null where they are not asked for.
struct SplatTrial {
  SplatSet set;
  SplatTreeView tree;
  const PackedSplats* packed = nullptr;
  const SplatGrid* grid = nullptr;
  RTCSceneTy* discs = nullptr;  ///< of `packed`
  SplatRules rules = SplatRules::resolve;
};

}  // namespace embrun

#pragma once

#include <span>
#include <vector>

#include "geometry/splat_tree.h"
#include "math/rgb.h"

// Levels of detail: a splat that stands for all those under a child of a tree's node, as QSplat's spheres do
// [Rusinkiewicz2000]. A ray whose footprint is larger takes it for them (see SplatTreeView).

namespace embrun {

/// Stand-ins look through where their splats bend more than those that overlap on one sheet do (see splat_sheet_depth), or
/// have normals whose mean is shorter than this: they serve from a greater distance alone, so many times as far.
inline constexpr float rough_stand_in_distance = 4.0f;
inline constexpr float smooth_mean_normal = 0.95f;

/// A splat that stands for others, or is one itself.
struct SplatStandIn {
  Splat splat;
  Rgb color{1, 1, 1};
  float area = 0;    ///< sum of those of its splats, m^2: its weight in means
  float extent = 0;  ///< metres: footprints of that size and larger see no difference
  float sphere = 0;  ///< radius round the splat's centre that holds all its splats
};

SplatStandIn stand_in_of(const Splat& splat, Rgb color);

/// One for at least one: centre, normal and colour are means by area, and its outline holds those of all of them as they are
/// projected along its normal, so that where they leave no hole it does not either. Of the disc and the ellipse of their
/// spread (at most 3 times as long as wide) it is the smaller.
SplatStandIn stand_in_for(std::span<const SplatStandIn> members);

/// Those of all children of a tree's nodes.
struct SplatLevels {
  std::vector<SplatBlock> blocks;  ///< by node; lane i for child i
  std::vector<Rgb> colors;         ///< by lane of `blocks`; empty where the splats have none
  SplatStandIn whole;              ///< for all of them; only where there are any
};

/// Made from the splats themselves at every level, on the threads of the enclosing TBB arena: the same bits for any number of
/// them. The tree's nodes receive the extents. `colors` by lane of the tree's blocks, or empty.
SplatLevels make_splat_levels(SplatTree& tree, std::span<const Rgb> colors);

/// The same where what the tree was built over are stand-ins themselves: by the numbers that its splats were given.
SplatLevels make_splat_levels(SplatTree& tree, std::span<const SplatStandIn> members, bool has_colors);

}  // namespace embrun

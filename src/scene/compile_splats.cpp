#include "scene/compile_splats.h"

#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "geometry/splat_bends.h"
#include "geometry/splat_levels.h"
#include "math/median.h"

namespace embrun {
namespace {

Splat compile_splat(const SplatsDescription& description, std::size_t i, Vec3d center) {
  Splat splat{to_float(description.centers[i] - center), description.radii[i], normalize(description.normals[i]), {}};
  if (description.lesser_axes.empty()) return splat;
  const Vec3 lesser = description.lesser_axes[i];
  const float b = length(lesser), a = splat.radius;
  // As good as a disc: and no root of what rounding makes negative.
  if (b > 0.9999f * a) return splat;
  splat.squeeze = lesser * (std::sqrt(1 / (b * b) - 1 / (a * a)) / b);
  return splat;
}

/// Puts stand-ins after the splats.
void add_levels(SplatArrays& arrays) {
  const SplatLevels levels = make_splat_levels(arrays.tree, arrays.colors);
  std::vector<SplatBlock>& blocks = arrays.tree.blocks;
  arrays.first_stand_in = static_cast<std::uint32_t>(blocks.size());
  blocks.insert(blocks.end(), levels.blocks.begin(), levels.blocks.end());
  arrays.colors.insert(arrays.colors.end(), levels.colors.begin(), levels.colors.end());
  const std::size_t lanes = blocks.size() * splats_per_block;
  arrays.tree.order.resize(lanes, no_splat);
  // What a stand-in bends by is in none of its splats.
  if (!arrays.bends.empty()) arrays.bends.resize(lanes);
}

}  // namespace

SplatArrays compile_splat_arrays(const SplatsDescription& description, Vec3d center) {
  const bool mls = description.surface == CloudSurface::mls;
  std::vector<Splat> splats(description.centers.size());
  parallel_for(splats.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      splats[i] = compile_splat(description, i, center);
      if (mls) splats[i].radius *= static_cast<float>(description.mls_support);
    }
  });
  SplatArrays arrays;
  arrays.tree = mls ? build_ball_tree(splats) : build_splat_tree(splats);
  const auto in_order = [&](const auto& values, auto& ordered) {
    ordered.resize(arrays.tree.order.size());
    for (std::size_t i = 0; i < ordered.size(); ++i)
      if (arrays.tree.order[i] != no_splat) ordered[i] = values[arrays.tree.order[i]];
  };
  if (!description.colors.empty()) in_order(description.colors, arrays.colors);
  if (description.bent_normals) in_order(bend_normals(splats), arrays.bends);
  arrays.detail = static_cast<float>(description.detail);
  if (description.detail > 0) add_levels(arrays);
  return arrays;
}

SplatGeometry splat_geometry(const SplatArrays& arrays, bool closed, CloudSurface surface) {
  SplatGeometry geometry;
  geometry.tree = arrays.tree.view();
  geometry.tree.first_stand_in = arrays.first_stand_in;
  geometry.tree.detail = arrays.detail;
  geometry.set.blocks = arrays.tree.blocks.data();
  geometry.set.block_count = static_cast<std::uint32_t>(arrays.tree.blocks.size());
  geometry.set.colors = arrays.colors.empty() ? nullptr : arrays.colors.data();
  geometry.set.bends = arrays.bends.empty() ? nullptr : arrays.bends.data();
  geometry.set.closed = closed;
  geometry.mls = surface == CloudSurface::mls;
  geometry.set.bounds = arrays.tree.bounds;
  return geometry;
}

SplatGeometry splat_geometry(const SplatHierarchy& hierarchy, float detail) {
  SplatGeometry geometry;
  geometry.tree = hierarchy.tree(detail);
  geometry.set = hierarchy.set();
  return geometry;
}

float median_radius(const SplatsDescription& description) {
  if (description.hierarchy != nullptr) return description.hierarchy->median_radius;
  std::vector<float> radii = description.radii;
  return median_of(radii);
}

}  // namespace embrun

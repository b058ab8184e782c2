#include "geometry/splat_levels.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/splat_start.h"

namespace embrun {
namespace {

float lesser_half_axis(const Splat& splat) {
  return 1.0f / std::sqrt(length_squared(splat.squeeze) + 1.0f / square(splat.radius));
}

/// Means by area.
struct Means {
  Vec3d center, normal, color;
  double area = 0;
};

Means means_of(std::span<const SplatStandIn> members) {
  Means means;
  const Vec3d origin = to_double(members[0].splat.center);
  for (const SplatStandIn& member : members) {
    const auto area = static_cast<double>(member.area);
    means.center = means.center + area * (to_double(member.splat.center) - origin);
    means.normal = means.normal + area * to_double(member.splat.normal);
    means.color = means.color + area * Vec3d{static_cast<double>(member.color.r), static_cast<double>(member.color.g),
                                             static_cast<double>(member.color.b)};
    means.area += area;
  }
  const double share = 1 / means.area;
  means.center = origin + share * means.center;
  means.normal = share * means.normal;
  means.color = share * means.color;
  return means;
}

/// Two directions in a plane, and how wide the splats are along the second as a share of the first.
struct Spread {
  Vec3 greater, lesser;
  float ratio = 1;
};

Spread spread_of(std::span<const SplatStandIn> members, Vec3 center, const Frame& frame) {
  double ss = 0, st = 0, tt = 0;
  for (const SplatStandIn& member : members) {
    const Vec3 offset = member.splat.center - center;
    const auto s = static_cast<double>(dot(offset, frame.s)), t = static_cast<double>(dot(offset, frame.t));
    const auto area = static_cast<double>(member.area), radius = static_cast<double>(member.splat.radius);
    // A disc's own variance along any direction of its plane.
    const double own = 0.25 * radius * radius;
    ss += area * (s * s + own);
    st += area * s * t;
    tt += area * (t * t + own);
  }
  const double half = 0.5 * std::hypot(ss - tt, 2 * st), middle = 0.5 * (ss + tt);
  const double angle = 0.5 * std::atan2(2 * st, ss - tt);
  const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
  constexpr double least_ratio = 1.0 / 3;
  Spread spread{c * frame.s + s * frame.t, c * frame.t - s * frame.s, 1};
  if (middle + half > 0)
    spread.ratio =
        static_cast<float>(std::sqrt(std::max((middle - half) / (middle + half), least_ratio * least_ratio)));
  return spread;
}

/// Grows round what it is shown: the disc, and the ellipse of a given ratio, that hold it all.
class Outline {
 public:
  Outline(Vec3 center, const Spread& spread) : center_(center), spread_(spread), stretch_(1.0f / spread.ratio) {}

  void include(const Splat& splat) {
    constexpr int corners = 8;
    constexpr float reach = 1.0824f;  // of an octagon round the unit circle: its affine images hold ellipses
    const float u = along(splat.center, spread_.greater), v = along(splat.center, spread_.lesser);
    const float own = reach * splat.radius;
    if (std::hypot(u, v) + own <= disc_ && std::hypot(u, stretch_ * v) + stretch_ * own <= ellipse_) return;
    const float squeezed = length(splat.squeeze);
    const Vec3 lesser = squeezed > 0 ? splat.squeeze / squeezed : Frame(splat.normal).s;
    const Vec3 greater = cross(splat.normal, lesser);
    const float a = reach * splat.radius, b = reach * lesser_half_axis(splat);
    for (int i = 0; i < corners; ++i) {
      const float angle = 2 * pi * static_cast<float>(i) / static_cast<float>(corners);
      const Vec3 corner = splat.center + (a * std::cos(angle)) * greater + (b * std::sin(angle)) * lesser;
      const float cu = along(corner, spread_.greater), cv = along(corner, spread_.lesser);
      disc_ = std::max(disc_, std::hypot(cu, cv));
      ellipse_ = std::max(ellipse_, std::hypot(cu, stretch_ * cv));
    }
  }

  /// The smaller of the two, and a little more for rounding.
  Splat splat(Vec3 normal) const {
    constexpr float more = 1.0001f;
    if (!(square(ellipse_) * spread_.ratio < 0.99f * square(disc_))) return {center_, more * disc_, normal, {}};
    const float a = more * ellipse_, b = a * spread_.ratio;
    return {center_, a, normal, spread_.lesser * std::sqrt(1 / square(b) - 1 / square(a))};
  }

 private:
  Vec3 center_;
  Spread spread_;
  float stretch_;
  float disc_ = 0, ellipse_ = 0;

  float along(Vec3 point, Vec3 axis) const { return dot(point - center_, axis); }
};

/// All splats under a child of a node; of(lane number) is what stands in a lane of a block.
template <class Of>
void gather(const SplatTree& tree, const Of& of, std::uint32_t child, std::vector<SplatStandIn>& members) {
  std::vector<std::uint32_t> pending{child};
  while (!pending.empty()) {
    const std::uint32_t next = pending.back();
    pending.pop_back();
    if ((next & splat_leaf) != 0) {
      const std::size_t first = std::size_t{next & ~splat_leaf} * splats_per_block;
      for (std::size_t number = first; number < first + splats_per_block; ++number)
        if (tree.order[number] != no_splat) members.push_back(of(number));
    } else {
      for (std::uint32_t i = splat_tree_width; i-- > 0;)
        if (has_child(tree.nodes[next], i)) pending.push_back(tree.nodes[next].child[i]);
    }
  }
}

template <class Of>
SplatLevels levels_over(SplatTree& tree, const Of& of, bool has_colors) {
  SplatLevels levels;
  levels.blocks.resize(tree.nodes.size());
  if (has_colors) levels.colors.resize(tree.nodes.size() * splat_tree_width);
  if (tree.nodes.empty()) return levels;
  std::array<SplatStandIn, splat_tree_width> of_root;
  parallel_for(tree.nodes.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<SplatStandIn> members;
    for (std::size_t n = begin; n < end; ++n) {
      for (std::uint32_t i = 0; i < splat_tree_width; ++i) {
        if (!has_child(tree.nodes[n], i)) continue;
        members.clear();
        gather(tree, of, tree.nodes[n].child[i], members);
        const SplatStandIn stand_in = stand_in_for(members);
        levels.blocks[n].set(i, stand_in.splat);
        tree.nodes[n].extent[i] = stand_in.extent;
        if (has_colors) levels.colors[n * splat_tree_width + i] = stand_in.color;
        if (n == 0) of_root[i] = stand_in;
      }
    }
  });
  std::vector<SplatStandIn> members;
  for (std::uint32_t i = 0; i < splat_tree_width; ++i)
    if (has_child(tree.nodes[0], i)) members.push_back(of_root[i]);
  levels.whole = stand_in_for(members);
  return levels;
}

}  // namespace

SplatStandIn stand_in_of(const Splat& splat, Rgb color) {
  SplatStandIn own{splat, color, 0, 2 * splat.radius, splat.radius};
  own.area = pi * splat.radius * lesser_half_axis(splat);
  return own;
}

SplatStandIn stand_in_for(std::span<const SplatStandIn> members) {
  EMBRUN_CHECK(!members.empty());
  if (members.size() == 1) return members[0];
  const Means means = means_of(members);
  const double agreement = length(means.normal);
  const Vec3 normal = agreement > 1e-3 ? to_float(means.normal * (1 / agreement)) : members[0].splat.normal;
  const Vec3 center = to_float(means.center);

  Outline outline(center, spread_of(members, center, Frame(normal)));
  float height = 0;
  SplatStandIn result;
  for (const SplatStandIn& member : members) {
    outline.include(member.splat);
    const Vec3 offset = member.splat.center - center;
    height = std::max(height, std::fabs(dot(offset, normal)));
    result.sphere = std::max(result.sphere, length(offset) + member.sphere);
  }
  result.splat = outline.splat(normal);
  result.color = {static_cast<float>(means.color.x), static_cast<float>(means.color.y),
                  static_cast<float>(means.color.z)};
  result.area = static_cast<float>(means.area);
  const bool smooth =
      agreement >= static_cast<double>(smooth_mean_normal) && height <= splat_sheet_depth * result.splat.radius;
  result.extent = 2 * std::max(result.sphere, result.splat.radius) * (smooth ? 1.0f : rough_stand_in_distance);
  return result;
}

SplatLevels make_splat_levels(SplatTree& tree, std::span<const Rgb> colors) {
  const auto of = [&](std::size_t number) {
    const Splat splat =
        tree.blocks[number / splats_per_block].splat(static_cast<std::uint32_t>(number % splats_per_block));
    return stand_in_of(splat, colors.empty() ? Rgb{1, 1, 1} : colors[number]);
  };
  return levels_over(tree, of, !colors.empty());
}

SplatLevels make_splat_levels(SplatTree& tree, std::span<const SplatStandIn> members, bool has_colors) {
  return levels_over(
      tree, [&](std::size_t number) { return members[tree.order[number]]; }, has_colors);
}

}  // namespace embrun

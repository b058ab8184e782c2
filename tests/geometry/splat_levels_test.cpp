// Stand-ins for parts of a cloud, and rays that take them.

#include "geometry/splat_levels.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>

#include "geometry/splat_clouds.h"

namespace embrun {
namespace {

/// A cloud with its stand-ins, as a scene holds it.
struct LevelledCloud {
  SplatTree tree;
  SplatLevels levels;
  std::uint32_t first_stand_in = 0;
  std::vector<SplatBlock> blocks;
  std::vector<Rgb> colors;

  explicit LevelledCloud(const std::vector<Splat>& splats, const std::vector<Rgb>& own_colors = {})
      : tree(build_splat_tree(splats)) {
    if (!own_colors.empty()) {
      colors.resize(tree.order.size());
      for (std::size_t i = 0; i < colors.size(); ++i)
        if (tree.order[i] != no_splat) colors[i] = own_colors[tree.order[i]];
    }
    levels = make_splat_levels(tree, colors);
    first_stand_in = static_cast<std::uint32_t>(tree.blocks.size());
    blocks = tree.blocks;
    blocks.insert(blocks.end(), levels.blocks.begin(), levels.blocks.end());
    colors.insert(colors.end(), levels.colors.begin(), levels.colors.end());
  }
  SplatSet set(bool closed) const {
    SplatSet set = set_of(tree, closed);
    set.blocks = blocks.data();
    set.block_count = static_cast<std::uint32_t>(blocks.size());
    set.colors = colors.empty() ? nullptr : colors.data();
    return set;
  }
  SplatTreeView view(float detail = 1) const {
    SplatTreeView view = tree.view();
    view.blocks = blocks.data();
    view.first_stand_in = first_stand_in;
    view.detail = detail;
    return view;
  }
  bool is_stand_in(std::uint32_t index) const { return index / splats_per_block >= first_stand_in; }
  /// The splats (lanes of the tree's blocks) that a splat or stand-in is there for.
  std::set<std::uint32_t> splats_of(std::uint32_t index) const {
    std::set<std::uint32_t> found;
    if (!is_stand_in(index)) return {index};
    const std::uint32_t node = index / splats_per_block - first_stand_in;
    std::vector<std::uint32_t> pending{tree.nodes[node].child[index % splats_per_block]};
    while (!pending.empty()) {
      const std::uint32_t next = pending.back();
      pending.pop_back();
      for (std::uint32_t i = 0; i < splat_tree_width; ++i) {
        if ((next & splat_leaf) != 0) {
          const std::uint32_t number = (next & ~splat_leaf) * splats_per_block + i;
          if (tree.order[number] != no_splat) found.insert(number);
        } else if (has_child(tree.nodes[next], i)) {
          pending.push_back(tree.nodes[next].child[i]);
        }
      }
    }
    return found;
  }
};

/// The unit sphere by 10 * 4^steps + 2 discs whose radius closes it as that of the thesis's 2,562 does.
std::vector<Splat> fine_sphere(int steps) {
  std::vector<Splat> splats;
  for (const Vec3& p : icosphere(steps)) splats.push_back(disc(p, p, 0.055f * std::ldexp(1.0f, 4 - steps)));
  return splats;
}

Ray wide(Ray ray, float width) {
  ray.cone_width = width;
  ray.cone_spread = 0;
  return ray;
}

/// Takes all that it is shown, however far away.
struct Collector {
  const Ray& along;
  std::multiset<std::uint32_t> shown;

  const Ray& ray() const { return along; }
  float near() const { return 0; }
  float limit() const { return infinity; }
  void consider(const Splat& splat, std::uint32_t index) {
    SplatMeeting meeting;
    if (meet_splat(splat, along, meeting)) shown.insert(index);
  }
};

TEST(SplatLevels, MeansAreByArea) {
  // Two discs of radii 1 and 2, areas as 1 to 4.
  const SplatStandIn parts[] = {stand_in_of(disc({0, 0, 0}, {0, 0, 1}, 1), {1, 0, 0.5f}),
                                stand_in_of(disc({10, 0, 0}, {0, 0, 1}, 2), {0, 1, 0.5f})};
  const SplatStandIn both = stand_in_for(parts);
  EXPECT_NEAR(both.area, pi * 5, 1e-4);
  EXPECT_NEAR(both.splat.center.x, 8, 1e-5);
  EXPECT_NEAR(both.color.r, 0.2, 1e-6);
  EXPECT_NEAR(both.color.g, 0.8, 1e-6);
  EXPECT_NEAR(both.color.b, 0.5, 1e-6);
  // From 8 back to -1 and on to 12.
  EXPECT_NEAR(both.sphere, 9, 1e-4);
  EXPECT_GE(both.splat.radius, 9);
  EXPECT_GE(both.extent, 18);
  // One is itself.
  const SplatStandIn one = stand_in_for({parts, 1});
  EXPECT_EQ(one.splat.radius, 1);
  EXPECT_EQ(one.extent, 2);
  // Normals 90 degrees apart, of the same weight: the mean lies between them, and is no smooth surface's.
  const SplatStandIn edge[] = {stand_in_of(disc({-1, 0, 0}, {-1, 0, 1}, 1), {}),
                               stand_in_of(disc({1, 0, 0}, {1, 0, 1}, 1), {})};
  const SplatStandIn bent = stand_in_for(edge);
  EXPECT_NEAR(dot(bent.splat.normal, Vec3{0, 0, 1}), 1, 1e-6);
  EXPECT_NEAR(bent.sphere, 2, 1e-5);
  EXPECT_NEAR(bent.extent, rough_stand_in_distance * 2 * std::max(2.0f, bent.splat.radius), 1e-3);
}

TEST(SplatLevels, ConserveAreaAndColourUpToTheRoot) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<Splat> splats;
  std::vector<Rgb> colors;
  double area = 0, red = 0;
  for (int i = 0; i < 3000; ++i) {
    const float radius = 0.01f + 0.03f * unit(random), lesser = radius * (0.4f + 0.5f * unit(random));
    splats.push_back(
        ellipse({unit(random), unit(random), 0.1f * unit(random)}, {0.1f * unit(random), 0, 1}, radius, lesser, 1));
    colors.push_back({unit(random), unit(random), unit(random)});
    const double own = M_PI * static_cast<double>(radius) * static_cast<double>(lesser);
    area += own;
    red += own * static_cast<double>(colors.back().r);
  }
  const LevelledCloud cloud(splats, colors);
  EXPECT_NEAR(cloud.levels.whole.area, area, 1e-4 * area);
  EXPECT_NEAR(cloud.levels.whole.color.r, red / area, 1e-4);
}

TEST(SplatLevels, ARayMeetsEachSplatOrOneThatStandsForIt) {
  const LevelledCloud cloud(fine_sphere(5));
  int stand_ins = 0;
  for (Ray ray : rays_at(cloud.tree.bounds, 200, 5)) {
    for (const float width : {0.0f, 0.06f, 0.2f, 0.7f}) {
      ray = wide(ray, width);
      Collector all{ray, {}}, met{ray, {}};
      cloud.view(0)(all);
      cloud.view(1)(met);
      std::set<std::uint32_t> there;
      for (const std::uint32_t index : met.shown) {
        stand_ins += cloud.is_stand_in(index);
        if (cloud.is_stand_in(index)) {
          EXPECT_LE(2 * cloud.set(true).splat(index).radius, width);
        }
        for (const std::uint32_t splat : cloud.splats_of(index))
          EXPECT_TRUE(there.insert(splat).second) << "splat " << splat << " is there twice";
      }
      if (width == 0) {
        EXPECT_EQ(met.shown, all.shown);
      }
    }
  }
  EXPECT_GT(stand_ins, 500);
}

TEST(SplatLevels, WithoutAFootprintNothingChanges) {
  const LevelledCloud cloud(fine_sphere(4));
  const SplatTreeView plain = cloud.tree.view();
  for (const bool closed : {true, false})
    for (const Ray& ray : rays_at(cloud.tree.bounds, 500, 6)) {
      SurfaceHit expected, hit, off;
      const bool found = intersect_splats(set_of(cloud.tree, closed), plain, ray, false, {}, expected);
      ASSERT_EQ(intersect_splats(cloud.set(closed), cloud.view(1), ray, false, {}, hit), found);
      ASSERT_EQ(intersect_splats(cloud.set(closed), cloud.view(0), wide(ray, 1), false, {}, off), found);
      if (!found) continue;
      EXPECT_EQ(hit.t, expected.t);
      EXPECT_EQ(off.t, expected.t);
      EXPECT_EQ(std::memcmp(&hit.shading_normal, &expected.shading_normal, sizeof hit.shading_normal), 0);
    }
}

TEST(SplatLevels, LeaveNoHoleInASphereAtAnyLevel) {
  // Rays at points well within the unit sphere meet it at every level, near where the sphere is and with its normal there.
  // A disc of radius r that touches the sphere where its centre is lies r^2 / 2 off it at its outline, and its normal r.
  const LevelledCloud cloud(fine_sphere(6));
  for (const float width : {0.0f, 0.03f, 0.06f, 0.12f, 0.24f}) {
    for (const bool closed : {true, false}) {
      double turned = 0, depth = 0, radius = 0;
      int rays = 0;
      std::mt19937 random(7);
      std::uniform_real_distribution<float> unit(-1, 1);
      while (rays < 3000) {
        const Vec3 from{unit(random), unit(random), unit(random)}, to{unit(random), unit(random), unit(random)};
        if (length(from) > 1 || length(from) < 0.1f || length(to) > 0.9f) continue;
        Ray ray;
        ray.origin = 3.0f * normalize(from);
        ray.direction = normalize(to - ray.origin);
        SurfaceHit hit;
        ASSERT_TRUE(intersect_splats(cloud.set(closed), cloud.view(), wide(ray, width), false, {}, hit))
            << "footprint " << width << ", ray " << rays;
        EXPECT_TRUE(hit.entering);
        // Where the line meets the sphere.
        const float half = dot(ray.origin, ray.direction);
        const float t = -half - std::sqrt(square(half) - length_squared(ray.origin) + 1);
        turned += std::acos(std::min(dot(hit.shading_normal, normalize(ray.at(t))), 1.0f)) * 180 / M_PI;
        depth += std::fabs(hit.t - t);
        radius += hit.splat_radius;
        ++rays;
      }
      turned /= rays, depth /= rays, radius /= rays;
      std::printf("footprint %.2f %s: splats of radius %.4f, normals %.3f degrees off, %.5f in depth\n",
                  static_cast<double>(width), closed ? "closed" : "open", radius, turned, depth);
      // Half the radius would be the error at the middle of a disc that does not interpolate.
      EXPECT_LT(turned, 0.5 * radius * 180 / M_PI);
      EXPECT_LT(depth, radius * radius);
      if (width >= 0.12f) {
        EXPECT_GT(radius, 1.9 * 0.055 / 4);
      }
      EXPECT_LE(radius, std::max(0.5 * static_cast<double>(width), 0.0138));
    }
  }
}

TEST(SplatLevels, TheSilhouetteStaysWhereItIs) {
  // Parallel rays: the share of the square of side 2.6 that the unit disc covers is pi / 6.76.
  const LevelledCloud cloud(fine_sphere(6));
  constexpr int side = 300;
  for (const float width : {0.0f, 0.06f, 0.12f}) {
    int met = 0;
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        Ray ray;
        const float step = 2.6f / side;
        ray.origin = {-1.3f + step * (static_cast<float>(x) + 0.5f), -1.3f + step * (static_cast<float>(y) + 0.5f), 3};
        ray.direction = {0, 0, -1};
        SurfaceHit hit;
        met += intersect_splats(cloud.set(true), cloud.view(), wide(ray, width), false, {}, hit);
      }
    const double area = 6.76 * met / (side * side), radius = std::sqrt(area / M_PI);
    std::printf("footprint %.2f: silhouette of radius %.4f\n", static_cast<double>(width), radius);
    // Pixels are 0.0087 wide: the count of those on the circle is exact to a tenth of that.
    EXPECT_NEAR(radius, 1, 0.001 + 0.1 * static_cast<double>(width)) << width;
  }
}

TEST(SplatLevels, APlaneStaysAPlane) {
  // A grid of discs that just close a square: nothing within opens, at any level and however slanted the ray.
  std::vector<Splat> splats;
  std::vector<Rgb> colors;
  std::mt19937 random(8);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x) {
      splats.push_back(disc({0.01f * static_cast<float>(x), 0.01f * static_cast<float>(y), 0}, {0, 0, 1}, 0.0072f));
      colors.push_back({0.01f * static_cast<float>(x), 0.5f, 0.01f * static_cast<float>(y)});
    }
  const LevelledCloud cloud(splats, colors);
  for (const float width : {0.0f, 0.05f, 0.1f, 0.4f}) {
    double off = 0, sum = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 at{unit(random) * 0.99f, unit(random) * 0.99f, 0};
      Ray ray;
      ray.direction = normalize(Vec3{unit(random) - 0.5f, unit(random) - 0.5f, -0.2f});
      ray.origin = at - 2.0f * ray.direction;
      SurfaceHit hit;
      ASSERT_TRUE(intersect_splats(cloud.set(false), cloud.view(), wide(ray, width), false, {}, hit)) << width;
      EXPECT_NEAR(hit.t, 2, 1e-4);
      EXPECT_NEAR(hit.shading_normal.z, 1, 1e-5);
      EXPECT_NEAR(hit.color.g, 0.5, 1e-4);
      off += std::fabs(hit.color.r - at.x);
      sum += hit.color.r - at.x;
    }
    // A colour that grows by 1 a metre is as far off as the place it is taken from; on average it is not.
    EXPECT_LT(off / 2000, 0.004 + 0.25 * static_cast<double>(width)) << width;
    EXPECT_LT(std::fabs(sum / 2000), 0.002 + 0.03 * static_cast<double>(width)) << width;
  }
}

TEST(SplatLevels, TwoSidesOfAThinWallAreNotOneFromNearBy) {
  // Front and back of a sheet 0.001 thick, closely packed: their mean normal is none. They stay two until the part is a
  // quarter of the footprint.
  std::vector<Splat> splats;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x)
      for (const float side : {-1.0f, 1.0f})
        splats.push_back(disc({0.01f * static_cast<float>(x), 0.01f * static_cast<float>(y), 0.0005f * side},
                              {0, 0, side}, 0.0072f));
  const LevelledCloud cloud(splats);
  std::size_t smooth = 0, mixed = 0;
  for (std::size_t n = 0; n < cloud.levels.blocks.size(); ++n)
    for (std::uint32_t i = 0; i < splat_tree_width; ++i) {
      if (!has_child(cloud.tree.nodes[n], i)) continue;
      const std::uint32_t number = (cloud.first_stand_in + static_cast<std::uint32_t>(n)) * splats_per_block + i;
      bool sides[2] = {false, false};
      for (const std::uint32_t splat : cloud.splats_of(number))
        sides[cloud.tree.blocks[splat / splats_per_block].normal_z[splat % splats_per_block] > 0] = true;
      if (!sides[0] || !sides[1]) continue;
      ++mixed;
      smooth += cloud.tree.nodes[n].extent[i] < 4 * 2 * cloud.levels.blocks[n].radius[i];
    }
  EXPECT_GT(mixed, 100u);
  EXPECT_EQ(smooth, 0u);
  // From far away it is still there.
  Ray ray;
  ray.origin = {0.2f, 0.2f, 5};
  ray.direction = {0, 0, -1};
  SurfaceHit hit;
  EXPECT_TRUE(intersect_splats(cloud.set(false), cloud.view(), wide(ray, 20), false, {}, hit));
}

TEST(SplatLevels, AreTheSameForAnyNumberOfThreads) {
  SplatTree trees[2] = {build_splat_tree(fine_sphere(5)), build_splat_tree(fine_sphere(5))};
  SplatLevels levels[2];
  for (const int threads : {1, 4}) {
    tbb::task_arena arena(threads);
    arena.execute([&] { levels[threads / 4] = make_splat_levels(trees[threads / 4], {}); });
  }
  ASSERT_EQ(levels[0].blocks.size(), levels[1].blocks.size());
  EXPECT_EQ(std::memcmp(levels[0].blocks.data(), levels[1].blocks.data(), levels[0].blocks.size() * sizeof(SplatBlock)),
            0);
  EXPECT_EQ(std::memcmp(trees[0].nodes.data(), trees[1].nodes.data(), trees[0].nodes.size() * sizeof(SplatNode)), 0);
}

TEST(SplatLevels, OfNothingAndOfOneSplat) {
  SplatTree none = build_splat_tree({});
  EXPECT_TRUE(make_splat_levels(none, {}).blocks.empty());
  const LevelledCloud one({disc({1, 2, 3}, {0, 0, 1}, 0.5f)});
  Ray ray;
  ray.origin = {1, 2, 5};
  ray.direction = {0, 0, -1};
  SurfaceHit hit;
  ASSERT_TRUE(intersect_splats(one.set(false), one.view(), wide(ray, 100), false, {}, hit));
  EXPECT_EQ(hit.t, 2);
  EXPECT_EQ(hit.splat_radius, 0.5f);
}

}  // namespace
}  // namespace embrun

// Open clouds at the edges of thin bodies and at sharp ones: what reaches over them from the far side is not there.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "geometry/splat_clouds.h"
#include "geometry/splat_set.h"

namespace embrun {
namespace {

constexpr float spacing = 0.04f, splat_radius = 0.03f;  // a square grid of them is closed by 0.0283

/// A round plate of radius 1 with a half round rim, half as thick as its splats' diameter.
constexpr float half_thickness = 0.015f;
std::vector<Splat> plate() {
  std::vector<Splat> splats;
  for (float ring = 1; ring > 0; ring -= spacing)
    for (float turn = 0; turn < 2 * pi; turn += spacing / ring)
      for (const float side : {-1.0f, 1.0f})
        splats.push_back(
            disc({ring * std::cos(turn), ring * std::sin(turn), side * half_thickness}, {0, 0, side}, splat_radius));
  for (float turn = 0; turn < 2 * pi; turn += spacing)
    for (const float up : {-0.9f, 0.0f, 0.9f}) {
      const Vec3 out{std::cos(up) * std::cos(turn), std::cos(up) * std::sin(turn), std::sin(up)};
      splats.push_back(disc(Vec3{std::cos(turn), std::sin(turn), 0} + half_thickness * out, out, splat_radius));
    }
  return splats;
}

TEST(SplatEdges, AThinBodyIsSeenFromOutsideAlone) {
  const SplatTree tree = build_splat_tree(plate());
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  int met = 0, from_behind = 0, by_first_hit = 0, held = 0;
  for (int i = 0; i < 40000; ++i) {
    // At the rim, where it is a silhouette.
    const float turn = pi * unit(random), away = 1 + 2 * splat_radius * unit(random);
    const Vec3 to{away * std::cos(turn), away * std::sin(turn), half_thickness * unit(random)};
    Ray ray;
    ray.origin = 4.0f * normalize(Vec3{unit(random), unit(random), unit(random) + 1e-3f});
    ray.direction = normalize(to - ray.origin);
    SurfaceHit hit;
    const bool found = intersect_splats(set_of(tree, false), tree.view(), ray, false, {}, hit);
    met += found;
    from_behind += found && !hit.entering;
    // A ray to a place within the body has come through its surface.
    if (away < 1) {
      ++held;
      EXPECT_TRUE(found) << "ray " << i;
    }
    if (intersect_splats(set_of(tree, false), tree.view(), ray, false, {}, hit, SplatRules::first_hit))
      by_first_hit += !hit.entering;
  }
  EXPECT_GT(held, 15000);
  EXPECT_GT(by_first_hit, 400);
  std::printf("%d of %d rays at the rim meet a back; without the rules %d\n", from_behind, met, by_first_hit);
  // Either rule alone leaves more.
  EXPECT_LE(from_behind, by_first_hit / 70);
}

/// A square of discs: the middles of its cells from `corner` on along two edges.
void add_wall(std::vector<Splat>& splats, Vec3 corner, Vec3 u, Vec3 v, Vec3 normal) {
  const auto steps = static_cast<int>(std::lround(1 / spacing));
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j)
      splats.push_back(
          disc(corner + (spacing * (static_cast<float>(i) + 0.5f)) * u + (spacing * (static_cast<float>(j) + 0.5f)) * v,
               normal, splat_radius));
}

TEST(SplatEdges, AnOpenBoxIsWholeFromWithin) {
  // The unit cube without its lid, normals outwards.
  std::vector<Splat> splats;
  add_wall(splats, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1});
  add_wall(splats, {0, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0});
  add_wall(splats, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0});
  add_wall(splats, {0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, -1, 0});
  add_wall(splats, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0});
  const SplatTree tree = build_splat_tree(splats);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int i = 0; i < 20000; ++i) {
    // To the floor and to one wall, their common edge included.
    Vec3 to{unit(random), unit(random), 0};
    if (i % 2 != 0) to = {0, unit(random), 0.95f * unit(random)};
    Ray ray;
    ray.origin = {0.3f + 0.4f * unit(random), 0.3f + 0.4f * unit(random), 0.3f + 0.4f * unit(random)};
    ray.direction = normalize(to - ray.origin);
    SurfaceHit hit;
    ASSERT_TRUE(intersect_splats(set_of(tree, false), tree.view(), ray, false, {}, hit)) << "ray " << i;
    // Walls reach a radius over each other's edges, and from within that which is met first is the surface.
    EXPECT_NEAR(length(hit.position - to), 0, 1e-4f) << "ray " << i;
    // What is met at less than 20 degrees from behind is taken for an edge seen from outside.
    const float slant = i % 2 != 0 ? -ray.direction.x : -ray.direction.z;
    if (slant > splat_edge_slant) {
      EXPECT_FALSE(hit.entering) << "ray " << i;
    }
  }
}

TEST(SplatEdges, TheCornerOfARoomIsWholeFromBehind) {
  // A floor and a wall, normals into the room; seen from below and from beside it.
  std::vector<Splat> splats;
  add_wall(splats, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  add_wall(splats, {0, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0});
  const SplatTree tree = build_splat_tree(splats);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int i = 0; i < 10000; ++i) {
    const float far = i % 4 == 0 ? 0.05f : 1.0f;  // a quarter of them at the corner
    Vec3 to{far * unit(random), unit(random), 0};
    if (i % 2 != 0) to = {0, unit(random), far * unit(random)};
    Ray ray;
    ray.origin = to + Vec3{-0.5f - unit(random), unit(random) - 0.5f, -0.5f - unit(random)};
    ray.direction = normalize(to - ray.origin);
    SurfaceHit hit;
    ASSERT_TRUE(intersect_splats(set_of(tree, false), tree.view(), ray, false, {}, hit)) << "ray " << i;
    // What reaches over the corner from the room's other wall is met up to a radius before it.
    EXPECT_LE(hit.t, length(to - ray.origin) + 1e-4f) << "ray " << i;
    EXPECT_LT(length(hit.position - to), 0.12f) << "ray " << i;
  }
}

}  // namespace
}  // namespace embrun

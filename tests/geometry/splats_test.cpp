// What rays meet on clouds of splats, against an oracle that looks at every splat in double precision.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "geometry/splat_clouds.h"
#include "geometry/splat_oracle.h"
#include "geometry/splat_searches.h"

namespace embrun {
namespace {

namespace oracle = splat_oracle;
using oracle::operator-;
using oracle::operator*;

oracle::V v_of(Vec3 a) { return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)}; }

/// As the oracle wants a splat: its half axes from the definition of `squeeze`.
oracle::Disc disc_of(const Splat& s) {
  const oracle::V n = v_of(s.normal), q = v_of(s.squeeze);
  oracle::V lesser = oracle::norm(q) > 0 ? q : v_of(Frame(s.normal).s);
  lesser = (1 / oracle::norm(lesser)) * lesser;
  const oracle::V greater{n[1] * lesser[2] - n[2] * lesser[1], n[2] * lesser[0] - n[0] * lesser[2],
                          n[0] * lesser[1] - n[1] * lesser[0]};
  const double a = static_cast<double>(s.radius), b = 1 / std::sqrt(oracle::dot(q, q) + 1 / (a * a));
  return {v_of(s.center), n, a * greater, b * lesser};
}

/// Compares many rays with the oracle; those that rounding decides are left out, and must be few.
void expect_as_oracle(const std::vector<Splat>& splats, bool closed, bool inside, const std::vector<Ray>& rays,
                      double most_left_out = 0.02) {
  const SplatTree tree = build_splat_tree(splats);
  const SplatSet set = set_of(tree, closed);
  std::vector<oracle::Disc> discs;
  for (const Splat& s : splats) discs.push_back(disc_of(s));
  std::size_t left_out = 0, hits = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    const oracle::Answer expected =
        oracle::surface(discs, v_of(ray.origin), v_of(ray.direction), static_cast<double>(ray.t_min),
                        static_cast<double>(splat_group_reach), closed, inside);
    // Single precision at distances of some extents of the cloud.
    if (expected.margin < 2e-4) {
      ++left_out;
      continue;
    }
    SurfaceHit hit;
    ASSERT_EQ(intersect_splats(set, tree.view(), ray, inside, {}, hit), expected.found) << "ray " << i;
    if (!expected.found) continue;
    ++hits;
    EXPECT_NEAR(static_cast<double>(hit.t), expected.t, 2e-5 * expected.t) << "ray " << i;
    const double slant = oracle::dot(v_of(ray.direction), expected.normal);
    if (!closed && slant > 0 && slant < static_cast<double>(splat_edge_slant) + 1e-3) {
      // What is met at a slant from behind is an edge seen from the front: its normal is turned to the ray, and no more.
      if (slant > static_cast<double>(splat_edge_slant) - 1e-3) continue;
      EXPECT_TRUE(hit.entering) << "ray " << i;
      EXPECT_GT(oracle::dot(v_of(hit.shading_normal), expected.normal), std::cos(std::asin(slant) + 0.025))
          << "ray " << i;
      EXPECT_LT(dot(hit.geometric_normal, ray.direction), 0) << "ray " << i;
      continue;
    }
    if (expected.by_fronts && hit.entering) continue;
    EXPECT_EQ(hit.entering, expected.entering) << "ray " << i;
    EXPECT_LT(oracle::norm(v_of(hit.shading_normal) - expected.normal), 2e-3) << "ray " << i;
    EXPECT_NEAR(static_cast<double>(length(hit.geometric_normal)), 1, 1e-5);
    EXPECT_EQ(dot(hit.geometric_normal, ray.direction) < 0, hit.entering) << "ray " << i;
  }
  EXPECT_GT(hits, rays.size() / 20);
  EXPECT_LE(static_cast<double>(left_out), most_left_out * static_cast<double>(rays.size()));
}

/// Splats anywhere, of radii that differ by a factor of 30, every other one an ellipse.
std::vector<Splat> random_splats(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<Splat> splats;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 c{unit(random), unit(random), unit(random)}, n{unit(random), unit(random), unit(random) + 1e-3f};
    const float r = 0.01f * std::pow(30.0f, 0.5f + 0.5f * unit(random));
    splats.push_back(i % 2 == 0 ? disc(c, n, r)
                                : ellipse(c, n, r, r * (0.6f + 0.35f * unit(random)), 3 * unit(random)));
  }
  return splats;
}

TEST(Splats, RandomCloudsAsTheOracle) {
  const std::vector<Splat> splats = random_splats(3000, 1);
  const std::vector<Ray> rays = rays_at({{-1, -1, -1}, {1, 1, 1}}, 400, 2);
  // So many splats reach every ray that the margin of one is often small.
  for (const bool closed : {false, true})
    for (const bool inside : {false, true}) expect_as_oracle(splats, closed, inside, rays, 0.6);
}

TEST(Splats, SphereAsTheOracle) {
  const std::vector<Splat> splats = splat_sphere();
  for (const bool closed : {false, true})
    expect_as_oracle(splats, closed, false, rays_at({{-1, -1, -1}, {1, 1, 1}}, 1000, 3), 0.1);
  std::vector<Ray> inner = rays_at({{-1, -1, -1}, {1, 1, 1}}, 500, 4);
  for (Ray& ray : inner) ray.origin = 0.15f * ray.origin;
  expect_as_oracle(splats, true, true, inner, 0.1);
}

TEST(Splats, ScansAsTheOracle) {
  for (const auto& [name, radius, closed] :
       {std::tuple{"bunny_35947.ply", 0.0012f, false}, std::tuple{"igea_70658.ply", 0.0006f, true}}) {
    const std::vector<Splat> splats = scanned_cloud(name, radius);
    EMBRUN_SKIP_WITHOUT(splats, name);
    expect_as_oracle(splats, closed, false, rays_at(build_splat_tree(splats).bounds, 300, 5), 0.2);
  }
}

// ---- the accelerations -------------------------------------------------------------------------------------------

template <class Search>
std::vector<SurfaceHit> hits_by(const Search& search, const SplatSet& set, const std::vector<Ray>& rays) {
  std::vector<SurfaceHit> hits(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) intersect_splats(set, search, rays[i], false, {}, hits[i]);
  return hits;
}

void expect_same_bits(const std::vector<SurfaceHit>& a, const std::vector<SurfaceHit>& b, const char* what) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].t, b[i].t) << what << ", ray " << i;
    ASSERT_TRUE(a[i].position == b[i].position && a[i].shading_normal == b[i].shading_normal) << what << ", ray " << i;
  }
}

void expect_all_searches_alike(const std::vector<Splat>& splats, bool closed, std::size_t rays_count) {
  const SplatTree tree = build_splat_tree(splats);
  const SplatSet set = set_of(tree, closed);
  const PackedSplats packed = pack_splats(tree);
  const SplatGrid grid = build_splat_grid(packed.splats);
  const std::vector<Ray> rays = rays_at(tree.bounds, rays_count, 6);
  const std::vector<SurfaceHit> expected = hits_by(SplatLoop<SplatScan<false, false>>{packed}, set, rays);
  expect_same_bits(hits_by(tree.view(), set, rays), expected, "tree");
  expect_same_bits(hits_by(SplatBlockLoop{packed}, set, rays), expected, "blocks");
  expect_same_bits(hits_by(SplatLoop<SplatScan<true, false>>{packed}, set, rays), expected, "spheres");
  expect_same_bits(hits_by(SplatLoop<SplatScan<false, true>>{packed}, set, rays), expected, "early outs");
  expect_same_bits(hits_by(SplatLoop<SplatScan<true, true>>{packed}, set, rays), expected, "spheres and early outs");
  expect_same_bits(hits_by(SplatGridWalk<SplatScan<false, false>>{grid, packed}, set, rays), expected, "grid");
  expect_same_bits(hits_by(SplatGridWalk<SplatScan<true, false>>{grid, packed}, set, rays), expected,
                   "grid and spheres");
  expect_same_bits(hits_by(SplatGridWalk<SplatScan<false, true>>{grid, packed}, set, rays), expected,
                   "grid and early outs");
  expect_same_bits(hits_by(SplatGridWalk<SplatScan<true, true>>{grid, packed}, set, rays), expected, "all three");
}

TEST(SplatSearches, FindTheSameBitsOnASphere) { expect_all_searches_alike(splat_sphere(), true, 2000); }
TEST(SplatSearches, FindTheSameBitsInRandomClouds) {
  expect_all_searches_alike(random_splats(5000, 7), false, 1000);
  expect_all_searches_alike(random_splats(5000, 8), true, 300);
}
TEST(SplatSearches, FindTheSameBitsFarFromTheOrigin) {
  std::vector<Splat> splats = splat_sphere();
  for (Splat& s : splats) s.center += Vec3{300, -200, 100};
  expect_all_searches_alike(splats, true, 500);
}
TEST(SplatSearches, FindTheSameBitsOnAScan) {
  const std::vector<Splat> splats = scanned_cloud("bunny_35947.ply", 0.0012f);
  EMBRUN_SKIP_WITHOUT(splats, "bunny_35947.ply");
  expect_all_searches_alike(splats, false, 200);
}

// ---- which hit ---------------------------------------------------------------------------------------------------

/// What a ray straight down at (x, 0, z) meets of an open cloud.
SurfaceHit from_above(const std::vector<Splat>& splats, Vec3 at, Vec3 direction = {0, -1, 0}) {
  const SplatTree tree = build_splat_tree(splats);
  Ray ray;
  ray.direction = normalize(direction);
  ray.origin = at - 3.0f * ray.direction;
  SurfaceHit hit;
  EXPECT_TRUE(intersect_splats(set_of(tree, false), tree.view(), ray, false, {}, hit));
  return hit;
}

TEST(SplatGroups, ARidgeIsCutWhereItsSidesMeet) {
  // Two planes that slope down at 45 degrees from the line x = 0, y = 0; each disc reaches 0.5 over it. A ray down at
  // x = 0.1 meets the left one at y = 0.1 first, 0.2 above the right one, which is the roof.
  const std::vector<Splat> roof{disc({-0.5f, -0.5f, 0}, {-1, 1, 0}, 1.2f), disc({0.5f, -0.5f, 0}, {1, 1, 0}, 1.2f)};
  EXPECT_NEAR(from_above(roof, {0.1f, 0, 0}).position.y, -0.1f, 1e-6f);
  EXPECT_NEAR(from_above(roof, {-0.3f, 0, 0.2f}).position.y, -0.3f, 1e-6f);
}

TEST(SplatGroups, AValleyEndsWhereItsSidesMeet) {
  // The same turned over: the planes rise from the line; the first met is the surface.
  const std::vector<Splat> valley{disc({-0.5f, 0.5f, 0}, {1, 1, 0}, 1.2f), disc({0.5f, 0.5f, 0}, {-1, 1, 0}, 1.2f)};
  EXPECT_NEAR(from_above(valley, {0.1f, 0, 0}).position.y, 0.1f, 1e-6f);
  EXPECT_NEAR(from_above(valley, {-0.3f, 0, 0.2f}).position.y, 0.3f, 1e-6f);
}

TEST(SplatGroups, SeenFromBehindARidgeIsAValley) {
  const std::vector<Splat> roof{disc({-0.5f, -0.5f, 0}, {-1, 1, 0}, 1.2f), disc({0.5f, -0.5f, 0}, {1, 1, 0}, 1.2f)};
  const SurfaceHit hit = from_above(roof, {0.1f, 0, 0}, {0, 1, 0});
  EXPECT_NEAR(hit.position.y, -0.1f, 1e-6f);
  EXPECT_FALSE(hit.entering);
}

TEST(SplatGroups, ARidgeOfThreeIsFolded) {
  // Tangents of the parabola y = -x^2 / 2 at x = -0.2, 0 and 0.2 all reach over x = 0.15. The lowest of them there is that
  // at 0.2: -0.02 + -0.2 * (0.15 - 0.2) = -0.01. They are met in the order 0 (y = 0), 0.2, and that at -0.2 first
  // (-0.02 + 0.2 * 0.35 = 0.05).
  std::vector<Splat> tangents;
  for (const float x : {0.2f, -0.2f, 0.0f}) tangents.push_back(disc({x, -0.5f * x * x, 0}, {x, 1, 0}, 0.6f));
  EXPECT_NEAR(from_above(tangents, {0.15f, 0, 0}).position.y, -0.01f, 1e-6f);
}

TEST(SplatGroups, NormalAndColourAreWeighedByTheDistanceFromTheCentres) {
  // Level discs of radius 1 at x = 0 and 1, one tilted for its normal alone: at x = 0.25 the weights are 0.75 and 0.25.
  std::vector<Splat> splats{disc({0, 0, 0}, {0, 1, 0}, 1), disc({1, 0, 0}, {0, 1, 0}, 1)};
  const SplatTree tree = build_splat_tree(splats);
  std::vector<Rgb> colors(tree.order.size());
  for (std::size_t i = 0; i < colors.size(); ++i) colors[i] = tree.order[i] == 0 ? Rgb{1, 0, 0} : Rgb{0, 0, 1};
  SplatSet set = set_of(tree, false);
  set.colors = colors.data();
  Ray ray;
  ray.origin = {0.25f, 2, 0};
  ray.direction = {0, -1, 0};
  SurfaceHit hit;
  ASSERT_TRUE(intersect_splats(set, tree.view(), ray, false, {}, hit));
  EXPECT_NEAR(hit.color.r, 0.75f, 1e-6f);
  EXPECT_NEAR(hit.color.b, 0.25f, 1e-6f);

  // At (0, 0, 0): half of the first plane's normal at its centre (weight 1), and that of a disc tilted by 0.1 with its
  // centre 0.5 away along the tilt's axis (weight 1 - 0.5 / 1).
  const std::vector<Splat> tilted{disc({0, 0, 0}, {0, 1, 0}, 1),
                                  disc({0, 0, 0.5f}, {std::sin(0.1f), std::cos(0.1f), 0}, 1)};
  const Vec3 expected = normalize(Vec3{0, 1, 0} + 0.5f * Vec3{std::sin(0.1f), std::cos(0.1f), 0});
  EXPECT_LT(length(from_above(tilted, {0, 0, 0}).shading_normal - expected), 1e-6f);
}

TEST(SplatGroups, NormalsBendWhereTheyAreFields) {
  // One disc that stands for a piece of a sphere of radius 2: its normal turns by 1/2 per metre.
  const std::vector<Splat> one{disc({0, 0, 0}, {0.2f, 1, -0.3f}, 1)};
  const SplatTree tree = build_splat_tree(one);
  const std::vector<SplatBend> bends(tree.order.size(), {0.5f, 0, 0.5f});
  SplatSet set = set_of(tree, false);
  set.bends = bends.data();
  const Frame frame(one[0].normal);
  const Vec3 at = 0.4f * frame.s - 0.3f * frame.t;
  Ray ray;
  ray.origin = at + 2.0f * frame.n;
  ray.direction = -frame.n;
  SurfaceHit hit;
  ASSERT_TRUE(intersect_splats(set, tree.view(), ray, false, {}, hit));
  EXPECT_LT(length(hit.shading_normal - normalize(frame.n + 0.5f * at)), 1e-6f);
}

// ---- the sphere of the thesis ------------------------------------------------------------------------------------

struct Silhouette {
  double overshoot = 0;  ///< area covered outside the unit disc, and
  double missing = 0;    ///< not covered inside
};

/// The picture of a unit sphere by parallel rays along a direction.
Silhouette silhouette(const SplatSet& set, const SplatTree& tree, Vec3 direction, SplatRules rules) {
  const Frame frame(direction);
  Silhouette area;
  // Rings round the silhouette: radius 0.99 to 1.006.
  const int rings = 64, spokes = 1500;
  for (int i = 0; i < rings; ++i) {
    const float radius = 0.99f + 0.016f * (static_cast<float>(i) + 0.5f) / rings;
    for (int k = 0; k < spokes; ++k) {
      const float angle = 2 * pi * (static_cast<float>(k) + 0.37f) / spokes;
      Ray ray;
      ray.origin = radius * (std::cos(angle) * frame.s + std::sin(angle) * frame.t) - 3.0f * frame.n;
      ray.direction = frame.n;
      SurfaceHit hit;
      const bool found = intersect_splats(set, tree.view(), ray, false, {}, hit, rules);
      const double element = static_cast<double>(radius) * 0.016 / rings * 2 * M_PI / spokes;
      if (found && radius > 1) area.overshoot += element;
      if (!found && radius < 1) area.missing += element;
    }
  }
  return area;
}

TEST(SplatSphere, SilhouetteIsCutAtTheSphere) {
  const SplatTree tree = build_splat_tree(splat_sphere());
  const SplatSet set = set_of(tree, true);
  Silhouette with, without;
  for (const Vec3 direction : {Vec3{0.3f, -0.5f, 0.8f}, Vec3{-0.7f, 0.1f, 0.2f}, Vec3{0.1f, 0.9f, 0.4f}}) {
    const Silhouette a = silhouette(set, tree, normalize(direction), SplatRules::resolve);
    const Silhouette b = silhouette(set, tree, normalize(direction), SplatRules::first_hit);
    with.overshoot += a.overshoot;
    with.missing += a.missing;
    without.overshoot += b.overshoot;
  }
  RecordProperty("overshoot_with", std::to_string(with.overshoot));
  RecordProperty("overshoot_without", std::to_string(without.overshoot));
  std::printf("overshoot %.3g without the rules, %.3g with (ratio %.1f); missing %.3g\n", without.overshoot,
              with.overshoot, without.overshoot / with.overshoot, with.missing);
  EXPECT_LT(5 * with.overshoot, without.overshoot);
  EXPECT_LT(with.missing, 0.5 * without.overshoot);
}

TEST(SplatSphere, NormalsAreThoseOfTheSphere) {
  const SplatTree tree = build_splat_tree(splat_sphere());
  const SplatSet set = set_of(tree, true);
  double sum = 0, most = 0, depth = 0;
  int count = 0;
  for (const Ray& ray : rays_at({{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}, 20000, 9)) {
    SurfaceHit hit;
    if (!intersect_splats(set, tree.view(), ray, false, {}, hit)) continue;
    // The analytic sphere's normal is the direction from its middle.
    const double cosine = static_cast<double>(dot(hit.shading_normal, normalize(hit.position)));
    const double error = std::acos(std::min(cosine, 1.0)) * 180 / M_PI;
    sum += error;
    most = std::max(most, error);
    depth = std::max(depth, static_cast<double>(std::abs(length(hit.position) - 1)));
    ++count;
  }
  std::printf("normals: mean error %.3f degrees, largest %.3f; farthest from the sphere %.2g\n", sum / count, most,
              depth);
  ASSERT_GT(count, 10000);
  EXPECT_LT(sum / count, 1);
  EXPECT_LT(depth, 0.055 * 0.055);
}

// ---- what rays that leave meet -----------------------------------------------------------------------------------

TEST(SplatStarts, DirectionsSurvivePacking) {
  std::mt19937 random(10);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (int i = 0; i < 10000; ++i) {
    const Vec3 v = normalize(Vec3{unit(random), unit(random), unit(random) + 1e-4f});
    EXPECT_GT(dot(unpack_direction(pack_direction(v)), v), std::cos(1.1f * pi / 180));
  }
  for (const Vec3 v : {Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, -1}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}})
    EXPECT_GT(dot(unpack_direction(pack_direction(v)), v), 0.9999f);
}

/// A square sheet of overlapping discs in the plane through `corner` of two unit vectors, normal u x v: 20 x 20 discs
/// 0.05 apart of radius 0.06, each tilted a little at random, as estimated normals are.
void add_sheet(std::vector<Splat>& splats, Vec3 corner, Vec3 u, Vec3 v, float tilt, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  const Vec3 n = cross(u, v);
  for (int i = 0; i < 20; ++i)
    for (int k = 0; k < 20; ++k)
      splats.push_back(
          disc(corner + (0.05f * (static_cast<float>(i) + 0.5f)) * u + (0.05f * (static_cast<float>(k) + 0.5f)) * v,
               n + tilt * unit(random) * u + tilt * unit(random) * v, 0.06f));
}

SplatStart start_of(const SurfaceHit& hit, Vec3 direction) {
  return {hit.geometric_normal, hit.splat_radius, dot(direction, hit.geometric_normal) < 0};
}

/// Where a ray that comes to `hit` starts again.
Ray leaving(const SurfaceHit& hit, Vec3 direction) {
  Ray ray;
  ray.origin = hit.position + 1e-5f * hit.geometric_normal;
  ray.direction = direction;
  return ray;
}

Vec3 random_direction(std::mt19937& random) {
  std::uniform_real_distribution<float> unit(-1, 1);
  Vec3 v;
  do v = {unit(random), unit(random), unit(random)};
  while (length(v) > 1 || length(v) < 0.1f);
  return normalize(v);
}

/// The share of rays that leave the points of the sheet z = 0 near its edge x = 0, within `band`, towards `aim` and are
/// stopped.
template <class Aim>
double share_stopped(const std::vector<Splat>& splats, float band, const Aim& aim) {
  const SplatTree tree = build_splat_tree(splats);
  const SplatSet set = set_of(tree, false);
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(0, 1);
  int stopped = 0, all = 0;
  while (all < 4000) {
    Ray down;
    down.origin = {0.01f * band + band * unit(random), 0.3f + 0.4f * unit(random), 0.5f};
    down.direction = {0, 0, -1};
    SurfaceHit hit;
    if (!intersect_splats(set, tree.view(), down, false, {}, hit)) return -1;
    const Vec3 direction = random_direction(random);
    if (dot(direction, hit.geometric_normal) < 0.02f || !aim(direction)) continue;
    ++all;
    SurfaceHit next;
    stopped +=
        intersect_splats(set, tree.view(), leaving(hit, direction), false, start_of(hit, direction), next) ? 1 : 0;
  }
  return static_cast<double>(stopped) / all;
}

TEST(SplatStarts, APlaneShadesNothingOfItself) {
  std::vector<Splat> plane;
  add_sheet(plane, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0.05f, 12);
  EXPECT_LT(share_stopped(plane, 0.6f, [](Vec3) { return true; }), 0.01);
}

TEST(SplatStarts, AConvexEdgeShadesNothingOfItself) {
  // The top, z = 0 with x > 0, and a side that goes down from its edge x = 0 and looks to -x: its discs reach 0.035 over the
  // top, and a ray that leaves the top to the left meets their backs.
  std::vector<Splat> edge;
  add_sheet(edge, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0.05f, 13);
  add_sheet(edge, {0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 0.05f, 14);
  for (Splat& s : edge)
    if (s.normal.z < 0.5f) s.normal = s.normal.x > 0 ? -s.normal : s.normal;
  EXPECT_LT(share_stopped(edge, 0.1f, [](Vec3 d) { return d.x < 0; }), 0.01);
}

TEST(SplatStarts, AConcaveCornerLetsNothingThrough) {
  // The floor, z = 0 with x > 0, and a wall x = 0 that looks to +x. All rays to the wall are stopped by it, from however
  // near to the corner.
  std::vector<Splat> corner;
  add_sheet(corner, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0.05f, 15);
  add_sheet(corner, {0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.05f, 16);
  EXPECT_GT(share_stopped(corner, 0.2f, [](Vec3 d) { return d.x < -0.3f && std::abs(d.y) < 0.3f; }), 0.99);
  // And none that goes the other way, over the floor (but those as flat as the discs are tilted).
  EXPECT_LT(share_stopped(corner, 0.2f, [](Vec3 d) { return d.x > 0.1f && d.z > 0.07f; }), 0.01);
}

TEST(SplatStarts, ASphereShadesNothingOfItselfAndLetsNothingThrough) {
  const SplatTree tree = build_splat_tree(splat_sphere());
  for (const bool closed : {true, false}) {
    const SplatSet set = set_of(tree, closed);
    std::mt19937 random(17);
    int stopped = 0, lost = 0, all = 0;
    for (const Ray& ray : rays_at({{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}, 4000, 18)) {
      SurfaceHit hit, next;
      if (!intersect_splats(set, tree.view(), ray, false, {}, hit)) continue;
      Vec3 direction = random_direction(random);
      if (dot(direction, hit.geometric_normal) < 0) direction = -direction;
      ++all;
      stopped +=
          intersect_splats(set, tree.view(), leaving(hit, direction), false, start_of(hit, direction), next) ? 1 : 0;
      // From the same point through the body: the other side is met, at the length of the chord.
      Ray through = leaving(hit, -direction);
      through.origin = hit.position - 1e-5f * hit.geometric_normal;
      if (dot(direction, hit.geometric_normal) < 0.1f) continue;
      const bool out = intersect_splats(set, tree.view(), through, true, start_of(hit, -direction), next);
      lost += out && std::abs(next.t - 2 * dot(hit.position, direction)) < 0.05f && (!closed || !next.entering) ? 0 : 1;
    }
    EXPECT_GT(all, 2000);
    EXPECT_LE(stopped, all / 200) << (closed ? "closed" : "open");
    EXPECT_LE(lost, all / 200) << (closed ? "closed" : "open");
  }
}

// ---- odd clouds and rays -----------------------------------------------------------------------------------------

TEST(Splats, EmptyCloudsAreNeverMet) {
  const SplatTree none = build_splat_tree({});
  Ray ray;
  SurfaceHit hit;
  EXPECT_FALSE(intersect_splats(set_of(none, true), none.view(), ray, false, {}, hit));
  // What is no splat is left out.
  const SplatTree nonsense =
      build_splat_tree({disc({0, 0, 0}, {0, 0, 1}, 0), disc({0, 0, 0}, {0, 0, 1}, -1), disc({NAN, 0, 0}, {0, 0, 1}, 1),
                        Splat{{0, 0, 0}, 1, {0, 0, 0}, {}}, disc({0, 0, 0}, {0, 0, 1}, infinity)});
  EXPECT_TRUE(nonsense.blocks.empty());
}

TEST(Splats, OneSplat) {
  const SplatTree tree = build_splat_tree({ellipse({1, 2, 3}, {0, 0, 1}, 2, 1, 0)});
  const SplatSet set = set_of(tree, false);
  const Frame frame(Vec3{0, 0, 1});
  for (const float share : {0.99f, 1.01f})
    for (const Vec3 outline : {1.0f * frame.s, -1.0f * frame.s, 2.0f * frame.t, -2.0f * frame.t}) {
      Ray ray;
      ray.origin = Vec3{1, 2, 5} + share * outline;
      ray.direction = {0, 0, -1};
      SurfaceHit hit;
      EXPECT_EQ(intersect_splats(set, tree.view(), ray, false, {}, hit), share < 1);
      if (share < 1) {
        EXPECT_FLOAT_EQ(hit.t, 2);
      }
      // The extent of the ray counts.
      ray.t_max = 1.9f;
      EXPECT_FALSE(intersect_splats(set, tree.view(), ray, false, {}, hit));
      ray.t_max = infinity;
      ray.t_min = 2.1f;
      EXPECT_FALSE(intersect_splats(set, tree.view(), ray, false, {}, hit));
    }
}

TEST(Splats, RaysInTheirPlaneMeetNothing) {
  const SplatTree tree = build_splat_tree({disc({0, 0, 0}, {0, 0, 1}, 1), disc({0.5f, 0, 0}, {0, 0, 1}, 1)});
  for (const Vec3 direction : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0.6f, 0.8f, 0}}) {
    Ray ray;
    ray.origin = -3.0f * direction;
    ray.direction = direction;
    SurfaceHit hit;
    EXPECT_FALSE(intersect_splats(set_of(tree, false), tree.view(), ray, false, {}, hit));
  }
}

TEST(Splats, DuplicatesAreOne) {
  // More of them than a group holds.
  for (const std::size_t copies : {std::size_t{1}, std::size_t{2}, std::size_t{100}}) {
    std::vector<Splat> splats(copies, disc({0, 0, 0}, {0, 0.3f, 1}, 1));
    splats.insert(splats.end(), copies, disc({0, 0, -4}, {0, 0, -1}, 1));
    const SplatTree tree = build_splat_tree(splats);
    for (const bool closed : {false, true}) {
      Ray ray;
      ray.origin = {0.1f, 0.2f, 5};
      ray.direction = {0, 0, -1};
      SurfaceHit hit;
      ASSERT_TRUE(intersect_splats(set_of(tree, closed), tree.view(), ray, false, {}, hit)) << copies;
      EXPECT_NEAR(hit.position.z, -0.06f, 1e-6f);
      EXPECT_LT(length(hit.shading_normal - normalize(Vec3{0, 0.3f, 1})), 1e-6f);
    }
  }
}

TEST(Splats, FrontsWithNothingBehindAreNoneOfAClosedCloud) {
  const SplatTree tree = build_splat_tree({disc({0, 0, 0}, {0, 0, 1}, 1)});
  Ray ray;
  ray.direction = normalize(Vec3{1, 0, -0.3f});
  ray.origin = -5.0f * ray.direction;
  SurfaceHit hit;
  EXPECT_FALSE(intersect_splats(set_of(tree, true), tree.view(), ray, false, {}, hit));
  EXPECT_TRUE(intersect_splats(set_of(tree, false), tree.view(), ray, false, {}, hit));
  // Unless they are met steeply: the ray got out by a hole.
  ray.direction = normalize(Vec3{1, 0, -0.5f});
  ray.origin = -5.0f * ray.direction;
  EXPECT_TRUE(intersect_splats(set_of(tree, true), tree.view(), ray, false, {}, hit));
}

TEST(Splats, WhatIsBehindMayLieBeyondTheRaysEnd) {
  // The ray ends inside the body; its front is met all the same.
  const SplatTree tree = build_splat_tree({disc({0, 0, 0}, {0, 0, 1}, 1), disc({0, 0, -3}, {0, 0, -1}, 1)});
  Ray ray;
  ray.origin = {0, 0, 5};
  ray.direction = {0, 0, -1};
  ray.t_max = 6;
  SurfaceHit hit;
  EXPECT_TRUE(intersect_splats(set_of(tree, true), tree.view(), ray, false, {}, hit));
  EXPECT_FLOAT_EQ(hit.t, 5);
}

TEST(SplatTrees, AreTheSameBitsForAnyCloudOrder) {
  // Not the order but the splats: every lane has the splat that its number says.
  const std::vector<Splat> splats = random_splats(2000, 19);
  const SplatTree tree = build_splat_tree(splats);
  std::vector<int> seen(splats.size());
  for (std::uint32_t i = 0; i < tree.order.size(); ++i) {
    const Splat lane = tree.blocks[i / splats_per_block].splat(i % splats_per_block);
    if (tree.order[i] == no_splat) {
      EXPECT_TRUE(lane.normal == Vec3{});
      continue;
    }
    EXPECT_TRUE(lane.center == splats[tree.order[i]].center && lane.radius == splats[tree.order[i]].radius);
    ++seen[tree.order[i]];
  }
  for (const int times : seen) EXPECT_EQ(times, 1);
}

}  // namespace
}  // namespace embrun

// Coarse surfaces of particles, against the field summed up here, in double precision and particle by particle.

#include "geometry/surface_levels.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "measure/ray_recorder.h"
#include "support/cubic_lattice.h"

namespace embrun {
namespace {

using measure::Dice;
using testing_support::cubic_lattice;

constexpr float radius = 0.05f, spacing = 0.1f;

SurfaceSettings settings() {
  SurfaceSettings s;
  s.radius = radius;
  s.spacing = static_cast<double>(spacing);
  return s;
}

/// Particles at rest in a ball, a little off their lattice.
std::vector<Vec3> ball_of_water(float size) {
  Dice dice(5);
  std::vector<Vec3> positions;
  const int n = static_cast<int>(size / spacing) + 1;
  for (int k = -n; k <= n; ++k)
    for (int j = -n; j <= n; ++j)
      for (int i = -n; i <= n; ++i) {
        const Vec3 p = spacing * Vec3{static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)};
        if (length(p) < size) positions.push_back(p + 0.2f * spacing * dice.direction());
      }
  return positions;
}

/// The centred quadratic B-spline.
double spline(double x) {
  x = std::abs(x);
  if (x < 0.5) return 0.75 - x * x;
  return x < 1.5 ? 0.5 * (1.5 - x) * (1.5 - x) : 0;
}

/// What a particle at `p` adds along one axis at `x`, both in cells: spread over the cells' centres and back.
double spread(double p, double x) {
  double sum = 0;
  for (double center = std::floor(p) - 2.5; center < p + 3; center += 1) sum += spline(p - center) * spline(x - center);
  return sum;
}

/// D/T - 1 for the automatic threshold, half of the density at rest.
double field(const std::vector<Vec3>& positions, const LatticeSurface& lattice, Vec3 at) {
  const double cell = static_cast<double>(lattice.cell);
  const Vec3d low = to_double(lattice.bricks.low), x = (1 / cell) * (to_double(at) - low);
  double sum = 0;
  for (const Vec3& position : positions) {
    const Vec3d p = (1 / cell) * (to_double(position) - low);
    if (std::abs(p.x - x.x) > 3 || std::abs(p.y - x.y) > 3 || std::abs(p.z - x.z) > 3) continue;
    sum += spread(p.x, x.x) * spread(p.y, x.y) * spread(p.z, x.z);
  }
  return 2 * std::pow(static_cast<double>(spacing) / cell, 3) * sum - 1;
}

Vec3 place_in(const Box3& box, Dice& dice) {
  const Vec3 size = box.high - box.low;
  return box.low +
         size * Vec3{static_cast<float>(dice.next()), static_cast<float>(dice.next()), static_cast<float>(dice.next())};
}

TEST(SurfaceLevels, TheLatticesFieldIsTheSumOverTheParticles) {
  const std::vector<Vec3> positions = ball_of_water(0.8f);
  for (const int level : {1, 2}) {
    std::vector<float> at_particles;
    const auto lattice = build_lattice_surface(positions, static_cast<double>(spacing),
                                               std::ldexp(static_cast<double>(spacing), level), 0.5, at_particles);
    ASSERT_TRUE(lattice);
    ASSERT_EQ(at_particles.size(), positions.size());
    for (std::size_t i = 0; i < positions.size(); i += 37)
      EXPECT_NEAR(static_cast<double>(at_particles[i]) - 1, field(positions, *lattice, positions[i]), 2e-5);
    Dice dice(1);
    int inside = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 at = place_in({{-1.2f, -1.2f, -1.2f}, {1.2f, 1.2f, 1.2f}}, dice);
      const double g = field(positions, *lattice, at);
      if (std::abs(g) < 1e-4) continue;
      EXPECT_EQ(lattice_contains(lattice->view(), at), g > 0) << g;
      inside += g > 0 ? 1 : 0;
    }
    EXPECT_GT(inside, 200);
  }
}

TEST(SurfaceLevels, RaysMeetTheFirstZeroOfTheField) {
  const std::vector<Vec3> positions = ball_of_water(0.6f);
  std::vector<float> none;
  const auto lattice =
      build_lattice_surface(positions, static_cast<double>(spacing), 2 * static_cast<double>(spacing), 0.5, none);
  ASSERT_TRUE(lattice);
  Dice dice(2);
  int hits = 0, from_inside = 0;
  for (int i = 0; i < 900; ++i) {
    Ray ray;
    ray.origin = place_in({{-1, -1, -1}, {1, 1, 1}}, dice);
    // A third along the axes, where many cells' faces are met at once.
    ray.direction = dice.direction();
    if (i % 3 == 0) ray.direction = i % 2 == 0 ? Vec3{0, 0, -1} : Vec3{1, 0, 0};
    const double start = field(positions, *lattice, ray.origin);
    if (std::abs(start) < 1e-3) continue;
    const Side side = start > 0 ? Side::inside : Side::outside;
    // Walk the field itself, a fiftieth of a cell at a time.
    double before = start, expected = -1;
    const double step = static_cast<double>(lattice->cell) / 50;
    double deepest = 0;  // of |g| on the far side, to leave grazes out
    for (double t = step; t < 3.5; t += step) {
      const double g = field(positions, *lattice, ray.at(static_cast<float>(t)));
      if (expected < 0 && (g > 0) != (start > 0)) expected = t - step * g / (g - before);
      if (expected >= 0) {
        if ((g > 0) == (start > 0)) break;
        deepest = std::max(deepest, std::abs(g));
      }
      before = g;
    }
    if (expected >= 0 && deepest < 0.05) continue;
    SurfaceHit hit;
    const bool found = intersect_lattice_surface(lattice->view(), ray, side, hit);
    ASSERT_EQ(found, expected >= 0) << i;
    if (!found) continue;
    ++hits;
    from_inside += side == Side::inside ? 1 : 0;
    EXPECT_NEAR(static_cast<double>(hit.t), expected, 3e-3 * static_cast<double>(lattice->cell)) << i;
    EXPECT_EQ(hit.entering, side == Side::outside);
    EXPECT_NEAR(field(positions, *lattice, hit.position), 0, 1e-4);
    // The normal is minus the field's gradient, here by differences.
    const float h = 1e-2f * lattice->cell;
    const auto difference = [&](Vec3 d) {
      return static_cast<float>(field(positions, *lattice, hit.position - d) -
                                field(positions, *lattice, hit.position + d));
    };
    const Vec3 normal = normalize(Vec3{difference({h, 0, 0}), difference({0, h, 0}), difference({0, 0, h})});
    EXPECT_GT(dot(normal, hit.geometric_normal), 0.9999f);
    // The ray goes on from there without meeting the same place again.
    Ray on = ray;
    on.origin = hit.position;
    SurfaceHit next;
    if (intersect_lattice_surface(lattice->view(), on, side == Side::inside ? Side::outside : Side::inside, next)) {
      EXPECT_GT(next.t, 1e-3f * lattice->cell);
    }
  }
  EXPECT_GT(hits, 150);
  EXPECT_GT(from_inside, 40);
}

TEST(SurfaceLevels, AFlatSurfaceIsHalfASpacingOutsideTheOuterLayer) {
  constexpr int n = 32;
  const std::vector<Vec3> positions = cubic_lattice(n, n, n, spacing);
  for (const int level : {1, 2}) {
    const auto coarse = build_coarse_surface(positions, settings(), level);
    ASSERT_TRUE(coarse);
    for (int i = 0; i < 256; ++i) {
      Ray ray;
      ray.origin =
          spacing * Vec3{14.0f + static_cast<float>(i % 16) / 4.0f, 60.0f, 14.0f + static_cast<float>(i / 16) / 4.0f};
      ray.direction = {0, -1, 0};
      SurfaceHit hit;
      ASSERT_TRUE(intersect_coarse_surface(coarse->view(), ray, Side::outside, hit));
      EXPECT_NEAR(hit.position.y / spacing, static_cast<float>(n) - 0.5f, 0.05f * static_cast<float>(level)) << level;
    }
  }
}

TEST(SurfaceLevels, ACubeKeepsTheVolumeOfItsParticles) {
  // But for what is rounded off its edges: twelve times 64 s by 0.9 of the blur's variance, 2 s^2, are 0.5 %.
  constexpr int n = 64, rays = 170;
  const auto coarse = build_coarse_surface(cubic_lattice(n, n, n, spacing), settings(), 1);
  ASSERT_TRUE(coarse);
  const CoarseSurfaceView view = coarse->view();
  const double s = static_cast<double>(spacing), step = (n + 4) * s / rays;
  double volume = 0;
  for (int i = 0; i < rays * rays; ++i) {
    Ray ray;
    ray.origin = {static_cast<float>((i % rays + 0.5) * step - 2.5 * s), 10,
                  static_cast<float>((i / rays + 0.5) * step - 2.5 * s)};
    ray.direction = {0, -1, 0};
    SurfaceHit in, out;
    while (intersect_coarse_surface(view, ray, Side::outside, in)) {
      ray.t_min = in.t;
      ASSERT_TRUE(intersect_coarse_surface(view, ray, Side::inside, out));
      ray.t_min = out.t;
      volume += static_cast<double>(out.t - in.t) * step * step;
    }
  }
  EXPECT_NEAR(volume / std::pow(n * s, 3), 1, 0.01);
}

/// A ball of water, and drops: some far from it, some half in it.
std::vector<Vec3> splash() {
  std::vector<Vec3> positions = ball_of_water(0.7f);
  Dice dice(3);
  for (int i = 0; i < 400; ++i) positions.push_back((0.7f + 0.8f * static_cast<float>(dice.next())) * dice.direction());
  return positions;
}

TEST(SurfaceLevels, RaysGoThroughWaterAndSprayAsTheirUnion) {
  const std::vector<Vec3> positions = splash();
  const auto coarse = build_coarse_surface(positions, settings(), 1);
  ASSERT_TRUE(coarse && coarse->spray);
  const CoarseSurfaceView view = coarse->view();
  const auto contains = [&](Vec3 p) {
    return lattice_contains(view.bulk, p) || implicit_surface_contains(view.spray, p);
  };
  Dice dice(4);
  int crossings = 0, drops = 0;
  for (int i = 0; i < 3000; ++i) {
    Ray ray;
    ray.origin = 3.0f * dice.direction();
    ray.direction = normalize(1.2f * static_cast<float>(dice.next()) * dice.direction() - ray.origin);
    // Where the union's side changes along the ray, by looking at it all the way.
    std::vector<float> expected;
    bool inside = false;
    constexpr float step = 1e-3f;
    for (float t = 0; t < 6; t += step) {
      if (contains(ray.at(t)) == inside) continue;
      inside = !inside;
      expected.push_back(t - 0.5f * step);
    }
    std::vector<float> met;
    Side side = Side::outside;
    SurfaceHit hit;
    while (met.size() < 100 && intersect_coarse_surface(view, ray, side, hit)) {
      EXPECT_EQ(hit.entering, side == Side::outside);
      met.push_back(hit.t);
      drops += implicit_surface_contains(view.spray, ray.at(hit.t + 1e-3f)) && hit.entering ? 1 : 0;
      ray.t_min = hit.t;
      side = side == Side::outside ? Side::inside : Side::outside;
    }
    EXPECT_EQ(side, Side::outside);
    // Crossings closer than some steps are grazes, and one side may have passed them over.
    const auto grazes = [](const std::vector<float>& all) {
      for (std::size_t k = 1; k < all.size(); ++k)
        if (all[k] - all[k - 1] < 10 * step) return true;
      return false;
    };
    if (grazes(expected) || grazes(met)) continue;
    ASSERT_EQ(expected.size(), met.size()) << i;
    for (std::size_t k = 0; k < met.size(); ++k) EXPECT_NEAR(expected[k], met[k], 1.5f * step);
    crossings += static_cast<int>(met.size());
  }
  EXPECT_GT(crossings, 4000);
  EXPECT_GT(drops, 500);
}

TEST(SurfaceLevels, ALoneDropStaysABallOfItsRadius) {
  std::vector<Vec3> positions = ball_of_water(0.7f);
  const Vec3 drop{2.0f, 0.3f, -0.1f};
  positions.push_back(drop);
  const auto coarse = build_coarse_surface(positions, settings(), 2);
  ASSERT_TRUE(coarse);
  Dice dice(6);
  for (int i = 0; i < 100; ++i) {
    Ray ray;
    ray.direction = dice.direction();
    ray.origin = drop - ray.direction;
    SurfaceHit hit;
    ASSERT_TRUE(intersect_coarse_surface(coarse->view(), ray, Side::outside, hit));
    EXPECT_NEAR(hit.t, 1 - radius, 1e-3f * radius);
  }
}

TEST(SurfaceLevels, TheyAreTheSameForAnyNumberOfThreads) {
  const std::vector<Vec3> positions = splash();
  std::vector<LatticeBrick> first;
  for (const int threads : {1, 2, 7}) {
    tbb::task_arena arena(threads);
    std::optional<CoarseSurface> coarse;
    arena.execute([&] { coarse = build_coarse_surface(positions, settings(), 1); });
    ASSERT_TRUE(coarse);
    if (first.empty()) first = coarse->bulk.near;
    ASSERT_EQ(coarse->bulk.near.size(), first.size());
    for (std::size_t i = 0; i < first.size(); ++i)
      ASSERT_EQ(std::memcmp(coarse->bulk.near[i].values, first[i].values, sizeof first[i].values), 0);
  }
}

TEST(SurfaceLevels, AreLeftOutWhereTheyAreNoUse) {
  // Nothing is left of a few drops, and a lattice over strays would be all air.
  EXPECT_FALSE(build_coarse_surface(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}}, settings(), 1));
  std::vector<Vec3> strays = ball_of_water(0.5f);
  strays.push_back({1e6f, 1e6f, 1e6f});
  EXPECT_FALSE(build_coarse_surface(strays, settings(), 1));
}

TEST(SurfaceLevels, AFootprintGetsTheCoarsestLevelWithCellsNoLarger) {
  EXPECT_EQ(surface_level_for(0.0f, 0.1f, 5), 0);
  EXPECT_EQ(surface_level_for(0.199f, 0.1f, 5), 0);
  EXPECT_EQ(surface_level_for(0.201f, 0.1f, 5), 1);
  EXPECT_EQ(surface_level_for(0.801f, 0.1f, 5), 3);
  EXPECT_EQ(surface_level_for(100.0f, 0.1f, 2), 2);
}

}  // namespace
}  // namespace embrun

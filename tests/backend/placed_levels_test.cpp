// Levels of detail of fluids under placements, through the compiled scene: a path has one, whatever way it goes.

#include <gtest/gtest.h>

#include <cmath>

#include "backend/cpu/cpu_backend.h"
#include "geometry/implicit_surface_trace.h"
#include "measure/ray_recorder.h"
#include "render/transport.h"
#include "scene/compile.h"

namespace embrun {
namespace {

using measure::Dice;
using testing_support::Measured;
using testing_support::render_and_measure;
using testing_support::scene_seen;

constexpr double spacing = 0.1;
constexpr double stretch = 4;  // along z

/// A ball of water of radius 1 round a point, its particles a little off their lattice.
void add_ball_of_water(Vec3d center, FluidDescription& fluid) {
  Dice dice(5);
  constexpr int n = 10;
  for (int k = -n; k <= n; ++k)
    for (int j = -n; j <= n; ++j)
      for (int i = -n; i <= n; ++i) {
        const Vec3d p = spacing * Vec3d{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
        if (length(p) < 1) fluid.positions.push_back(center + p + 0.2 * spacing * to_double(dice.direction()));
      }
}

FluidDescription water() {
  FluidDescription fluid;
  fluid.surface.radius = static_cast<float>(0.5 * spacing);
  fluid.surface.spacing = spacing;
  fluid.detail = 1;
  return fluid;
}

/// A stretched ball that the camera is near, and two far away: there are levels from the particles' own to that of cells of
/// eight spacings.
SceneDescription stretched_scene() {
  SceneDescription scene = scene_seen({0, 0, 12}, {0, 0, 0}, 30, 24, 32);
  FluidDescription fluid = water();
  add_ball_of_water({0, 0, 0}, fluid);
  add_ball_of_water({300, 0, 0}, fluid);
  add_ball_of_water({-300, 0, 0}, fluid);
  fluid.placement.z_axis = {0, 0, stretch};
  scene.fluids.push_back(fluid);
  return scene;
}

/// The first crossing in the fluid's own space, by the surface of a level; `from` and `along` are in the world.
bool cross_level(const FlatScene& flat, int level, Vec3d from, Vec3 along, Side side, double& t) {
  const Vec3d center = flat.recentring + to_double(flat.instances[0].to_world.origin);
  const Vec3d own_from{from.x - center.x, from.y - center.y, (from.z - center.z) / stretch};
  const Vec3 own_along{along.x, along.y, along.z / static_cast<float>(stretch)};
  Ray own;
  own.origin = to_float(own_from);
  own.direction = normalize(own_along);
  SurfaceHit hit;
  const FluidGeometry& fluid = flat.fluids[0];
  const bool found = level == 0
                         ? intersect_implicit_surface(fluid.surface, own, side, hit)
                         : intersect_coarse_surface(flat.coarse_surfaces[fluid.levels.index(level)], own, side, hit);
  t = static_cast<double>(hit.t) / static_cast<double>(length(own_along));
  return found;
}

/// A footprint in the world and the level of it: the coarsest whose cells, 0.1 m times 2^level, are nowhere larger in the
/// world, where they are four times as long.
struct LevelOfFootprint {
  float footprint;
  int level;
};
constexpr LevelOfFootprint levels[] = {{0.7f, 0}, {0.9f, 1}, {1.5f, 1}, {1.7f, 2}, {3.1f, 2}};

TEST(PlacedLevels, ThatOfAPathDoesNotDependOnItsDirection) {
  const FlatScene flat = compile(stretched_scene());
  ASSERT_EQ(flat.fluids[0].levels.finest, 0);
  ASSERT_GE(flat.fluids[0].levels.coarsest, 2);
  const CpuBackend backend(flat);
  Dice dice(1);
  for (const LevelOfFootprint& expected : levels) {
    int hits = 0, differ = 0;
    for (int i = 0; i < 300; ++i) {
      const Vec3d from = 8 * to_double(dice.direction());
      Vec3d at = to_double(dice.direction());
      at.z *= stretch;
      // A third along the axes, where the placement does most and least.
      Ray ray;
      ray.direction = i % 6 == 0 ? Vec3{1, 0, 0} : i % 6 == 3 ? Vec3{0, 0, -1} : normalize(to_float(at - from));
      const Vec3d start = i % 3 == 0 ? at - 8 * to_double(ray.direction) : from;
      ray.origin = to_float(start - flat.recentring);
      ray.detail = expected.footprint;
      const MediaState outside;
      bool found;
      SceneHit hit;
      backend.kernels().intersect(backend.view(), &ray, &outside, 1, &found, &hit);
      double t;
      const bool met = cross_level(flat, expected.level, start, ray.direction, Side::outside, t);
      const double cosine = std::abs(static_cast<double>(dot(hit.surface.geometric_normal, ray.direction)));
      differ += found != met || (met && std::abs(static_cast<double>(hit.surface.t) - t) * cosine > 1e-4);
      hits += met;
    }
    EXPECT_LE(differ, 3) << expected.footprint;  // those that graze
    EXPECT_GT(hits, 100);
  }
}

TEST(PlacedLevels, InsideIsWhereThePathsOwnSurfaceSays) {
  const FlatScene flat = compile(stretched_scene());
  const CpuBackend backend(flat);
  Dice dice(2);
  for (const LevelOfFootprint& expected : levels) {
    int compared = 0;
    for (int i = 0; i < 300; ++i) {
      Ray ray;
      const Vec3d from = 8 * to_double(dice.direction());
      ray.origin = to_float(from - flat.recentring);
      ray.direction = normalize(to_float(0.6 * to_double(dice.direction()) - from));
      ray.detail = expected.footprint;
      MediaState media;
      bool found;
      SceneHit in, out;
      backend.kernels().intersect(backend.view(), &ray, &media, 1, &found, &in);
      if (!found) continue;
      media.inside_solids = solid_bit(in.solid);
      ray.t_min = in.surface.t;
      backend.kernels().intersect(backend.view(), &ray, &media, 1, &found, &out);
      ASSERT_TRUE(found) << i;
      constexpr float step = 0.01f;
      if (out.surface.t - in.surface.t < 3 * step) continue;
      ++compared;
      const auto inside = [&](float t) {
        return backend.kernels().media_at(backend.view(), ray.at(t), ray.detail).inside_fluid(0);
      };
      EXPECT_FALSE(inside(in.surface.t - step)) << expected.footprint << " m, ray " << i;
      EXPECT_TRUE(inside(in.surface.t + step)) << expected.footprint << " m, ray " << i;
      EXPECT_TRUE(inside(out.surface.t - step)) << expected.footprint << " m, ray " << i;
    }
    EXPECT_GT(compared, 100);
  }
}

TEST(PlacedLevels, PathsThroughStretchedWaterContradictNothing) {
  // Clear water in a white room is white.
  SceneDescription scene = stretched_scene();
  for (const double footprint : {8.0, 16.0, 32.0}) {
    scene.fluids[0].detail = footprint;
    const Measured m = render_and_measure(scene);
    EXPECT_EQ(m.counters.contradictions, 0u) << footprint;
    EXPECT_EQ(m.bad, 0u);
    EXPECT_NEAR(m.mean, 1, 1e-3);
  }
}

/// All of a scene `size` times as large, its water by its placement.
SceneDescription scaled_scene(double size) {
  SceneDescription scene = scene_seen({0, 0, size * 40}, {0, 0, 0}, 4, 24, 16);
  scene.environment.kind = EnvironmentDescription::Kind::sky;
  FluidDescription fluid = water();
  add_ball_of_water({0, 0, 0}, fluid);
  fluid.detail = 2;
  fluid.placement.x_axis = {0, 0, -size};
  fluid.placement.y_axis = {0, size, 0};
  fluid.placement.z_axis = {size, 0, 0};
  scene.fluids.push_back(fluid);
  return scene;
}

TEST(PlacedLevels, OfAScaledSceneAreTheSame) {
  const FlatScene flat = compile(scaled_scene(1)), large = compile(scaled_scene(10));
  const FluidLevels& own = flat.fluids[0].levels;
  const FluidLevels& placed = large.fluids[0].levels;
  EXPECT_EQ(placed.finest, own.finest);
  EXPECT_EQ(placed.coarsest, own.coarsest);
  ASSERT_GE(own.coarsest, 1);
  // Lengths of eight times are the same numbers but for the exponent: so are the pictures.
  const FlatScene one = compile(scaled_scene(1)), eight = compile(scaled_scene(8));
  const auto picture = [](const FlatScene& scene) {
    const CpuBackend backend(scene);
    Film film = make_film(scene.film);
    render_samples(backend, film, 0, 16);
    return film;
  };
  const Film a = picture(one), b = picture(eight);
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    for (int channel = 0; channel < 3; ++channel)
      ASSERT_EQ(a.pixels[i].radiance[channel], b.pixels[i].radiance[channel]) << i;
}

}  // namespace
}  // namespace embrun

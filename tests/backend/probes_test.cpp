// What embrun bench measures: surfaces, flights and Embree alone must do what they do in a render.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "backend/cpu/embree_mesh.h"
#include "backend/cpu/kernel_table.h"
#include "geometry/implicit_surface.h"
#include "media/grid_medium_build.h"
#include "media/particle_density_build.h"
#include "meshing/isosurface.h"

namespace embrun {
namespace {

constexpr float radius = 0.05f;

std::vector<Vec3> lump() {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> shift(-0.02f, 0.02f);
  std::vector<Vec3> points;
  for (int i = 0; i < 343; ++i)
    points.push_back(
        0.1f * Vec3{static_cast<float>(i % 7 - 3), static_cast<float>(i / 7 % 7 - 3), static_cast<float>(i / 49 - 3)} +
        Vec3{shift(random), shift(random), shift(random)});
  return points;
}

SurfaceSettings settings() {
  SurfaceSettings s;
  s.radius = radius;
  s.spacing = 0.1;
  s.order = 2;
  return s;
}

/// Rays from outside towards the lump and past it; their number is no multiple of sixteen.
std::vector<SidedRay> rays_at_lump(std::size_t count) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform(-0.45f, 0.45f);
  std::vector<SidedRay> rays(count);
  for (SidedRay& r : rays) {
    const Vec3 from = 2.0f * normalize(Vec3{normal(random), normal(random), normal(random)});
    r.ray.origin = from;
    r.ray.direction = normalize(Vec3{uniform(random), uniform(random), uniform(random)} - from);
  }
  return rays;
}

TEST(Probes, EmbreeAnswersTheSameInAllItsWays) {
  const std::vector<Vec3> points = lump();
  const EmbreeMesh mesh(extract_isosurface(points, {}, resolve_surface_model(points, {}, settings()), {}));
  const std::vector<SidedRay> rays = rays_at_lump(217);
  std::array<SurfaceHit, 217> hits[3];
  std::array<bool, 217> found[3];
  for (std::size_t mode = 0; mode < 3; ++mode)
    mesh.intersect(embree_modes[mode], rays.data(), 217, 0.0f, hits[mode].data(), found[mode].data());
  int count = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    SurfaceHit alone;
    ASSERT_EQ(found[0][i], mesh.intersect(rays[i].ray, 0.0f, alone)) << i;
    count += found[0][i];
    for (std::size_t mode = 0; mode < 3; ++mode) {
      ASSERT_EQ(found[mode][i], found[0][i]) << i << ' ' << name_of(embree_modes[mode]);
      if (!found[0][i]) continue;
      EXPECT_NEAR(hits[mode][i].t, alone.t, 1e-4f);
      EXPECT_GT(dot(hits[mode][i].shading_normal, alone.shading_normal), 0.999f);
    }
  }
  EXPECT_GT(count, 100);
  EXPECT_LT(count, 217);
  // One that starts on the surface begins a little later: here behind all of the lump.
  SidedRay late = rays[0];
  late.side = Side::outside;
  for (const EmbreeMode mode : embree_modes) {
    SurfaceHit hit;
    bool any = true;
    mesh.intersect(mode, &late, 1, 10.0f, &hit, &any);
    EXPECT_FALSE(any);
  }
}

TEST(Probes, SurfacesAreFoundWhereTheMeshIs) {
  const std::vector<Vec3> points = lump();
  const ImplicitSurface surface = build_implicit_surface(points, {}, settings());
  IsosurfaceSettings fine;
  fine.cell = 0.2f * radius;
  const EmbreeMesh mesh(extract_isosurface(points, {}, resolve_surface_model(points, {}, settings()), fine));
  const std::vector<SidedRay> rays = rays_at_lump(3001);
  std::vector<SurfaceHit> hits(rays.size());
  const auto found = std::make_unique<bool[]>(rays.size());
  select_kernels().trace_surface(surface.view(), rays.data(), 3001, hits.data(), found.get());
  int differ = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    SurfaceHit facet;
    const bool met = mesh.intersect(rays[i].ray, 0.0f, facet);
    differ += met != found[i] || (met && std::abs(facet.t - hits[i].t) > 0.2f * radius);
  }
  EXPECT_LT(differ, 30);  // those that graze
}

// A ball of extinction 4 from its middle, and a grid that is a box of the same: how far flights go is exponential.
TEST(Probes, FlightsAreExponential) {
  const std::vector<Vec3> middle{{0, 0, 0}};
  DensityParticles ball;
  ball.positions = middle;
  ball.radius = 1;
  ball.extinction = grey(4);
  const ParticleDensity density({&ball, 1}, MediaOverlap::sum);
  GridValues values;
  values.nx = values.ny = values.nz = 4;
  values.values.assign(64, 4.0f);
  values.to_world = {{4, 0, 0}, {0, 4, 0}, {0, 0, 4}, {-2, -2, -2}};
  const GridMediumData grid(values, {}, grey(1), {});
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::vector<FlightQuery> flights(20000);
  for (std::size_t i = 0; i < flights.size(); ++i) {
    flights[i].ray.direction = normalize(Vec3{normal(random), normal(random), normal(random)});
    flights[i].ray.end = 1;
    flights[i].random = {SampleKey{1, 2, static_cast<std::uint32_t>(i), 3}, Dimension::free_flight};
    flights[i].u = flights[i].random.next_pair().x;
  }
  const double through = std::exp(-4.0);
  for (const bool on_grid : {false, true}) {
    std::vector<float> lengths(flights.size());
    if (on_grid)
      select_kernels().fly_grid(grid.view(), flights.data(), 20000, lengths.data());
    else
      select_kernels().fly(density.view(), flights.data(), 20000, lengths.data());
    double passed = 0, half = 0;
    for (const float t : lengths) {
      passed += t == infinity;
      half += t < 0.25f;
    }
    // Four standard errors of a share: P(t < 1/4) = 1 - exp(-1), P(t > 1) = exp(-4).
    EXPECT_NEAR(passed / 20000, through, 4 * std::sqrt(through * (1 - through) / 20000)) << on_grid;
    EXPECT_NEAR(half / 20000, 1 - std::exp(-1.0), 4 * std::sqrt(0.25 / 20000)) << on_grid;
  }
}

}  // namespace
}  // namespace embrun

// Pictures of media on grids: the furnace, and what other media show that are the same.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

PhaseFunction hg(float g) { return {PhaseKind::henyey_greenstein, g}; }

/// Numbers at random over the box [-0.7, 0.7]^3, half of them 0; or all the same.
ValueGridDescription grid_of(int cells, int channels, float greatest, bool constant) {
  ValueGridDescription grid;
  grid.nx = grid.ny = grid.nz = cells;
  grid.channels = channels;
  grid.placement = {{1.4, 0, 0}, {0, 1.4, 0}, {0, 0, 1.4}, {-0.7, -0.7, -0.7}};
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(0, greatest);
  for (int i = 0; i < cells * cells * cells * channels; ++i)
    grid.values.push_back(constant ? greatest : std::max(0.0f, 2 * uniform(random) - greatest));
  return grid;
}

GridMediumDescription grid_medium(ValueGridDescription extinction, Rgb albedo, PhaseFunction phase = {}) {
  GridMediumDescription medium;
  medium.extinction_grid = std::move(extinction);
  medium.albedo = albedo;
  medium.phase = phase;
  return medium;
}

SceneDescription view(int samples) { return scene_seen({1.7, 1.1, 2.6}, {0, 0, 0}, 30, 6, samples); }

/// A ball of the first grid medium; `material` is its surface.
void add_ball(SceneDescription& scene, MaterialDescription material) {
  material.grid_medium = 0;
  scene.balls.push_back(balls({{{0, 0, 0}, 0.6}}, material));
}

MaterialDescription invisible() { return fog_material({}, {}); }

void expect_furnace(const SceneDescription& scene) {
  for (int channel = 0; channel < 3; channel += 2) {
    const Measured m = render_and_measure(scene, LightStrategy::mis, channel);
    EXPECT_NEAR(m.mean, 1, 4 * m.standard_error + 1e-5);
    EXPECT_LT(m.standard_error, 0.02);
    EXPECT_GT(m.counters.collisions, 10000u);
    EXPECT_EQ(m.counters.contradictions, 0u);
    EXPECT_EQ(m.counters.majorants, 0u);
    EXPECT_EQ(m.bad, 0u);
  }
}

// What absorbs nothing is invisible in light that is the same from everywhere.
TEST(GridMediaFurnace, Fog) {
  SceneDescription scene = view(600);
  scene.grid_media.push_back(grid_medium(grid_of(12, 1, 20, false), grey(1), hg(0.7f)));
  add_ball(scene, invisible());
  expect_furnace(scene);
}

TEST(GridMediaFurnace, ColouredMilkInGlass) {
  SceneDescription scene = view(600);
  scene.grid_media.push_back(grid_medium(grid_of(12, 3, 20, false), grey(1), hg(-0.4f)));
  add_ball(scene, dielectric_material(1.5));
  expect_furnace(scene);
}

// Together with scattering that is the same everywhere, and with coloured particles: three flights at once.
TEST(GridMediaFurnace, TogetherWithOtherMedia) {
  SceneDescription scene = view(600);
  scene.grid_media.push_back(grid_medium(grid_of(12, 3, 12, false), grey(1)));
  MaterialDescription material = fog_material({}, {0.5f, 1, 2});
  add_ball(scene, material);
  VolumeDescription cloud;
  cloud.radius = 0.15;
  cloud.medium.extinction = {6, 3, 1};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  for (int i = 0; i < 200; ++i) cloud.positions.push_back({uniform(random), uniform(random), uniform(random)});
  scene.volumes.push_back(cloud);
  expect_furnace(scene);
}

/// The means of two scenes agree in each channel.
void expect_same(const SceneDescription& a, const SceneDescription& b, double precision = 0.01) {
  for (int channel = 0; channel < 3; ++channel) {
    const Measured ours = render_and_measure(a, LightStrategy::mis, channel),
                   other = render_and_measure(b, LightStrategy::mis, channel);
    EXPECT_NEAR(ours.mean, other.mean, 4 * std::hypot(ours.standard_error, other.standard_error)) << channel;
    EXPECT_LT(ours.standard_error, precision * other.mean);
    EXPECT_EQ(ours.counters.majorants, 0u);
  }
}

/// A lamp beside it, so that where light scatters matters.
SceneDescription lit_view(int samples) {
  SceneDescription scene = view(samples);
  scene.environment.constant = grey(0.2f);
  LightDescription lamp;
  lamp.kind = LightDescription::Kind::sphere;
  lamp.position = {1.5, 1, 0};
  lamp.radius = 0.4;
  lamp.radiance = grey(6);
  scene.lights.push_back(lamp);
  return scene;
}

// A grid that is the same everywhere is a homogeneous medium, in fog, in matched glass and in water.
TEST(GridMedia, ThatAreConstantAreHomogeneous) {
  const Rgb albedo{0.9f, 0.7f, 0.5f};
  for (const double ior : {0.0, 1.0, 1.33}) {
    const MaterialDescription surface = ior > 0 ? dielectric_material(ior) : invisible();
    SceneDescription grid = lit_view(1500), same = lit_view(1500);
    grid.grid_media.push_back(grid_medium(grid_of(9, 1, 1.5f, true), albedo, hg(0.5f)));
    grid.grid_media[0].scale = 2;
    add_ball(grid, surface);
    MaterialDescription material = surface;
    material.scattering = grey(3) * albedo;
    material.absorption = grey(3) * (grey(1) - albedo);
    material.phase = hg(0.5f);
    same.balls.push_back(balls({{{0, 0, 0}, 0.6}}, material));
    expect_same(grid, same);
  }
}

// A constant extinction with a grid of albedos; and the clear water's own absorption besides.
TEST(GridMedia, TakeAConstantExtinctionAndAGridOfAlbedos) {
  SceneDescription grid = lit_view(1500), same = lit_view(1500);
  GridMediumDescription medium;
  medium.extinction = {1, 2, 3};
  medium.albedo_grid = grid_of(4, 1, 0.8f, true);
  grid.grid_media.push_back(medium);
  MaterialDescription water = dielectric_material(1.33, {0.3f, 0.2f, 0.1f});
  add_ball(grid, water);
  water.scattering = medium.extinction * 0.8f;
  water.absorption += medium.extinction * 0.2f;
  same.balls.push_back(balls({{{0, 0, 0}, 0.6}}, water));
  expect_same(grid, same);
}

// A tiny lamp within: points drawn by where it is bring what flights bring, and quietly.
TEST(GridMedia, GlowRoundALampHoweverPointsAreDrawn) {
  for (const int channels : {1, 3}) {
    SceneDescription plain = scene_seen({0, 0, 4}, {0, 0, 0}, pencil, 2, 40000);
    plain.environment.kind = EnvironmentDescription::Kind::none;
    plain.integrator.hide_emitters = true;
    plain.integrator.max_depth = 2;
    plain.grid_media.push_back(grid_medium(grid_of(12, channels, 0.6f, false), {0.9f, 0.8f, 0.7f}, hg(0.4f)));
    add_ball(plain, invisible());
    LightDescription lamp;
    lamp.kind = LightDescription::Kind::sphere;
    lamp.position = {0.1, 0.05, -0.1};
    lamp.radius = 0.002;
    lamp.radiance = grey(1e5f);
    plain.lights.push_back(lamp);
    SceneDescription better = plain;
    plain.integrator.equiangular = false;
    better.integrator.equiangular = true;
    for (int channel = 0; channel < 3; channel += 2) {
      const Measured flights = render_and_measure(plain, LightStrategy::mis, channel),
                     points = render_and_measure(better, LightStrategy::mis, channel);
      EXPECT_EQ(points.bad, 0u);
      EXPECT_NEAR(points.mean, flights.mean, 4 * std::hypot(flights.standard_error, points.standard_error));
      EXPECT_LT(points.standard_error, 0.02 * points.mean);
      EXPECT_LT(points.standard_error, 0.5 * flights.standard_error);
    }
  }
}

// What a mesh holds of a grid: a box of glass as a mesh and as a box.
TEST(GridMedia, FillMeshesAsTheyFillBoxes) {
  SceneDescription as_box = lit_view(1000), as_mesh = lit_view(1000);
  MaterialDescription water = dielectric_material(1.33);
  water.grid_medium = 0;
  for (SceneDescription* scene : {&as_box, &as_mesh})
    scene->grid_media.push_back(grid_medium(grid_of(12, 3, 12, false), {0.9f, 0.8f, 0.7f}));
  as_box.boxes.push_back(box({-0.5, -0.4, -0.3}, {0.5, 0.4, 0.3}, water));
  MeshDescription mesh;
  for (int i = 0; i < 8; ++i)
    mesh.mesh.positions.push_back({i & 1 ? 0.5f : -0.5f, i & 2 ? 0.4f : -0.4f, i & 4 ? 0.3f : -0.3f});
  mesh.mesh.triangles = {{{0, 4, 6}}, {{0, 6, 2}}, {{1, 3, 7}}, {{1, 7, 5}}, {{0, 1, 5}}, {{0, 5, 4}},
                         {{2, 6, 7}}, {{2, 7, 3}}, {{0, 2, 3}}, {{0, 3, 1}}, {{4, 5, 7}}, {{4, 7, 6}}};
  mesh.material = water;
  as_mesh.meshes.push_back(mesh);
  expect_same(as_box, as_mesh, 0.02);
}

// Recentring: the same scene far from the origin.
TEST(GridMedia, AreTheSameFarAway) {
  SceneDescription here = lit_view(1000);
  here.grid_media.push_back(grid_medium(grid_of(12, 1, 12, false), grey(0.8f)));
  add_ball(here, invisible());
  SceneDescription there = here;
  const Vec3d offset{1e5, -2e5, 3e5};
  there.camera.eye = there.camera.eye + offset;
  there.camera.target = there.camera.target + offset;
  there.lights[0].position = there.lights[0].position + offset;
  there.balls[0].balls[0].center = offset;
  there.grid_media[0].extinction_grid->placement.origin =
      there.grid_media[0].extinction_grid->placement.origin + offset;
  expect_same(here, there, 0.02);
}

}  // namespace
}  // namespace embrun

// Fluids traced as triangle meshes against the same traced directly.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "image/metrics.h"
#include "render/fluid_meshes.h"
#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

/// White from above, dark from below, so that what is refracted where counts.
SceneDescription lit_view() {
  SceneDescription scene = scene_seen({2.1, 1.3, 3.0}, {0.1, 0.05, 0}, 34, 32, 64);
  EnvironmentDescription& environment = scene.environment;
  environment.kind = EnvironmentDescription::Kind::image;
  environment.image = make_image(64, 32, 3);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x)
      for (int c = 0; c < 3; ++c) environment.image.at(x, y, c) = y < 16 ? 1.0f : 0.1f;
  return scene;
}

/// A disordered body of water and a few drops above it.
FluidDescription water() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> shift(-0.02, 0.02);
  FluidDescription fluid = lattice_fluid({-0.5, -0.3, -0.4}, {0.5, 0.2, 0.5}, 0.1, 2);
  for (Vec3d& p : fluid.positions) p = p + Vec3d{shift(random), shift(random), shift(random)};
  for (int i = 0; i < 8; ++i) fluid.positions.push_back({0.19 * i - 0.6, 0.45 + 3 * shift(random), 4 * shift(random)});
  fluid.material = dielectric_material(1.33, {0.8f, 0.8f, 0.8f});
  return fluid;
}

/// The scene's fluids as meshes with cells of a share of their radii.
SceneDescription meshed(SceneDescription scene, double share) {
  for (FluidDescription& fluid : scene.fluids) {
    fluid.method = SurfaceMethod::mesh;
    fluid.mesh_cell = share * static_cast<double>(fluid.surface.radius);
  }
  return scene;
}

/// Means and most of the 4x4 blocks agree to noise and `tolerance`.
void expect_same_picture(const SceneDescription& a, const SceneDescription& b, double tolerance) {
  const RenderResult ra = render(a), rb = render(b);
  const Measured ma = measure(ra.film), mb = measure(rb.film);
  EXPECT_NEAR(ma.mean, mb.mean, 4 * std::hypot(ma.standard_error, mb.standard_error) + tolerance * ma.mean);
  EXPECT_EQ(rb.counts.paths.contradictions, 0u);
  EXPECT_EQ(mb.bad, 0u);
  const auto blocks = compare_blocks(ra.layers.layer("beauty"), rb.layers.layer("beauty"), ra.layers.find("variance"),
                                     rb.layers.find("variance"), 4);
  EXPECT_GE(share_within(blocks, 0.02 + tolerance, 3), 0.97);
}

// What facets of half a radius change in the mean is below a hundredth; with a quarter it is a quarter of that.
TEST(MeshRepresentation, ShowsWhatTheParticlesShow) {
  for (const NormalMode normal : {NormalMode::weighted, NormalMode::gradient}) {
    SceneDescription scene = lit_view();
    scene.fluids.push_back(water());
    scene.fluids[0].surface.normal = normal;
    expect_same_picture(scene, meshed(scene, 0), 0.01);
    expect_same_picture(scene, meshed(scene, 0.25), 0.004);
  }
}

// A container's flat faces close the mesh as they close the fluid; the fluid that stops short of them wets them.
TEST(MeshRepresentation, IsClippedByAContainer) {
  SceneDescription scene = lit_view();
  scene.fluids.push_back(water());
  scene.fluids[0].container = Box3d{{-0.53, -0.33, -0.3}, {0.53, 0.6, 0.53}};
  expect_same_picture(scene, meshed(scene, 0.25), 0.004);
}

/// What scatters and absorbs in the fluid, four mean free paths through a metre of it, each particle in its own way.
SceneDescription milky(double density_radius) {
  SceneDescription scene = lit_view();
  scene.integrator.samples = 32;
  scene.fluids.push_back(water());
  ParticleMediumDescription milk;
  milk.extinction = {4, 4, 4};
  milk.albedo = {0.9f, 0.9f, 0.9f};
  milk.density_radius = density_radius;
  for (std::size_t i = 0; i < scene.fluids[0].positions.size(); ++i)
    milk.densities.push_back(0.5f + static_cast<float>(i % 11) / 10);
  scene.fluids[0].medium = milk;
  return scene;
}

// A grid of it blurs the balls' edges, over less than their distance: means stay the same to noise.
TEST(MeshRepresentation, HoldsItsMediumOnAGrid) {
  for (const double radius : {0.05, 0.08}) {
    const SceneDescription scene = milky(radius), grids = with_grid_media(meshed(scene, 0.5));
    ASSERT_EQ(grids.grid_media.size(), 1u);
    EXPECT_FALSE(grids.fluids[0].medium.has_value());
    EXPECT_EQ(grids.fluids[0].material.grid_medium, 0);
    EXPECT_EQ(grids.grid_media[0].extinction_grid->channels, 1);
    EXPECT_FALSE(grids.grid_media[0].albedo_grid.has_value());
    expect_same_picture(scene, meshed(scene, 0.5), 0.006);
  }
}

TEST(MeshRepresentation, HoldsColoursOnAGridWhereverItIsPlaced) {
  SceneDescription scene = milky(0.08);
  FluidDescription& fluid = scene.fluids[0];
  fluid.medium->densities.clear();
  for (const Vec3d& p : fluid.positions) {
    const float red = p.x > 0 ? 1.0f : 0.3f;
    fluid.medium->extinctions.push_back({4 * red, 4, 8});
    fluid.medium->albedos.push_back({red, 0.5f, 0.9f});
  }
  for (Vec3d& p : fluid.positions) p = 0.5 * p + Vec3d{3, 4, 5};
  fluid.surface.radius *= 0.5f;
  fluid.surface.spacing *= 0.5;
  fluid.medium->density_radius *= 0.5;
  fluid.placement = {{0, 2, 0}, {-2, 0, 0}, {0, 0, 2}, Vec3d{0.1, 0.0, 0.1} - Vec3d{-8, 6, 10}};
  ASSERT_TRUE(with_grid_media(meshed(scene, 0.5)).grid_media[0].albedo_grid.has_value());
  expect_same_picture(scene, meshed(scene, 0.5), 0.006);
  // Grids do not glow: that stays with the particles.
  fluid.medium->emission.assign(fluid.positions.size(), Rgb{1, 1, 1});
  EXPECT_TRUE(with_grid_media(meshed(scene, 0.5)).grid_media.empty());
  expect_same_picture(scene, meshed(scene, 0.5), 0.006);
}

// Turned, moved and made larger, beside a mesh and a ball of glass.
TEST(MeshRepresentation, CanBePlacedAmongOthers) {
  SceneDescription scene = lit_view();
  FluidDescription fluid = water();
  for (Vec3d& p : fluid.positions) p = 0.5 * p + Vec3d{3, 4, 5};
  fluid.surface.radius *= 0.5f;
  fluid.surface.spacing *= 0.5;
  fluid.placement = {{0, 2, 0}, {-2, 0, 0}, {0, 0, 2}, Vec3d{0.1, 0.0, 0.1} - Vec3d{-8, 6, 10}};
  scene.fluids.push_back(fluid);
  scene.balls.push_back(balls({{{0.9, 0.1, 0.2}, 0.25}}, dielectric_material(1.5)));
  MeshDescription slab;
  slab.mesh.positions = {{-2, -0.8f, -2}, {2, -0.8f, -2}, {2, -0.8f, 2}, {-2, -0.8f, 2}};
  slab.mesh.triangles = {{{0, 2, 1}}, {{0, 3, 2}}};
  slab.material = diffuse_material(grey(0.5f));
  scene.meshes.push_back(slab);
  expect_same_picture(scene, meshed(scene, 0.25), 0.004);
}

TEST(MeshRepresentation, IsTheSameForAnyNumberOfThreads) {
  SceneDescription scene = lit_view();
  scene.integrator.samples = 2;
  scene.fluids.push_back(water());
  scene = meshed(scene, 0);
  RenderControl one, three;
  one.threads = 1;
  three.threads = 3;
  const Film a = render(scene, one).film, b = render(scene, three).film;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) ASSERT_EQ(a.pixels[i].radiance[1], b.pixels[i].radiance[1]) << i;
}

// Nothing is left of particles below the threshold.
TEST(MeshRepresentation, MayBeEmpty) {
  SceneDescription scene = lit_view();
  scene.integrator.samples = 1;
  scene.fluids.push_back(water());
  scene.fluids[0].surface.threshold_mode = ThresholdMode::number;
  scene.fluids[0].surface.threshold = 1e6f;
  scene.fluids[0].surface.recover = RecoverMode::off;
  const SceneDescription bare = [&] {
    SceneDescription s = scene;
    s.fluids.clear();
    return s;
  }();
  EXPECT_NEAR(measure(render(meshed(scene, 0)).film).mean, measure(render(bare).film).mean, 1e-6);
}

TEST(MeshRepresentation, CountsWhatItMade) {
  SceneDescription scene = lit_view();
  scene.fluids.push_back(water());
  scene.fluids[0].medium.emplace();
  FluidMeshCounts counts;
  double last = 0;
  const FlatScene flat = compile_meshing(meshed(scene, 0), &counts, [&](double fraction) { last = fraction; });
  ASSERT_EQ(flat.meshes.size(), 1u);
  ASSERT_EQ(flat.grids.size(), 1u);
  EXPECT_EQ(counts.grid_cells, static_cast<std::uint64_t>(flat.grids[0].extinction.nx) *
                                   static_cast<std::uint64_t>(flat.grids[0].extinction.ny) *
                                   static_cast<std::uint64_t>(flat.grids[0].extinction.nz));
  EXPECT_GT(counts.grid_seconds, 0);
  EXPECT_EQ(counts.triangles, flat.mesh_triangles.size());
  EXPECT_EQ(counts.vertices, flat.mesh_positions.size());
  EXPECT_GT(counts.triangles, 10000u);
  EXPECT_GT(counts.seconds, 0);
  EXPECT_GT(counts.threshold, 1.0f);
  EXPECT_LE(last, 1.0);
}

}  // namespace
}  // namespace embrun

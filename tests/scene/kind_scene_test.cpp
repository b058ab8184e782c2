#include "scene/kind_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "scene/compile_media.h"
#include "scene/tank.h"

namespace embrun {
namespace {

/// Extinction at a point of a medium, per metre.
double extinction_at(const ParticleDensityView& view, Vec3 p) {
  const Vec3 at = (p - view.grid.low) * view.grid.cells_per_metre;
  const int x = static_cast<int>(std::floor(at.x)), y = static_cast<int>(std::floor(at.y)),
            z = static_cast<int>(std::floor(at.z));
  if (x < 0 || y < 0 || z < 0 || x >= view.grid.nx || y >= view.grid.ny || z >= view.grid.nz) return 0;
  const std::uint32_t brick = view.brick_index[view.grid.index(x, y, z)];
  if (brick == no_brick) return 0;
  const DensityCell* cell = cell_at(view, view.bricks[brick], p);
  return cell == nullptr ? 0 : static_cast<double>(extinction_in_cell(view, *cell, p, ~0u).g);
}

/// Optical depth along x, at a distance y from the origin.
double depth_along_x(const ParticleDensity& density, float y, float reach) {
  constexpr int steps = 2000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const float x = reach * (2 * (static_cast<float>(i) + 0.5f) / steps - 1);
    sum += extinction_at(density.view(), {x, y, 0});
  }
  return sum * 2 * static_cast<double>(reach) / steps;
}

// A lone foam particle is as thick whatever its radius. The cubic spline of support h = 2 R, integrated along its middle:
// 2 h (8 / (pi h^3)) 0.375 = 6 / (pi h^2), times (2 R)^3 / (2 R).
TEST(KindScene, FoamFadesToItsRim) {
  for (const double radius : {0.001, 0.02}) {
    SceneDescription scene;
    const KindLook look = default_look(ParticleKind::foam, radius);
    EXPECT_EQ(look.color, grey(1));
    add_particles(scene, ParticleKind::foam, {{0, 0, 0}}, look, {});
    const ParticleDensity density = compile_density(scene, {0, 0, 0});
    const auto r = static_cast<float>(radius);
    const double middle = depth_along_x(density, 0, 2 * r);
    EXPECT_NEAR(middle, 6 / 3.14159265358979, 0.005);
    EXPECT_NEAR(depth_along_x(density, 0.7f * r, 2 * r) / middle, 0.5045, 0.002);  // integrated by a program of its own
    EXPECT_EQ(depth_along_x(density, 2.001f * r, 2 * r), 0);
    EXPECT_LT(depth_along_x(density, 1.6f * r, 2 * r), 0.05);

    // Two in one place are twice as thick.
    scene.volumes[0].positions.push_back({0, 0, 0});
    EXPECT_NEAR(depth_along_x(compile_density(scene, {0, 0, 0}), 0, 2 * r), 2 * middle, 0.01);
    scene.volumes[0].medium.densities = {0.5f, 0.25f};
    EXPECT_NEAR(depth_along_x(compile_density(scene, {0, 0, 0}), 0, 2 * r), 0.75 * middle, 0.01);
  }
}

TEST(KindScene, KindsHaveTheirLooks) {
  const Rgb sand = default_look(ParticleKind::sand, 1).color;
  EXPECT_GT(sand.r, sand.g);
  EXPECT_GT(sand.g, sand.b);
  EXPECT_EQ(default_kind_radius(ParticleKind::bubble, 0.02), 0.005);
  EXPECT_EQ(default_kind_radius(ParticleKind::spray, 0.02), 0.005);
  EXPECT_EQ(default_kind_radius(ParticleKind::foam, 0.02), 0.01);
  EXPECT_EQ(default_kind_radius(ParticleKind::sand, 0.02), 0.02);
}

TEST(KindScene, KindsBecomeTheirElements) {
  SceneDescription scene;
  const MaterialDescription water = dielectric_material(1.33, {0.1f, 0.2f, 0.3f});
  const std::vector<Vec3d> two = {{0, 0, 0}, {1, 0, 0}};
  KindLook look;
  look.radius = 0.5;
  look.radii = {0.25f, 0.75f};
  for (const ParticleKind kind :
       {ParticleKind::foam, ParticleKind::bubble, ParticleKind::spray, ParticleKind::sand, ParticleKind::none})
    add_particles(scene, kind, two, look, water, {"f", ""});
  add_particles(scene, ParticleKind::sand, {}, look, water);
  ASSERT_EQ(scene.volumes.size(), 1u);
  EXPECT_EQ(scene.volumes[0].radii, look.radii);
  EXPECT_EQ(scene.volumes[0].file, "f");
  ASSERT_EQ(scene.balls.size(), 3u);
  EXPECT_EQ(scene.balls[0].material.ior, 1);  // air, over the water
  EXPECT_GT(scene.balls[0].material.priority, water.priority);
  EXPECT_EQ(scene.balls[0].balls[1].radius, 0.75);
  EXPECT_EQ(scene.balls[1].material, water);
  EXPECT_EQ(scene.balls[2].material.kind, BsdfKind::diffuse);
}

FluidDescription fluid_of(std::vector<Vec3d> positions, float radius) {
  FluidDescription fluid;
  fluid.positions = std::move(positions);
  fluid.surface.radius = radius;
  fluid.file = "f";
  return fluid;
}

TEST(KindScene, FluidsAreJoined) {
  std::vector<FluidDescription> fluids = {fluid_of({{0, 0, 0}, {1, 0, 0}}, 0.5f), fluid_of({{2, 0, 0}}, 0.5f),
                                          fluid_of({{3, 0, 0}, {4, 0, 0}}, 0.25f)};
  fluids[0].medium.emplace();
  fluids[0].medium->albedos = {grey(0.1f), grey(0.2f)};
  fluids[0].medium->albedo = grey(0.5f);
  fluids[1].medium.emplace();
  fluids[1].medium->extinctions = {grey(7)};
  join_fluids(fluids);
  ASSERT_EQ(fluids[0].positions.size(), 5u);
  EXPECT_EQ(fluids[0].radii, (std::vector<float>{0.5f, 0.5f, 0.5f, 0.25f, 0.25f}));
  EXPECT_EQ(fluids[0].medium->densities, (std::vector<float>{1, 1, 0, 0, 0}));
  EXPECT_EQ(fluids[0].medium->albedos.size(), 5u);
  ASSERT_EQ(fluids[1].positions.size(), 3u);
  EXPECT_EQ(fluids[1].positions[0].x, 2);
  EXPECT_EQ(fluids[1].positions[2].x, 4);
  EXPECT_EQ(fluids[1].medium->extinctions, (std::vector<Rgb>{grey(7), grey(0), grey(0)}));
  EXPECT_TRUE(fluids[1].medium->densities.empty());
  EXPECT_EQ(fluids[2].positions.size(), 2u);
  EXPECT_TRUE(fluids[2].radii.empty());
  EXPECT_EQ(fluids[2].file, "f");
  EXPECT_EQ(fluids[0].file, "");  // no longer what the file holds
}

// Closed, and of the glass's volume: the outer box less the inner.
TEST(Tank, IsAClosedShell) {
  const Box3d inside{{1, 2, 3}, {3, 6, 9}};
  const double w = 0.25;
  for (const UpAxis up : {UpAxis::y, UpAxis::z}) {
    const MeshDescription tank = make_tank(inside, w, up, dielectric_material(1.5));
    double volume = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : tank.mesh.triangles) {
      const Vec3d a = to_double(tank.mesh.positions[t[0]]), b = to_double(tank.mesh.positions[t[1]]),
                  c = to_double(tank.mesh.positions[t[2]]);
      volume += dot(a, cross(b, c)) / 6;
      for (int i = 0; i < 3; ++i) {
        ++edges[{t[static_cast<std::size_t>(i)], t[static_cast<std::size_t>((i + 1) % 3)]}];
      }
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
    }
    const double outer = up == UpAxis::y ? (2 + 2 * w) * (4 + w) * (6 + 2 * w) : (2 + 2 * w) * (4 + 2 * w) * (6 + w);
    EXPECT_NEAR(volume, outer - 2 * 4 * 6, 1e-4);
    EXPECT_EQ(place(tank.placement, to_double(tank.mesh.positions[8])), inside.low);
  }
}

}  // namespace
}  // namespace embrun

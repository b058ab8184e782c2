#include "scene/kind_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "scene/tank.h"

namespace embrun {
namespace {

// Foam three mean free paths thick across its middle whatever the radius.
TEST(KindScene, KindsHaveTheirLooks) {
  for (const double radius : {0.001, 0.02}) {
    const KindLook foam = default_look(ParticleKind::foam, radius);
    EXPECT_NEAR(static_cast<double>(foam.extinction.g) * 2 * radius, 3, 1e-5);
    EXPECT_EQ(foam.color, grey(1));
  }
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

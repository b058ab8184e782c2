#include "scene/compile.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "scene/pack_balls.h"
#include "scene/wall_contact.h"

namespace embrun {
namespace {

FluidDescription drop(Vec3d p, float radius = 0.1f) {
  FluidDescription fluid;
  fluid.positions = {p};
  fluid.surface.radius = radius;
  return fluid;
}

SceneDescription looked_at(Vec3d p) {
  SceneDescription scene;
  scene.camera.eye = p + Vec3d{0, 0, 5};
  scene.camera.target = p;
  return scene;
}

TEST(Compile, RecentresInDoublePrecision) {
  const Vec3d far{1e7, -2e7, 3e7};
  SceneDescription scene = looked_at(far);
  scene.balls.push_back(
      {{{far + Vec3d{0.125, 0, 0}, 0.25}, {far - Vec3d{0.125, 0, 0}, 0.25}}, diffuse_material(grey(0.5f))});
  const FlatScene flat = compile(scene);
  ASSERT_EQ(flat.ball_blocks.size(), 1u);
  EXPECT_EQ(flat.ball_blocks[0].ball(0).center, (Vec3{-0.125f, 0, 0}));
  EXPECT_EQ(flat.ball_blocks[0].ball(1).center, (Vec3{0.125f, 0, 0}));
  EXPECT_EQ(flat.ball_blocks[0].ball(2).radius, 0);  // the block's other lanes stand for none
  EXPECT_EQ(flat.camera.eye, (Vec3{0, 0, 5}));
}

// A stray particle at the other end of the world must not move the origin from where the fluid is.
TEST(Compile, TheOriginIsWhereTheParticlesAre) {
  SceneDescription scene = looked_at({500, 0, 0});
  FluidDescription fluid = drop({500, 0, 0});
  for (int i = 1; i < 20; ++i) fluid.positions.push_back({500 + 0.1 * i, 0, 0});
  fluid.positions.push_back({-100, 0, 0});
  scene.fluids.push_back(fluid);
  const FlatScene flat = compile(scene);
  EXPECT_NEAR(flat.recentring.x, 501, 0.5);
}

// A checkerboard keeps its pattern: the corner it starts from is moved by whole periods only.
TEST(Compile, ACheckerboardFarAwayKeepsItsPattern) {
  const Vec3d far{123456.25, 0, -98765.5};
  SceneDescription scene = looked_at(far);
  scene.balls.push_back({{{far, 1}}, diffuse_material(grey(0.5f))});
  PatchDescription floor;
  floor.center = far - Vec3d{0, 1, 0};
  floor.half_u = floor.half_v = 4;
  floor.material.reflectance.kind = TextureKind::checker;
  floor.material.reflectance.cell = 0.25;
  floor.material.reflectance.first = grey(1);
  floor.material.reflectance.second = grey(0);
  scene.patches.push_back(floor);
  const FlatScene flat = compile(scene);
  const Texture& texture = flat.materials.back().reflectance;
  for (int i = 0; i < 200; ++i) {
    const Vec3d world = floor.center + Vec3d{0.037 * i - 3.5, 0, 0.029 * i - 2.9};
    const auto cell = [](double c) { return static_cast<long>(std::floor(c / 0.25)); };
    const bool light = (cell(world.x) + cell(world.z)) % 2 == 0;
    EXPECT_EQ(evaluate_texture(texture, to_float(world - flat.recentring), {}).r, light ? 1.0f : 0.0f) << i;
  }
}

TEST(Compile, MediaAreClassedByPriority) {
  SceneDescription scene = looked_at({0, 0, 0});
  scene.balls.push_back({{{{0, 0, 0}, 1}}, dielectric_material(1, {}, 5)});
  scene.balls.push_back({{{{0, 1, 0}, 1}}, dielectric_material(1.33, {}, 1)});
  scene.balls.push_back({{{{0, 2, 0}, 1}}, dielectric_material(1.5, {}, 3)});
  scene.balls.push_back({{{{0, 3, 0}, 1}}, dielectric_material(1.33, {}, 1)});
  scene.balls.push_back({{{{0, 4, 0}, 1}}, diffuse_material(grey(0.5f))});
  const FlatScene flat = compile(scene);
  ASSERT_EQ(flat.media.size(), 4u);
  EXPECT_EQ(flat.media[0].ior, 1);
  EXPECT_EQ(flat.media[1].ior, 1.33f);
  EXPECT_EQ(flat.media[2].ior, 1.5f);
  EXPECT_EQ(flat.media[3].ior, 1);
  ASSERT_EQ(flat.instances.size(), 4u);  // the two of water are one set
  const int expected[] = {3, 1, 2, 0};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(flat.instances[i].media_class, expected[i]) << i;
}

// Fluids come first, then the sets of balls with an inside; what is opaque has no number.
TEST(Compile, SolidsAreNumbered) {
  SceneDescription scene = looked_at({0, 0, 0});
  scene.balls.push_back({{{{0, 0, 0}, 1}}, diffuse_material(grey(0.5f))});
  scene.balls.push_back({{{{0, 1, 0}, 1}}, dielectric_material(1.33, {}, 1)});
  scene.balls.push_back({{{{0, 2, 0}, 1}, {{0, 3, 0}, 0}}, dielectric_material(1.5, {}, 3)});
  scene.balls.push_back({{{{0, 2, 0}, 0}}, dielectric_material(1.7, {}, 4)});  // of radius 0: none there
  scene.balls.push_back({{}, dielectric_material(1.8, {}, 5)});
  scene.fluids.push_back(drop({0, 0, 0}));
  scene.fluids.push_back(drop({3, 0, 0}));
  scene.boxes.push_back({{{-9, -9, -9}, {-8, -8, -8}}, dielectric_material(1.4)});
  const FlatScene flat = compile(scene);
  ASSERT_EQ(flat.instances.size(), 6u);
  const int expected[] = {0, 1, -1, 2, 3, -1};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(flat.instances[i].solid, expected[i]) << i;
}

// Neighbours along a line end up in one block, in whatever order they come, and none is lost.
TEST(Compile, BallsArePackedWithTheirNeighbours) {
  std::vector<Ball> balls;
  for (int i = 0; i < 1000; ++i)
    balls.push_back({{static_cast<float>(i * 617 % 1000), 0, 0}, 1.0f + static_cast<float>(i)});
  const std::vector<BallBlock> blocks = pack_balls(balls);
  ASSERT_EQ(blocks.size(), 125u);
  double radii = 0;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const Ball ball = blocks[i / 8].ball(i % 8);
    EXPECT_EQ(ball.center.x, static_cast<float>(i));
    radii += static_cast<double>(ball.radius);
  }
  EXPECT_EQ(radii, 1000 * 1001 / 2);
  const Box3 bounds = bounds_of(pack_balls({{{1, 2, 3}, 0.5f}})[0], 0.25f);
  EXPECT_NEAR(bounds.low.x, 0.25, 1e-4);
  EXPECT_NEAR(bounds.high.z, 3.75, 1e-4);
}

TEST(Compile, TooManyMediaAreRefused) {
  SceneDescription scene = looked_at({0, 0, 0});
  for (int i = 0; i < 8; ++i) scene.balls.push_back({{{{0, 2.0 * i, 0}, 1}}, dielectric_material(1.1 + 0.1 * i)});
  EXPECT_THROW(compile(scene), Error);
  scene.balls.pop_back();
  EXPECT_NO_THROW(compile(scene));
}

TEST(Compile, GeometryIsFoundThroughInstances) {
  SceneDescription scene = looked_at({0, 0, 0});
  scene.fluids.push_back(drop({0, 0, 0}));
  FluidDescription placed = drop({1, 0, 0});
  placed.placement = {{0, 2, 0}, {-2, 0, 0}, {0, 0, 2}, {5, 6, 7}};
  scene.fluids.push_back(placed);
  const FlatScene flat = compile(scene);
  ASSERT_EQ(flat.instances.size(), 2u);
  EXPECT_TRUE(flat.instances[0].identity);
  EXPECT_FALSE(flat.instances[1].identity);
  // (1, 0, 0) goes to (0, 2, 0) + (5, 6, 7); the geometry was recentred about its own middle.
  const Vec3 expected = to_float(Vec3d{5, 8, 7} - flat.recentring);
  EXPECT_LT(length(flat.instances[1].to_world.point({0, 0, 0}) - expected), 1e-5f);
  const Vec3 there{0.3f, -0.7f, 0.2f};
  EXPECT_LT(length(flat.instances[1].to_object.point(flat.instances[1].to_world.point(there)) - there), 1e-5f);
}

// ---- container and floor -----------------------------------------------------------------------------------------

TEST(Container, StandsInAFloorThatItTouches) {
  SceneDescription scene = looked_at({0, 0, 0});
  FluidDescription fluid = drop({0, 0, 0});
  fluid.container = Box3d{{-1, -1, -1}, {1, 1, 1}};
  scene.fluids.push_back(fluid);
  PatchDescription floor;
  floor.center = {0, -1, 0};
  scene.patches.push_back(floor);
  const FlatScene flat = compile(scene);
  EXPECT_LT(flat.fluids[0].clip.low.y, -1.0f);
  EXPECT_GT(flat.fluids[0].clip.low.y, -1.01f);
  EXPECT_EQ(flat.fluids[0].clip.high.y, 1.0f);
  EXPECT_EQ(flat.fluids[0].clip.low.x, -1.0f);
}

// R0 = 0.1, s = 0.2: the layer at the wall x = 1 is at 0.15 from it, so the mirror at 0.05, that is x = 0.95; there is
// nothing at the other walls.
TEST(Container, ParticlesAtAWallGetMirrorImages) {
  FluidDescription fluid = drop({0.85, 0, 0});
  fluid.positions.push_back({0.65, 0, 0});
  fluid.positions.push_back({0, 0, 0});
  fluid.surface.order = 2;
  fluid.surface.spacing = 0.2;
  fluid.container = Box3d{{-1, -1, -1}, {1, 1, 1}};
  const WettedParticles wetted = wet_walls(fluid);
  const auto has = [&](Vec3d p) {
    for (const Vec3d& q : wetted.positions)
      if (length(p - q) < 1e-12) return true;
    return false;
  };
  EXPECT_EQ(wetted.positions.size(), 3u + 2);
  EXPECT_TRUE(has({1.05, 0, 0}));
  EXPECT_TRUE(has({1.25, 0, 0}));
}

TEST(Container, CornersAreFilled) {
  FluidDescription fluid = drop({0.9, 0.9, 0.9});
  fluid.surface.spacing = 0.2;
  fluid.container = Box3d{{-1, -1, -1}, {1, 1, 1}};
  EXPECT_EQ(wet_walls(fluid).positions.size(), 8u);
}

TEST(Container, AFaceThatCutsThroughTheFluidIsNoWall) {
  FluidDescription fluid = drop({0, 0, 0});
  for (int i = -20; i <= 20; ++i) fluid.positions.push_back({0.1 * i, 0, 0});
  fluid.container = Box3d{{-0.7, -5, -5}, {0.7, 5, 5}};
  const WettedParticles wetted = wet_walls(fluid);
  EXPECT_EQ(wetted.positions.size(), fluid.positions.size());
}

TEST(Container, RadiiFollowTheirParticles) {
  FluidDescription fluid = drop({0.9, 0, 0});
  fluid.positions.push_back({0.95, 0, 0});
  fluid.radii = {0.1f, 0.001f};
  fluid.surface.spacing = 0.2;
  fluid.surface.order = 1;
  fluid.container = Box3d{{-1, -1, -1}, {1, 1, 1}};
  const WettedParticles wetted = wet_walls(fluid);
  ASSERT_EQ(wetted.positions.size(), 3u);  // the small one is too far from the wall to feel it
  ASSERT_EQ(wetted.radii.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(wetted.radii[i], wetted.positions[i].x == 0.95 ? 0.001f : 0.1f);
}

}  // namespace
}  // namespace embrun

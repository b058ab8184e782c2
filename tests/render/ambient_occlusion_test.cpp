// Ambient occlusion against form factors: the open share of the hemisphere, weighted by the cosine, is the share of the
// unit disc that its open directions cover when they are projected onto the floor (Nusselt).

#include <gtest/gtest.h>

#include <cmath>

#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

constexpr double endless = static_cast<double>(infinity);

/// A grey floor in the plane y = 0, seen at `at`; no light anywhere.
SceneDescription floor_seen(Vec3d from, Vec3d at) {
  SceneDescription scene = scene_seen(from, at, pencil, 2, 20000);
  scene.integrator.kind = IntegratorKind::ambient_occlusion;
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, endless, diffuse_material(grey(0.2f))));
  return scene;
}

/// A wall in the plane x = 0, of the given height.
PatchDescription wall(double height, MaterialDescription material) {
  PatchDescription p = patch({0, 0.5 * height, 0}, {0, 1, 0}, {0, 0, 1}, endless, material);
  if (std::isfinite(height))
    p.half_u = 0.5 * height;
  else
    p.center = {0, 0, 0};
  return p;
}

void expect_share(const SceneDescription& scene, double expected) {
  const Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, expected, 4 * m.standard_error + 1e-6);
  EXPECT_LT(m.standard_error, 0.003);
  EXPECT_EQ(m.bad, 0u);
}

// Seen from d before it, a long wall of height h hides (1 - sin a) / 2, where tan a = d / h.
TEST(AmbientOcclusion, BeforeAWallIsWhatItLeavesOpen) {
  const double d = 0.5;
  for (const double height : {0.2, 1.0, 5.0}) {
    SceneDescription scene = floor_seen({2, 1, 0}, {d, 0, 0});
    scene.patches.push_back(wall(height, diffuse_material(grey(0.5f))));
    expect_share(scene, 1 - 0.5 * (1 - d / std::hypot(d, height)));
  }
}

// An endless wall hides half. Up to a distance R it hides the directions whose way to it is shorter, cos > d / R towards it:
// projected, the segment of the disc beyond c = d / R, of area acos c - c sqrt(1 - c^2).
TEST(AmbientOcclusion, InACornerDependsOnTheDistance) {
  const double d = 0.5;
  for (const double reach : {0.4, 0.6, 1.0, 3.0, endless}) {
    SceneDescription scene = floor_seen({2, 1, 0}, {d, 0, 0});
    scene.patches.push_back(wall(endless, diffuse_material(grey(0.5f))));
    scene.integrator.occlusion_distance = reach;
    const double c = std::fmin(1.0, d / reach);
    expect_share(scene, 1 - (std::acos(c) - c * std::sqrt(1 - c * c)) / M_PI);
  }
}

// A sphere right above, of radius r with its centre at height h, hides (r / h)^2, and glass and mirrors hide as much as what
// is matt. A boundary between equal indices is not there, nor is what absorbs behind it.
TEST(AmbientOcclusion, UnderASphere) {
  struct Case {
    MaterialDescription material;
    double open;
  };
  for (const Case& c :
       {Case{diffuse_material(grey(1)), 0.75}, Case{conductor_material(), 0.75}, Case{dielectric_material(1.5), 0.75},
        Case{dielectric_material(1.0, grey(5)), 1.0}, Case{fog_material(grey(5), grey(2)), 1.0}}) {
    SceneDescription scene = floor_seen({5, 1, 0}, {0, 0, 0});
    scene.balls.push_back(balls({{{0, 2, 0}, 1}}, c.material));
    expect_share(scene, c.open);
  }
}

// In a corner, half open, a ball that shines opens its own share of the wall behind it, cos (r / D)^2; lamps without a surface
// are not there. The ball itself is white, and if the camera does not see lights, the wall is seen behind it.
TEST(AmbientOcclusion, WhatShinesIsWhiteAndHidesNothing) {
  SceneDescription scene = floor_seen({2, 1, 0}, {0.5, 0, 0});
  scene.patches.push_back(wall(endless, diffuse_material(grey(0.5f))));
  scene.balls.push_back(balls({{{0.25, 0.25, 0}, 0.1}}, diffuse_material(grey(0.5f))));
  const double share = std::sqrt(0.5) * 0.01 / 0.125;
  expect_share(scene, 0.5);
  scene.balls.back().radiance = grey(9);
  scene.environment.kind = EnvironmentDescription::Kind::constant;
  scene.environment.constant = grey(3);
  LightDescription lamp;
  lamp.kind = LightDescription::Kind::sphere;
  lamp.position = {0.6, 0.3, 0};
  lamp.radius = 0.1;
  scene.lights.push_back(lamp);
  expect_share(scene, 0.5 + share);

  scene.camera.target = {0.25, 0.25, 0};
  EXPECT_EQ(render_and_measure(scene).least, 1);
  scene.integrator.hide_emitters = true;
  const Measured behind = render_and_measure(scene);
  EXPECT_GT(behind.mean, 0.4);
  EXPECT_LT(behind.mean, 0.7);
}

// A mirror of glass, of water or of metal is measured where it is: in the corner as what is matt.
TEST(AmbientOcclusion, IsOfWhatIsSeenFirst) {
  const double d = 0.5;
  for (const MaterialDescription& material : {conductor_material(), dielectric_material(1.33, grey(5))}) {
    SceneDescription scene = floor_seen({2, 1, 0}, {d, 0, 0});
    scene.patches.clear();
    scene.patches.push_back(wall(1, diffuse_material(grey(0.5f))));
    scene.boxes.push_back(box({-3, -1, -400}, {9, 0, 400}, material));
    expect_share(scene, 1 - 0.5 * (1 - d / std::hypot(d, 1)));
  }
}

// A camera within water sees its bottom: shut in by the surface, but for what is farther away than what counts.
TEST(AmbientOcclusion, FromWithinWater) {
  SceneDescription scene = floor_seen({0.1, 0.4, 0}, {0, 0, 0});
  scene.boxes.push_back(box({-2, -0.5, -2}, {2, 0.5, 2}, dielectric_material(1.33)));
  expect_share(scene, 0);
  scene.integrator.occlusion_distance = 0.4;
  expect_share(scene, 1);
}

// What convex bodies see is all open, whatever their normals: each corner's leans off by as much as shading allows.
TEST(AmbientOcclusion, CrookedNormalsDarkenNothing) {
  SceneDescription scene = scene_seen({2, 3, 5}, {0, 0, 0}, 25, 24, 64);
  scene.integrator.kind = IntegratorKind::ambient_occlusion;
  MeshDescription octahedron;
  octahedron.mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (const Vec3 p : octahedron.mesh.positions)
    octahedron.mesh.normals.push_back(normalize(p + 1.5f * Vec3{p.y, p.z, p.x}));
  octahedron.mesh.triangles = {{{0, 2, 4}}, {{2, 1, 4}}, {{1, 3, 4}}, {{3, 0, 4}},
                               {{2, 0, 5}}, {{1, 2, 5}}, {{3, 1, 5}}, {{0, 3, 5}}};
  octahedron.material = diffuse_material(grey(0.5f));
  scene.meshes.push_back(octahedron);
  const Measured m = render_and_measure(scene);
  EXPECT_EQ(m.least, 1);
  EXPECT_GT(m.counters.bends, 1000u);
}

}  // namespace
}  // namespace embrun

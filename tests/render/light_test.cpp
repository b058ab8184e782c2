// Light on diffuse surfaces: area lights of known form factor, and the three ways of sampling that must agree.

#include <gtest/gtest.h>

#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

/// A diffuse floor seen at one point, from the side.
SceneDescription lit_floor(float reflectance, int samples) {
  SceneDescription scene = scene_seen({3, 1, 0}, {0, 0, 0}, pencil, 2, samples);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 50, diffuse_material(grey(reflectance))));
  return scene;
}

LightDescription ceiling_lamp(double half_x, double half_z, double height, float radiance) {
  LightDescription lamp;
  lamp.position = {-half_x, height, -half_z};
  lamp.edge_u = {2 * half_x, 0, 0};
  lamp.edge_v = {0, 0, 2 * half_z};  // x cross z points down
  lamp.radiance = grey(radiance);
  return lamp;
}

// Configuration factor of a small plane under the corner of a parallel rectangle a x b at height c, with X = a/c, Y = b/c:
//   F = 1/(2 pi) [X/sqrt(1+X^2) atan(Y/sqrt(1+X^2)) + Y/sqrt(1+Y^2) atan(X/sqrt(1+Y^2))];
// four corners make the whole lamp. The radiance of the floor is reflectance * radiance * F.
double corner_factor(double x, double y) {
  const double sx = std::sqrt(1 + x * x), sy = std::sqrt(1 + y * y);
  return (x / sx * std::atan(y / sx) + y / sy * std::atan(x / sy)) / (2 * M_PI);
}

class Strategies : public ::testing::TestWithParam<LightStrategy> {};

TEST_P(Strategies, ALampHasItsFormFactor) {
  SceneDescription scene = lit_floor(0.8f, 20000);
  scene.lights.push_back(ceiling_lamp(0.5, 0.3, 0.7, 5));
  const double expected = 0.8 * 5 * 4 * corner_factor(0.5 / 0.7, 0.3 / 0.7);
  const Measured m = render_and_measure(scene, GetParam());
  EXPECT_NEAR(m.mean, expected, 4 * m.standard_error + 1e-4);
  EXPECT_LT(m.standard_error, 0.02 * expected);
}

// A ball light of radius r at height h above a point: F = (r/h)^2.
TEST_P(Strategies, ABallLightHasItsFormFactor) {
  SceneDescription scene = lit_floor(0.5f, 20000);
  LightDescription lamp;
  lamp.kind = LightDescription::Kind::sphere;
  lamp.position = {0, 1, 0};
  lamp.radius = 0.4;
  lamp.radiance = grey(3);
  scene.lights.push_back(lamp);
  const Measured m = render_and_measure(scene, GetParam());
  EXPECT_NEAR(m.mean, 0.5 * 3 * 0.16, 4 * m.standard_error + 1e-4);
}

// A disk of radius r at height h, its axis over the point: F = r^2/(r^2 + h^2).
TEST_P(Strategies, ADiskHasItsFormFactor) {
  SceneDescription scene = lit_floor(0.5f, 20000);
  LightDescription lamp;
  lamp.kind = LightDescription::Kind::disk;
  lamp.position = {0, 1, 0};
  lamp.radius = 0.75;
  lamp.radiance = grey(3);
  scene.lights.push_back(lamp);
  const Measured m = render_and_measure(scene, GetParam());
  EXPECT_NEAR(m.mean, 0.5 * 3 * 0.5625 / 1.5625, 4 * m.standard_error + 1e-4);
}

// A uniform cone of light of half angle a from the zenith: F = sin^2 a.
TEST_P(Strategies, ADistantLightHasItsFormFactor) {
  SceneDescription scene = lit_floor(0.5f, 20000);
  LightDescription sun;
  sun.kind = LightDescription::Kind::distant;
  sun.normal = {0, 1, 0};
  sun.half_angle = 20;
  sun.radiance = grey(3);
  scene.lights.push_back(sun);
  const Measured m = render_and_measure(scene, GetParam());
  EXPECT_NEAR(m.mean, 0.5 * 3 * std::pow(std::sin(20 * M_PI / 180), 2), 4 * m.standard_error + 1e-4);
}

// The same factors of shapes of the scene that shine; black ones, so that nothing comes back from them.
TEST_P(Strategies, ShapesThatShineHaveTheirFormFactors) {
  const auto floor_under = [](const auto& add) {
    SceneDescription scene = lit_floor(0.5f, 20000);
    add(scene);
    return render_and_measure(scene, GetParam());
  };
  const MaterialDescription black = diffuse_material({});
  const Measured ball = floor_under([&](SceneDescription& scene) {
    BallsDescription set = balls({{{0, 1, 0}, 0.4}}, black);
    set.radiance = grey(3);
    scene.balls.push_back(set);
  });
  EXPECT_NEAR(ball.mean, 0.5 * 3 * 0.16, 4 * ball.standard_error + 1e-4);
  const Measured disk = floor_under([&](SceneDescription& scene) {
    PatchDescription lamp = patch({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, 0.75, black);  // x cross z points down
    lamp.round = true;
    lamp.radiance = grey(3);
    scene.patches.push_back(lamp);
  });
  EXPECT_NEAR(disk.mean, 0.5 * 3 * 0.5625 / 1.5625, 4 * disk.standard_error + 1e-4);
  const Measured rectangle = floor_under([&](SceneDescription& scene) {
    PatchDescription lamp = patch({0, 0.7, 0}, {1, 0, 0}, {0, 0, 1}, 0.5, black);
    lamp.half_v = 0.3;
    lamp.radiance = grey(3);
    scene.patches.push_back(lamp);
  });
  EXPECT_NEAR(rectangle.mean, 0.5 * 3 * 4 * corner_factor(0.5 / 0.7, 0.3 / 0.7), 4 * rectangle.standard_error + 1e-4);
}

// A mesh that a mirror turns over shines to the side of its normal, which the mirror takes along.
TEST_P(Strategies, AMirroredMeshShinesDown) {
  SceneDescription scene = lit_floor(0.5f, 20000);
  MeshDescription lamp;
  lamp.mesh.positions = {{-0.5f, 0.3f, 0}, {0.5f, 0.3f, 0}, {0.5f, -0.3f, 0}, {-0.5f, -0.3f, 0}};
  lamp.mesh.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};  // towards -z, which becomes -y
  lamp.placement = {{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}, {0, 0.7, 0}};
  ASSERT_GT(determinant(lamp.placement), 0);
  lamp.material = diffuse_material({});
  lamp.radiance = grey(3);
  scene.meshes.push_back(lamp);
  const double expected = 0.5 * 3 * 4 * corner_factor(0.5 / 0.7, 0.3 / 0.7);
  const Measured plain = render_and_measure(scene, GetParam());
  EXPECT_NEAR(plain.mean, expected, 4 * plain.standard_error + 1e-4);
  scene.meshes[0].placement.x_axis = {1, 0, 0};
  ASSERT_LT(determinant(scene.meshes[0].placement), 0);
  const Measured mirrored = render_and_measure(scene, GetParam());
  EXPECT_NEAR(mirrored.mean, expected, 4 * mirrored.standard_error + 1e-4);
}

// The side of a cylinder of radius r whose axis runs at height h along x: the sum over its surface of
// cos cos' / (pi d^2), of what faces the floor's point.
TEST_P(Strategies, ACylinderHasItsFormFactor) {
  const double r = 0.3, h = 0.9, half = 0.6;
  double factor = 0;
  constexpr int steps = 800;
  for (int i = 0; i < steps; ++i) {
    const double x = half * ((i + 0.5) / steps * 2 - 1);
    for (int j = 0; j < steps; ++j) {
      const double angle = (j + 0.5) / steps * 2 * M_PI;
      const Vec3d normal{0, std::sin(angle), std::cos(angle)};
      const Vec3d p = Vec3d{x, h, 0} + r * normal;
      const double distance = length(p), facing = -dot(normal, p) / distance;
      if (facing > 0) factor += p.y / distance * facing / (M_PI * distance * distance);
    }
  }
  factor *= 2 * half / steps * (2 * M_PI * r / steps);
  SceneDescription scene = lit_floor(0.5f, 20000);
  CylinderDescription lamp;
  lamp.start = {-half, h, 0};
  lamp.end = {half, h, 0};
  lamp.radius = r;
  lamp.material = diffuse_material({});
  lamp.radiance = grey(3);
  scene.cylinders.push_back(lamp);
  const Measured m = render_and_measure(scene, GetParam());
  EXPECT_NEAR(m.mean, 0.5 * 3 * factor, 4 * m.standard_error + 1e-4);
}

INSTANTIATE_TEST_SUITE_P(All, Strategies,
                         ::testing::Values(LightStrategy::mis, LightStrategy::bsdf_only, LightStrategy::lights_only),
                         [](const auto& test) {
                           return test.param == LightStrategy::mis         ? "mis"
                                  : test.param == LightStrategy::bsdf_only ? "bsdf_only"
                                                                           : "lights_only";
                         });

// Hidden lights are not seen, nor what they are behind; what they light is.
TEST(HiddenEmitters, AreNotSeen) {
  SceneDescription scene = lit_floor(0.8f, 2000);
  scene.lights.push_back(ceiling_lamp(0.5, 0.3, 0.7, 5));
  const Measured lit = render_and_measure(scene);
  scene.integrator.hide_emitters = true;
  EXPECT_NEAR(render_and_measure(scene).mean, lit.mean, 6 * lit.standard_error);
  // Up at the lamp, at a shape that shines, and at the sky.
  scene.camera.eye = {0, 0.1, 0};
  scene.camera.target = {0, 1, 0};
  scene.camera.up = {1, 0, 0};
  EXPECT_EQ(render_and_measure(scene).mean, 0);
  scene.lights.clear();
  PatchDescription lamp = patch({0, 0.7, 0}, {1, 0, 0}, {0, 0, 1}, 0.5, diffuse_material({}));
  lamp.radiance = grey(5);
  scene.patches.push_back(lamp);
  EXPECT_EQ(render_and_measure(scene).mean, 0);
  scene.environment.kind = EnvironmentDescription::Kind::constant;
  EXPECT_EQ(render_and_measure(scene).mean, 0);
  scene.integrator.hide_emitters = false;
  EXPECT_NEAR(render_and_measure(scene).mean, 5, 1e-5);
}

// Something opaque in the way takes the light, something refracting stops shadow rays, something index-matched absorbs.
TEST(Shadows, BodiesInTheWay) {
  const auto with = [](MaterialDescription material) {
    SceneDescription scene = lit_floor(0.8f, 4000);
    scene.lights.push_back(ceiling_lamp(0.2, 0.2, 2, 5));
    scene.boxes.push_back(box({-0.6, 0.5, -0.6}, {0.6, 1, 0.6}, material));
    scene.integrator.max_depth = 1;  // no way round by refraction
    return render_and_measure(scene, LightStrategy::lights_only);
  };
  SceneDescription open = lit_floor(0.8f, 4000);
  open.lights.push_back(ceiling_lamp(0.2, 0.2, 2, 5));
  const double clear = render_and_measure(open, LightStrategy::lights_only).mean;
  EXPECT_GT(clear, 0.01);
  EXPECT_EQ(with(diffuse_material({0, 0, 0})).mean, 0);
  EXPECT_EQ(with(dielectric_material(1.33)).mean, 0);
  EXPECT_NEAR(with(dielectric_material(1)).mean, clear, 1e-3 * clear);
  // The way through is the thickness over the cosine: from 1 to 1/cos(8 degrees) at the lamp's corners.
  const double absorbed = with(dielectric_material(1, grey(2))).mean;
  EXPECT_LT(absorbed, clear * std::exp(-2 * 0.5));
  EXPECT_GT(absorbed, clear * std::exp(-2 * 0.5 * 1.01));
}

// A room with a lamp, a diffuse ball in it and one of water beside it: whatever the strategy, the same picture.
TEST(Strategies, AgreeOnAScene) {
  SceneDescription scene = scene_seen({0.2, 0.9, 2.6}, {0, 0.5, 0}, 40, 8, 2000);
  scene.environment.constant = grey(0.2f);
  const MaterialDescription wall = diffuse_material(grey(0.6f));
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 1.5, wall));
  scene.patches.push_back(patch({0, 1, -1.2}, {1, 0, 0}, {0, 1, 0}, 1.5, wall));
  scene.balls.push_back(balls({{{-0.4, 0.35, 0}, 0.35}}, diffuse_material({0.7f, 0.5f, 0.3f})));
  scene.balls.push_back(balls({{{0.45, 0.3, 0.2}, 0.3}}, dielectric_material(1.33, {0.5f, 0.1f, 0.05f})));
  scene.lights.push_back(ceiling_lamp(0.4, 0.4, 1.9, 4));
  const Measured mis = render_and_measure(scene);
  const Measured bsdf = render_and_measure(scene, LightStrategy::bsdf_only);
  EXPECT_NEAR(mis.mean, bsdf.mean, 4 * std::hypot(mis.standard_error, bsdf.standard_error));
  EXPECT_LT(mis.standard_error, bsdf.standard_error);
  // Light sampling alone cannot find what refraction brings, so it is compared without the water.
  scene.balls.pop_back();
  const Measured dry = render_and_measure(scene);
  const Measured lights = render_and_measure(scene, LightStrategy::lights_only);
  EXPECT_NEAR(dry.mean, lights.mean, 4 * std::hypot(dry.standard_error, lights.standard_error));
}

// Russian roulette changes the noise, not the mean.
TEST(Roulette, IsUnbiased) {
  SceneDescription scene = scene_seen({1.7, 1.1, 2.6}, {0, 0, 0}, 38, 8, 4000);
  scene.patches.push_back(patch({0, -0.5, 0}, {1, 0, 0}, {0, 0, -1}, 3, diffuse_material(grey(0.5f))));
  scene.balls.push_back(balls({{{0, 0, 0}, 0.45}}, dielectric_material(1.33, {4, 2, 1})));
  scene.integrator.roulette_depth = 0;
  const Measured early = render_and_measure(scene);
  scene.integrator.roulette_depth = 1000;
  const Measured never = render_and_measure(scene);
  EXPECT_NEAR(early.mean, never.mean, 4 * std::hypot(early.standard_error, never.standard_error));
  EXPECT_LT(early.standard_error, 0.01);
  EXPECT_LT(early.counters.scatterings, never.counters.scatterings);
}

}  // namespace
}  // namespace embrun

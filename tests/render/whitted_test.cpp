// Whitted's ray tracing, against formulas of direct light and of mirrors and slabs.

#include <gtest/gtest.h>

#include <cmath>

#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;
using Kind = LightDescription::Kind;

constexpr double albedo = 0.6;

/// A diffuse floor in the plane y = 0, seen at the origin from the side.
SceneDescription floor_seen(int samples) {
  SceneDescription scene = scene_seen({3, 1, 0}, {0, 0, 0}, pencil, 2, samples);
  scene.integrator.kind = IntegratorKind::whitted;
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 50, diffuse_material(grey(0.6f))));
  return scene;
}

LightDescription point_light(Vec3d position, float intensity) {
  LightDescription light;
  light.kind = Kind::point;
  light.position = position;
  light.radiance = grey(intensity);
  return light;
}

/// What the floor at the origin reflects of a point light: albedo / pi times I cos / r^2.
double of_point_light(Vec3d position, double intensity) {
  const double r = length(position);
  return albedo / M_PI * intensity * (position.y / r) / (r * r);
}

// One sample of every light: there is no chance in it.
TEST(Whitted, EveryPointLightIsSampled) {
  SceneDescription scene = floor_seen(1);
  // What the pixels see of the floor is 1e-6 m wide: a light's share varies by less than 1e-6 over it.
  scene.camera.vertical_fov = 0.01 * pencil;
  scene.lights.push_back(point_light({0, 2, 0}, 5));
  scene.lights.push_back(point_light({1, 1, -2}, 300));
  scene.lights.push_back(point_light({-1, 3, 1}, 0.7f));
  const double expected =
      of_point_light({0, 2, 0}, 5) + of_point_light({1, 1, -2}, 300) + of_point_light({-1, 3, 1}, 0.7);
  const Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.least, expected, 1e-5 * expected);
  EXPECT_NEAR(m.greatest, expected, 1e-5 * expected);
  // A ball in the way of one of them.
  scene.balls.push_back(balls({{{0, 1, 0}, 0.2}}, diffuse_material(grey(1))));
  const double rest = expected - of_point_light({0, 2, 0}, 5);
  EXPECT_NEAR(render_and_measure(scene).mean, rest, 1e-5 * rest);
}

// A disk of radius R at height h: form factor R^2 / (R^2 + h^2). Two lamps and the sky: their sum, each with its own numbers.
TEST(Whitted, AreaLightsHaveTheirFormFactor) {
  SceneDescription scene = floor_seen(20000);
  LightDescription lamp;
  lamp.kind = Kind::disk;
  lamp.position = {0, 1, 0};
  lamp.radius = 0.5;
  lamp.radiance = grey(3);
  scene.lights.push_back(lamp);
  Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, albedo * 3 * 0.25 / 1.25, 4 * m.standard_error);
  EXPECT_LT(m.standard_error, 0.002);
  // A ball of light (r / h)^2, beside an environment that the two hide nothing else of.
  lamp.kind = Kind::sphere;
  lamp.position = {0, 4, 0};
  lamp.radius = 2;
  scene.lights = {lamp};
  scene.environment.kind = EnvironmentDescription::Kind::constant;
  scene.environment.constant = grey(2);
  m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, albedo * (3 * 0.25 + 2 * 0.75), 4 * m.standard_error);
  EXPECT_LT(m.standard_error, 0.02);
}

TEST(Whitted, MirrorsShowWhatIsLit) {
  SceneDescription scene = floor_seen(1);
  scene.camera.eye = {1, 1, 0};
  scene.camera.target = {2, 2, 0};
  // From (1, 1) up to the ceiling's mirror at (2, 2) and down to (4, 0).
  scene.patches.push_back(patch({2, 2, 0}, {1, 0, 0}, {0, 0, 1}, 0.1, conductor_material()));
  scene.lights.push_back(point_light({4, 3, 0}, 10));
  const double expected = of_point_light({0, 3, 0}, 10);
  EXPECT_NEAR(render_and_measure(scene).mean, expected, 1e-5 * expected);
  scene.integrator.max_depth = 1;  // the mirror alone
  EXPECT_EQ(render_and_measure(scene).mean, 0);
}

// Straight through a slab: 2 n / (n^2 + 1) with all the reflections in it, (1 - R)^2 with none.
TEST(Whitted, SlabsLetThroughWhatFresnelSays) {
  SceneDescription scene = scene_seen({0, 4, 0}, {0, 0, 0}, pencil, 2, 20000);
  scene.integrator.kind = IntegratorKind::whitted;
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 50, diffuse_material(grey(0.6f))));
  scene.boxes.push_back(box({-0.2, 2, -0.2}, {0.2, 2.3, 0.2}, dielectric_material(1.5)));
  scene.lights.push_back(point_light({3, 2, 0}, 10));
  const double lit = of_point_light({3, 2, 0}, 10);
  Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, lit * 2 * 1.5 / (1.5 * 1.5 + 1), 4 * m.standard_error);
  EXPECT_LT(m.standard_error, 0.005 * lit);
  scene.integrator.max_depth = 3;
  m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, lit * 0.96 * 0.96, 4 * m.standard_error);
}

// Walls that shine with 1 and reflect rho, all round: 1 + rho of the series 1 + rho + rho^2 + ... that a path gathers. The
// first bounce that is left out is rho^2.
TEST(Whitted, LeavesOutLightFromBounceToBounce) {
  SceneDescription scene = scene_seen({0.1, 0.2, 0.3}, {-0.3, -0.1, -1}, 60, 4, 4000);
  shut_in_shining_walls(scene, 0.6f);
  scene.integrator.kind = IntegratorKind::whitted;
  const Measured whitted = render_and_measure(scene);
  EXPECT_NEAR(whitted.mean, 1 + albedo, 4 * whitted.standard_error);
  scene.integrator.kind = IntegratorKind::path;
  scene.integrator.max_depth = 2;
  const Measured path = render_and_measure(scene);
  EXPECT_NEAR(path.mean - whitted.mean, albedo * albedo, 4 * std::hypot(path.standard_error, whitted.standard_error));
  EXPECT_LT(whitted.standard_error, 0.02);
}

// A plastic ball in a furnace is lit by its surroundings alone, by its coat's mirror and by its base: paths see no more.
TEST(Whitted, APlasticBallIsAsPathsSeeIt) {
  SceneDescription scene = scene_seen({0, 0, 3}, {0, 0, 0}, 30, 4, 8000);
  MaterialDescription plastic = diffuse_material({0.7f, 0.5f, 0.3f});
  plastic.kind = BsdfKind::plastic;
  scene.balls.push_back(balls({{{0, 0, 0}, 1}}, plastic));
  const Measured path = render_and_measure(scene);
  scene.integrator.kind = IntegratorKind::whitted;
  const Measured whitted = render_and_measure(scene);
  EXPECT_NEAR(whitted.mean, path.mean, 4 * std::hypot(path.standard_error, whitted.standard_error));
  EXPECT_LT(whitted.standard_error, 0.01);
}

// In fog the light that was scattered once, which are the paths of one event.
TEST(Whitted, FogScattersOnce) {
  SceneDescription scene = scene_seen({0, 0, 3}, {0, 0, 0}, 20, 4, 8000);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.boxes.push_back(box({-1, -1, -1}, {1, 1, 1}, fog_material(grey(0.1f), grey(0.8f))));
  scene.lights.push_back(point_light({0, 3, 0}, 10));
  scene.lights.push_back(point_light({-2, 0, 1}, 20));
  scene.integrator.max_depth = 1;
  const Measured once = render_and_measure(scene);
  scene.integrator.max_depth = 100;
  const Measured often = render_and_measure(scene);
  scene.integrator.kind = IntegratorKind::whitted;
  const Measured whitted = render_and_measure(scene);
  EXPECT_NEAR(whitted.mean, once.mean, 4 * std::hypot(once.standard_error, whitted.standard_error));
  EXPECT_GT(often.mean, 1.1 * once.mean);
}

// A floor under water is lit by what shadow rays bring straight through the surface, and black if they end there.
TEST(Whitted, ShadowRaysGoStraightIntoWater) {
  SceneDescription scene = scene_seen({0, 4, 0}, {0, 0, 0}, pencil, 2, 20000);
  scene.integrator.kind = IntegratorKind::whitted;
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 50, diffuse_material(grey(0.6f))));
  scene.boxes.push_back(box({-9, -1, -9}, {9, 1, 9}, dielectric_material(1.33, grey(0.1f))));
  scene.lights.push_back(point_light({0, 4, 0}, 10));
  EXPECT_EQ(render_and_measure(scene).mean, 0);
  // 1 - R and 1 m of water each way; on the way up radiance spreads over n^2 times the solid angle. What the surface reflects
  // back to the floor is not followed.
  scene.integrator.straight_shadows = true;
  const double through = 1 - std::pow(0.33 / 2.33, 2);
  const double expected = of_point_light({0, 4, 0}, 10) * through * through * std::exp(-0.2) / (1.33 * 1.33);
  const Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, expected, 4 * m.standard_error);
  EXPECT_LT(m.standard_error, 0.01 * expected);
}

}  // namespace
}  // namespace embrun

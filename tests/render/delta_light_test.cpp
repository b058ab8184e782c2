// Lights without extent, against the formulas that have them in it.

#include <gtest/gtest.h>

#include <cmath>

#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;
using Kind = LightDescription::Kind;

/// A diffuse floor in the plane y = 0, seen at the origin from the side.
SceneDescription floor_seen(int samples, float reflectance = 0.6f) {
  SceneDescription scene = scene_seen({3, 1, 0}, {0, 0, 0}, pencil, 2, samples);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 50, diffuse_material(grey(reflectance))));
  return scene;
}

LightDescription point_light(Vec3d position, Rgb intensity) {
  LightDescription light;
  light.kind = Kind::point;
  light.position = position;
  light.radiance = intensity;
  return light;
}

LightDescription directional_light(Vec3d towards, Rgb irradiance) {
  LightDescription light;
  light.kind = Kind::directional;
  light.normal = towards;
  light.radiance = irradiance;
  return light;
}

/// All samples are the same where there is one light: the mean is exact.
constexpr double exact = 1e-5;

// I cos / r^2 on a Lambertian floor of reflectance rho: rho / pi times that.
TEST(PointLight, FallsOffWithTheSquareOfTheDistance) {
  for (const Vec3d p : {Vec3d{0, 1, 0}, Vec3d{1, 2, -2}, Vec3d{30, 40, 0}}) {
    SceneDescription scene = floor_seen(4);
    scene.lights.push_back(point_light(p, {7, 11, 13}));
    const double r = length(p), expected = 0.6 / M_PI * (p.y / r) / (r * r);
    for (int c = 0; c < 3; ++c) {
      const double intensity = c == 0 ? 7 : c == 1 ? 11 : 13;
      EXPECT_NEAR(render_and_measure(scene, LightStrategy::mis, c).mean, intensity * expected,
                  exact * intensity * expected);
      EXPECT_NEAR(render_and_measure(scene, LightStrategy::lights_only, c).mean, intensity * expected,
                  exact * intensity * expected);
    }
  }
}

TEST(PointLight, IsDarkBelowTheFloorAndBehindBodies) {
  SceneDescription scene = floor_seen(4);
  scene.lights.push_back(point_light({0, -1, 0}, grey(7)));
  EXPECT_EQ(render_and_measure(scene).mean, 0);
  scene.lights[0].position = {0, 2, 0};
  EXPECT_GT(render_and_measure(scene).mean, 0.1);
  scene.balls.push_back(balls({{{0, 1, 0}, 0.2}}, diffuse_material({})));
  EXPECT_EQ(render_and_measure(scene).mean, 0);
}

TEST(PointLight, IsNotSeenItself) {
  SceneDescription scene = scene_seen({0, 0, 3}, {0, 0, 0}, pencil, 2, 4);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.lights.push_back(point_light({0, 0, 0}, grey(7)));
  for (const bool hidden : {false, true}) {
    scene.integrator.hide_emitters = hidden;
    EXPECT_EQ(render_and_measure(scene).mean, 0);
  }
}

// E cos on the floor, wherever it is.
TEST(DirectionalLight, HasItsIrradiance) {
  for (const Vec3d towards : {Vec3d{0, 1, 0}, Vec3d{2, 3, -6}}) {
    SceneDescription scene = floor_seen(4);
    scene.lights.push_back(directional_light(towards, {2, 3, 4}));
    const double expected = 0.6 / M_PI * 3 * towards.y / length(towards);
    EXPECT_NEAR(render_and_measure(scene, LightStrategy::mis, 1).mean, expected, exact * expected);
  }
  SceneDescription below = floor_seen(4);
  below.lights.push_back(directional_light({0, -1, 0}, grey(3)));
  EXPECT_EQ(render_and_measure(below).mean, 0);
}

// In a medium that absorbs sigma per metre, all along the way from the light to the floor and on to the camera.
TEST(DeltaLights, AreAbsorbedOnTheWay) {
  SceneDescription scene = floor_seen(4);
  const Rgb sigma{0.1f, 0.3f, 0.7f};
  scene.boxes.push_back(box({-20, -1, -20}, {20, 20, 20}, fog_material(sigma, {})));
  const double to_camera = std::sqrt(10.0);
  SceneDescription point = scene, sun = scene;
  point.lights.push_back(point_light({1, 2, -2}, grey(7)));
  sun.lights.push_back(directional_light({0, 1, 0}, grey(3)));
  for (int c = 0; c < 3; ++c) {
    const double k = static_cast<double>(sigma[c]);
    const double from_point = 0.6 / M_PI * 7 * (2.0 / 3) / 9 * std::exp(-k * (3 + to_camera));
    EXPECT_NEAR(render_and_measure(point, LightStrategy::mis, c).mean, from_point, 1e-4 * from_point);
    const double from_sun = 0.6 / M_PI * 3 * std::exp(-k * (20 + to_camera));
    EXPECT_NEAR(render_and_measure(sun, LightStrategy::mis, c).mean, from_sun, 1e-4 * from_sun);
  }
}

/// A ray along x at distance h from a point light of intensity I at the origin, in an unbounded medium of scattering s and
/// absorption a that scatters the same in all directions; scattered once:
///   s I / (4 pi) integral of exp(-(s + a) (t + r)) / r^2 over t, where r is the distance from the light.
double scattered_once(double s, double a, double h, double from, double to) {
  const int steps = 400000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double t = (i + 0.5) * (to - from) / steps, x = from + t, r = std::sqrt(x * x + h * h);
    sum += std::exp(-(s + a) * (t + r)) / (r * r);
  }
  return s / (4 * M_PI) * sum * (to - from) / steps;
}

SceneDescription fog_round_a_lamp(double h, int samples) {
  SceneDescription scene = scene_seen({-2, h, 0}, {0, h, 0}, pencil, 2, samples);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.boxes.push_back(box({-8, -8, -8}, {8, 8, 8}, fog_material(grey(0.2f), grey(0.5f))));
  scene.integrator.max_depth = 1;
  return scene;
}

TEST(PointLight, ScattersInFogAsTheIntegralSays) {
  SceneDescription scene = fog_round_a_lamp(0.5, 100000);
  scene.lights.push_back(point_light({0, 0, 0}, grey(10)));
  const double expected = 10 * scattered_once(0.5, 0.2, 0.5, -2, 8);
  const Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, expected, 4 * m.standard_error);
  EXPECT_LT(m.standard_error, 0.01 * expected);
  EXPECT_EQ(m.bad, 0u);
}

// A ball light of radius r and radiance L is as bright from afar as a point of intensity pi r^2 L.
TEST(PointLight, IsWhatSmallBallsComeTo) {
  const auto rendered = [](SceneDescription scene, double radius) {
    LightDescription lamp = point_light({0.5, 2, 0.5}, grey(10));
    if (radius > 0) {
      lamp.kind = Kind::sphere;
      lamp.radius = radius;
      lamp.radiance = grey(static_cast<float>(10 / (M_PI * radius * radius)));
    }
    scene.lights.push_back(lamp);
    return render_and_measure(scene);
  };
  SceneDescription fog = fog_round_a_lamp(1, 40000);
  fog.integrator.max_depth = 8;
  for (const SceneDescription& scene : {floor_seen(2000), fog}) {
    const Measured point = rendered(scene, 0);
    double last = 1e30;
    for (const double radius : {0.3, 0.03}) {
      const Measured ball = rendered(scene, radius);
      // A ball's own size counts by its square, beside its distance.
      EXPECT_NEAR(ball.mean, point.mean,
                  4 * std::hypot(ball.standard_error, point.standard_error) + radius * radius * point.mean);
      last = std::abs(ball.mean - point.mean);
    }
    EXPECT_LT(last, 0.01 * point.mean + 4 * point.standard_error);
  }
}

// Several lights, with and without extent: each brings its own.
TEST(DeltaLights, AddUpWithOthers) {
  const auto with = [](bool point, bool sun, bool sky) {
    SceneDescription scene = floor_seen(20000);
    if (point) scene.lights.push_back(point_light({0, 2, 0}, grey(5)));
    if (sun) scene.lights.push_back(directional_light({1, 1, 0}, grey(2)));
    if (sky) scene.environment.kind = EnvironmentDescription::Kind::constant;
    return render_and_measure(scene);
  };
  const double expected = 0.6 / M_PI * (5.0 / 4 + 2 / std::sqrt(2.0)) + 0.6;
  const Measured all = with(true, true, true);
  EXPECT_NEAR(all.mean, expected, 4 * all.standard_error + 1e-4);
  EXPECT_LT(all.standard_error, 0.02 * expected);
  EXPECT_NEAR(with(true, false, false).mean, 0.6 / M_PI * 5 / 4, 1e-5);
  EXPECT_NEAR(with(false, true, false).mean, 0.6 / M_PI * 2 / std::sqrt(2.0), 1e-5);
}

// Under water they shine by straight shadow rays alone: straight down with the transmittance 1 - ((n - 1)/(n + 1))^2.
TEST(DeltaLights, ShineIntoWaterByStraightShadowRaysAlone) {
  SceneDescription scene = scene_seen({0.2, 0.2, 0}, {0, 0, 0}, pencil, 2, 4);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.boxes.push_back(box({-200, -0.5, -200}, {200, 0.3, 200}, dielectric_material(1.33)));
  scene.patches.push_back(patch({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 150, diffuse_material(grey(0.6f))));
  scene.integrator.max_depth = 1;
  const double through = 1 - std::pow(0.33 / 2.33, 2);
  for (const bool sun : {false, true}) {
    scene.lights = {sun ? directional_light({0, 1, 0}, grey(3)) : point_light({0, 2, 0}, grey(12))};
    scene.integrator.straight_shadows = false;
    EXPECT_EQ(render_and_measure(scene).mean, 0);
    scene.integrator.straight_shadows = true;
    const double expected = 0.6 / M_PI * 3 * through;
    EXPECT_NEAR(render_and_measure(scene).mean, expected, 1e-4);
  }
}

}  // namespace
}  // namespace embrun

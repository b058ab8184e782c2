// Gauss's quadrature in place of chance: what it gets right to the last digit, what it gets wrong by as much as its published
// weights say, and that it converges to what paths find.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;
using Kind = LightDescription::Kind;

constexpr double albedo = 0.6;

SceneDescription by_gauss(SceneDescription scene, int samples) {
  scene.integrator.kind = IntegratorKind::gauss;
  scene.integrator.samples = samples;
  return scene;
}

/// A diffuse floor in the plane y = 0, seen at the origin from the side, in the dark.
SceneDescription floor_seen() {
  SceneDescription scene = scene_seen({3, 1, 0}, {0, 0, 0}, pencil, 2, 1);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 50, diffuse_material(grey(0.6f))));
  return scene;
}

/// Light from all directions within a cone about the zenith, up to sin^2(theta).
LightDescription cap(double sin2) {
  LightDescription light;
  light.kind = Kind::distant;
  light.normal = {0, 1, 0};
  light.half_angle = std::asin(std::sqrt(sin2)) * 180 / M_PI;
  light.radiance = grey(1);
  return light;
}

// The nodes' weights have the mean 1: a furnace is what it has to be in every pixel, if no light is sampled by chance.
TEST(Gauss, AFurnaceHasNoNoise) {
  SceneDescription scene = scene_seen({0, 0, 3}, {0, 0, 0}, 15, 8, 1);
  scene.balls.push_back(balls({{{0, 0, 0}, 1}}, diffuse_material(grey(0.6f))));
  for (const int samples : {1, 12, 16, 64, 128}) {
    const Measured m = render_and_measure(by_gauss(scene, samples), LightStrategy::bsdf_only);
    EXPECT_NEAR(m.least, albedo, 1e-6) << samples;
    EXPECT_NEAR(m.greatest, albedo, 1e-6) << samples;
  }
  // With light samples as well there is theirs.
  const Measured m = render_and_measure(by_gauss(scene, 256));
  EXPECT_NEAR(m.mean, albedo, 4 * m.standard_error);
}

// Walls all round that shine with 1 and reflect rho: 1 + rho + rho^2 + rho^3 for three events.
TEST(Gauss, AFurnaceOfManyBouncesHasNoNoise) {
  SceneDescription scene = scene_seen({0.1, 0.2, 0.3}, {-0.3, -0.1, -1}, 60, 4, 1);
  shut_in_shining_walls(scene, 0.6f);
  scene.integrator.max_depth = 3;
  const double expected = 1 + albedo + albedo * albedo + albedo * albedo * albedo;
  const Measured m = render_and_measure(by_gauss(scene, 64), LightStrategy::bsdf_only);
  EXPECT_NEAR(m.least, expected, 1e-5);
  EXPECT_NEAR(m.greatest, expected, 1e-5);
}

// A sky of radiance cos^2(theta) has the irradiance pi / 2, one of cos^6(theta) has pi / 4: in sin^2(theta) they are of
// degree 1 and 3, so exact with 2 heights but for the picture's own 512 rows; with 1 height the latter is 1 / 8. Drawn at
// random, 16 samples of cos^6 have a standard error of 0.07.
TEST(Gauss, APolynomialSkyIsExact) {
  SceneDescription scene = floor_seen();
  scene.environment.kind = EnvironmentDescription::Kind::image;
  const auto set_sky = [&](int power) {
    Image& sky = scene.environment.image = make_image(8, 512, 3);
    for (int row = 0; row < 512; ++row)
      for (int i = 0; i < 8 * 3; ++i)
        sky.at(i / 3, row, i % 3) =
            static_cast<float>(std::pow(std::fmax(0, std::cos(M_PI * (row + 0.5) / 512)), power));
  };
  const auto expect_seen = [&](int samples, double irradiance_over_pi) {
    const Measured m = render_and_measure(by_gauss(scene, samples), LightStrategy::bsdf_only);
    EXPECT_NEAR(m.least, albedo * irradiance_over_pi, 1e-4) << samples;
    EXPECT_NEAR(m.greatest, albedo * irradiance_over_pi, 1e-4) << samples;
  };
  set_sky(2);
  expect_seen(4, 1.0 / 2);
  expect_seen(16, 1.0 / 2);
  set_sky(6);
  expect_seen(4, 1.0 / 8);
  expect_seen(16, 1.0 / 4);
  expect_seen(64, 1.0 / 4);
  scene.integrator.kind = IntegratorKind::path;
  const Measured chance = render_and_measure(scene, LightStrategy::bsdf_only);
  EXPECT_GT(chance.greatest - chance.least, 0.02);
}

// Light within sin^2(theta) < 0.3 is the share 0.3 of a white sky. Three heights have their nodes at 0.11, 0.5, 0.89 with the
// weights 5/18, 4/9, 5/18: all pixels are as wrong as that.
TEST(Gauss, AnEdgeIsWrongByTheWeights) {
  SceneDescription scene = floor_seen();
  scene.lights.push_back(cap(0.3));
  const Measured m = render_and_measure(by_gauss(scene, 36), LightStrategy::bsdf_only);
  EXPECT_NEAR(m.least, albedo * 5 / 18, 1e-6);
  EXPECT_NEAR(m.greatest, albedo * 5 / 18, 1e-6);
  scene.lights = {cap(0.6)};
  EXPECT_NEAR(render_and_measure(by_gauss(scene, 36), LightStrategy::bsdf_only).mean, albedo * 13 / 18, 1e-6);
  // As many samples more as one likes do not help, if the nodes stay.
  SceneDescription more = by_gauss(scene, 360);
  more.integrator.gauss_nodes = 36;
  EXPECT_NEAR(render_and_measure(more, LightStrategy::bsdf_only).mean, albedo * 13 / 18, 1e-6);
}

// The lamp's light, sampled and met, adds up to its form factor but for what the rule makes of its own share of it, which is
// the smaller the more nodes there are.
TEST(Gauss, SampledLightAndMetLightAddUp) {
  SceneDescription scene = floor_seen();
  scene.lights.push_back(cap(0.3));
  scene.integrator.gauss_nodes = 4096;
  const Measured m = render_and_measure(by_gauss(scene, 8 * 4096));
  EXPECT_NEAR(m.mean, albedo * 0.3, 4 * m.standard_error + 0.002 * albedo);
  EXPECT_LT(m.standard_error, 0.002 * albedo);
}

// In a mirror the floor is what it is without one; the mirror is out of the way of its light.
TEST(Gauss, IsTheSameInMirrors) {
  SceneDescription scene = floor_seen();
  scene.camera.eye = {1, 1, 0};
  scene.camera.target = {2, 2, 0};
  scene.patches.push_back(patch({2, 2, 0}, {1, 0, 0}, {0, 0, 1}, 0.1, conductor_material()));
  scene.lights.push_back(cap(0.3));
  EXPECT_NEAR(render_and_measure(by_gauss(scene, 36), LightStrategy::bsdf_only).greatest, albedo * 5 / 18, 1e-6);
}

// From the second diffuse surface on chance has its way: a corner is as paths see it, on the whole.
TEST(Gauss, AgreesWithPathsInACorner) {
  SceneDescription scene = scene_seen({1, 1, 3}, {-0.5, 0.4, 0}, 50, 16, 2048);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 5, diffuse_material(grey(0.8f))));
  scene.patches.push_back(patch({-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 5, diffuse_material({0.7f, 0.3f, 0.3f})));
  scene.balls.push_back(balls({{{0, 0.4, 0}, 0.4}}, diffuse_material(grey(0.5f))));
  LightDescription lamp;
  lamp.kind = Kind::disk;
  lamp.position = {0.5, 3, 0.5};
  lamp.radius = 0.4;
  lamp.radiance = grey(20);
  scene.lights.push_back(lamp);
  const Measured path = render_and_measure(scene);
  const Measured gauss = render_and_measure(by_gauss(scene, 2048));
  EXPECT_NEAR(gauss.mean, path.mean, 4 * std::hypot(gauss.standard_error, path.standard_error));
  EXPECT_LT(gauss.standard_error, 0.005 * path.mean);
}

bool same_light(const Film& a, const Film& b) {
  return std::equal(a.pixels.begin(), a.pixels.end(), b.pixels.begin(), b.pixels.end(),
                    [](const FilmPixel& p, const FilmPixel& q) {
                      return std::memcmp(p.radiance, q.radiance, sizeof p.radiance) == 0;
                    });
}

// What is glossy is left to chance, and so is what it is lit by; so is fog.
TEST(Gauss, LeavesOtherMaterialsAlone) {
  SceneDescription scene = scene_seen({0, 0.5, 3}, {0, 0, 0}, 30, 12, 16);
  MaterialDescription plastic = diffuse_material({0.7f, 0.5f, 0.3f});
  plastic.kind = BsdfKind::plastic;
  scene.balls.push_back(balls({{{0, 0, 0}, 0.8}}, plastic));
  scene.balls.push_back(balls({{{0, -100.8, 0}, 100}}, diffuse_material(grey(0.5f))));
  // No path sees the diffuse ground first.
  scene.camera.vertical_fov = 10;
  EXPECT_TRUE(same_light(render(by_gauss(scene, 16)).film, render(scene).film));
  scene.balls.front() = balls({{{0, 0, 0}, 0.8}}, diffuse_material(grey(0.5f)));
  EXPECT_FALSE(same_light(render(by_gauss(scene, 16)).film, render(scene).film));
}

}  // namespace
}  // namespace embrun

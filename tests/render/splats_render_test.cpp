// Clouds of splats as shapes of a scene: paths, materials, media and colours.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "geometry/splat_clouds.h"
#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

/// The unit sphere of 2,562 splats, larger or moved.
SplatsDescription splat_ball(const MaterialDescription& material, bool closed = true, double scale = 1,
                             Vec3d center = {}) {
  SplatsDescription splats;
  for (const Vec3& p : icosphere(4)) {
    splats.centers.push_back(scale * to_double(p) + center);
    splats.normals.push_back(p);
    splats.radii.push_back(static_cast<float>(0.055 * scale));
  }
  splats.closed = closed;
  splats.material = material;
  return splats;
}

Film picture_of(const SceneDescription& scene) {
  const FlatScene flat = compile(scene);
  const CpuBackend backend(flat);
  Film film = make_film(scene.film);
  render_samples(backend, film, 0, static_cast<std::uint32_t>(scene.integrator.samples));
  return film;
}

/// Root mean square over blocks of 8 x 8 pixels of the difference of two pictures' first channels.
double block_difference(const Film& a, const Film& b) {
  const int width = a.window.width, height = a.window.height;
  double squares = 0;
  for (int y = 0; y < height; y += 8)
    for (int x = 0; x < width; x += 8) {
      double sum = 0;
      for (int j = 0; j < 8; ++j)
        for (int i = 0; i < 8; ++i) {
          const auto k = static_cast<std::size_t>((y + j) * width + x + i);
          sum += a.pixels[k].radiance[0] / a.pixels[k].samples - b.pixels[k].radiance[0] / b.pixels[k].samples;
        }
      squares += sum / 64 * (sum / 64);
    }
  return std::sqrt(squares * 64 / (width * height));
}

TEST(SplatsRender, AConvexDiffuseBodyIsAsBrightAsItsReflectance) {
  // In light of radiance 1 from everywhere every path that meets a convex body leaves it for good: a pixel on it is its
  // reflectance, and what splats shade of each other is missing from it.
  for (const bool closed : {true, false}) {
    SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 14, 24, 64);
    scene.splats.push_back(splat_ball(diffuse_material({0.8f, 0.8f, 0.8f}), closed));
    // Directions drawn from the surface alone find the same light in every sample.
    const Measured m = render_and_measure(scene, LightStrategy::bsdf_only);
    EXPECT_NEAR(m.mean, 0.8, 0.8 * 2e-3) << (closed ? "closed" : "open");
    EXPECT_NEAR(render_and_measure(scene).mean, 0.8, 0.8 * 5e-3) << (closed ? "closed" : "open");
    EXPECT_EQ(m.bad, 0u);
    // To the silhouette.
    scene = scene_seen({0, 0, 6}, {0, 0, 0}, 2 * std::asin(0.98 / 6) * 180 / M_PI / std::sqrt(2.0), 32, 64);
    scene.splats.push_back(splat_ball(diffuse_material({0.8f, 0.8f, 0.8f}), closed));
    const Measured whole = render_and_measure(scene, LightStrategy::bsdf_only);
    EXPECT_NEAR(whole.mean, 0.8, 0.8 * 5e-3) << (closed ? "closed" : "open");
    EXPECT_GT(whole.least, 0.8 * 0.93) << (closed ? "closed" : "open");
  }
}

TEST(SplatsRender, AHollowDiffuseBodySeenFromWithinIsLikeAFurnace) {
  // Inside a sphere whose wall emits nothing and reflects 0.5, with a lamp of radius 0.2 and radiance 1 in the middle, the
  // wall's radiosity is uniform: E = pi L (0.2)^2 + 0.5 E, less what comes back to the black lamp. With the lamp's share of
  // what leaves the wall, F = 0.04: B = 0.5 (pi 0.04 + B (1 - 0.04)), so L = B / pi = 0.5 * 0.04 / (1 - 0.5 * 0.96).
  SplatsDescription room = splat_ball(diffuse_material({0.5f, 0.5f, 0.5f}), false);
  for (Vec3& n : room.normals) n = -n;
  SceneDescription scene = scene_seen({0, 0, 0.5}, {0, 0, 1}, 50, 16, 256);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  LightDescription lamp;
  lamp.kind = LightDescription::Kind::sphere;
  lamp.radius = 0.2;
  scene.lights.push_back(lamp);
  scene.splats.push_back(room);
  const Measured m = render_and_measure(scene);
  const double expected = 0.5 * 0.04 / (1 - 0.5 * 0.96);
  EXPECT_NEAR(m.mean, expected, 4 * m.standard_error + 5e-3 * expected);
}

TEST(SplatsRender, AGlassBallIsThatOfTheSphere) {
  // Glass in light of radiance 1 from everywhere is invisible, whatever its shape: every path gets out again, with the
  // factors of the index cancelled.
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 16, 32, 64);
  scene.splats.push_back(splat_ball(dielectric_material(1.5)));
  const Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, 1, 2e-3);
  EXPECT_LE(m.counters.contradictions, m.counters.paths / 200);
  EXPECT_EQ(m.counters.stuck, 0u);

  // Over a checkerboard it shows the same picture as the ball: the mean over blocks of 8 x 8 pixels.
  SceneDescription on_floor = scene_seen({0, 2, 6}, {0, 0, 0}, 24, 64, 256);
  MaterialDescription checker = diffuse_material({0.8f, 0.8f, 0.8f});
  checker.reflectance.kind = TextureKind::checker;
  checker.reflectance.second = {0.1f, 0.1f, 0.1f};
  on_floor.patches.push_back(patch({0, -1.2, 0}, {1, 0, 0}, {0, 0, -1}, 6, checker));
  SceneDescription with_ball = on_floor;
  with_ball.balls.push_back(balls({{{0, 0, 0}, 1}}, dielectric_material(1.5)));
  const Film ball = picture_of(with_ball);
  double difference[2];
  for (const bool bent : {false, true}) {
    on_floor.splats = {splat_ball(dielectric_material(1.5))};
    on_floor.splats[0].bent_normals = bent;
    difference[bent ? 1 : 0] = block_difference(picture_of(on_floor), ball);
  }
  std::printf("glass ball: root mean square of the blocks' differences %.4f, with bent normals %.4f\n", difference[0],
              difference[1]);
  // Normals that are wrong by a degree bend light by as much; fields of normals follow the sphere.
  EXPECT_LT(difference[0], 0.02);
  EXPECT_LT(difference[1], 0.01);
}

TEST(SplatsRender, AMirrorBallReflectsAllOfTheLight) {
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 16, 32, 32);
  scene.splats.push_back(splat_ball(conductor_material()));
  EXPECT_NEAR(render_and_measure(scene).mean, 1, 1e-3);
}

TEST(SplatsRender, StandInWaterAsBallsDo) {
  // A grey ball half in a box of water, of splats and as it is.
  SceneDescription scene = scene_seen({0, 1.5, 6}, {0, 0, 0}, 28, 32, 256);
  scene.boxes.push_back(box({-2, -2, -2}, {2, 0, 2}, dielectric_material(1.33)));
  SceneDescription with_ball = scene;
  scene.splats.push_back(splat_ball(diffuse_material({0.5f, 0.5f, 0.5f})));
  with_ball.balls.push_back(balls({{{0, 0, 0}, 1}}, diffuse_material({0.5f, 0.5f, 0.5f})));
  const Measured a = render_and_measure(scene), b = render_and_measure(with_ball);
  EXPECT_NEAR(a.mean, b.mean, 4 * std::hypot(a.standard_error, b.standard_error));
  EXPECT_EQ(a.bad, 0u);
}

TEST(SplatsRender, ColoursReachTheMaterial) {
  SplatsDescription splats = splat_ball(diffuse_material({0, 0, 0}));
  splats.material.reflectance.kind = TextureKind::own;
  for (const Vec3d& c : splats.centers)
    splats.colors.push_back(c.x > 0 ? Rgb{0.9f, 0.1f, 0.2f} : Rgb{0.1f, 0.3f, 0.7f});
  SceneDescription scene = scene_seen({0, 0, 6}, {0.5, 0, 0}, 1, 8, 32);
  scene.splats.push_back(splats);
  EXPECT_NEAR(render_and_measure(scene, LightStrategy::bsdf_only, 0).mean, 0.9, 0.003);
  EXPECT_NEAR(render_and_measure(scene, LightStrategy::bsdf_only, 2).mean, 0.2, 0.001);
  scene.camera.target = {-0.5, 0, 0};
  EXPECT_NEAR(render_and_measure(scene, LightStrategy::bsdf_only, 2).mean, 0.7, 0.003);
  // They are asked for only where they are.
  scene.splats[0].colors.clear();
  EXPECT_THROW(compile(scene), std::exception);
}

TEST(SplatsRender, ArePlaced) {
  // An ellipsoid twice as long in x as high, by its placement: its silhouette's area is that of the ellipse.
  SceneDescription scene = scene_seen({0, 0, 200}, {0, 0, 0}, 2 * std::atan(3.0 / 200) * 180 / M_PI, 128, 16);
  scene.splats.push_back(splat_ball(diffuse_material({0, 0, 0}), true, 0.5, {7, 0, 0}));
  scene.splats[0].placement = {{4, 0, 0}, {0, 2, 0}, {0, 0, 2}, {-28, 0, 0}};
  const Measured m = render_and_measure(scene);
  // Black before radiance 1.
  EXPECT_NEAR((1 - m.mean) * 36, M_PI * 2 * 1, 0.01 * M_PI * 2);
}

TEST(SplatsRender, FarFromTheOriginTheyAreTheSame) {
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 22, 24, 16);
  scene.splats.push_back(splat_ball(diffuse_material({0.6f, 0.6f, 0.6f})));
  const Measured here = render_and_measure(scene);
  const Vec3d far{1e6, -2e6, 5e5};
  for (Vec3d& c : scene.splats[0].centers) c = c + far;
  scene.camera.eye = scene.camera.eye + far;
  scene.camera.target = scene.camera.target + far;
  EXPECT_NEAR(render_and_measure(scene).mean, here.mean, 1e-3);
}

TEST(SplatsRender, LevelsOfDetailShowTheSamePicture) {
  // A bumpy, striped ball of 163,842 splats in 48 x 48 pixels: 70 splats a pixel. With levels of detail the picture is
  // within 1 % of that of all splats: the mean difference over the mean of the ball's pixels.
  SplatsDescription ball;
  for (const Vec3& p : icosphere(7)) {
    const Vec3 across{5, 3, -4};
    const float angle = dot(across, p), radius = 1 + 0.05f * std::sin(angle);
    // The gradient of |x| - radius(x / |x|).
    const Vec3 slope = (0.05f * std::cos(angle)) * (across - dot(across, p) * p);
    ball.centers.push_back(to_double(radius * p));
    ball.normals.push_back(normalize(p - (1 / radius) * slope));
    ball.radii.push_back(0.0085f);
    ball.colors.push_back({0.5f + 0.3f * std::sin(9 * p.y), 0.5f, 0.5f + 0.3f * std::sin(7 * p.x)});
  }
  ball.closed = true;
  ball.material = diffuse_material({0, 0, 0});
  ball.material.reflectance.kind = TextureKind::own;
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 24, 48, 256);
  scene.patches.push_back(patch({0, -1.1, 0}, {1, 0, 0}, {0, 0, -1}, 3, diffuse_material({0.5f, 0.5f, 0.5f})));
  scene.splats.push_back(ball);
  const Film exact = picture_of(scene);
  double last = 0;
  for (const double detail : {1.0, 4.0}) {
    scene.splats[0].detail = detail;
    const Film film = picture_of(scene);
    double difference = 0, sum = 0;
    for (std::size_t i = 0; i < film.pixels.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        const double a = film.pixels[i].radiance[c] / film.pixels[i].samples;
        const double b = exact.pixels[i].radiance[c] / exact.pixels[i].samples;
        difference += std::fabs(a - b);
        const double x = static_cast<double>(i % 48) - 23.5, y = static_cast<double>(i / 48) - 23.5;
        if (std::hypot(x, y) < 18) sum += b;
      }
    std::printf("levels of detail, %g pixels: mean difference %.3f %%\n", detail, 100 * difference / sum);
    if (detail == 1) {
      EXPECT_LT(difference, 0.01 * sum);
      EXPECT_GT(difference, 0);
    } else {
      EXPECT_GT(difference, last);
    }
    last = difference;
  }
}

TEST(SplatsRender, WhatCannotBeIsRefused) {
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 22, 8, 1);
  scene.splats.push_back(splat_ball(dielectric_material(1.5), false));
  EXPECT_THROW(compile(scene), std::exception);
  scene.splats[0] = splat_ball(diffuse_material({0.5f, 0.5f, 0.5f}));
  scene.splats[0].radii.pop_back();
  EXPECT_THROW(compile(scene), std::exception);
  scene.splats[0] = splat_ball(diffuse_material({0.5f, 0.5f, 0.5f}));
  scene.splats[0].normals[3] = {0, 0, 0};
  EXPECT_THROW(compile(scene), std::exception);
  scene.splats[0] = SplatsDescription{};
  EXPECT_THROW(compile(scene), std::exception);
}

/// The same points as a moving least squares surface. It lies 5/72 h^2 / R within the sphere, which `grown` makes good.
SplatsDescription mls_ball(const MaterialDescription& material, bool closed = true) {
  const double h = 0.22, grown = 1 / (1 - 5.0 / 72 * h * h);
  SplatsDescription ball = splat_ball(material, closed, grown);
  ball.surface = CloudSurface::mls;
  ball.mls_support = 4;
  return ball;
}

TEST(MlsRender, ABallIsThatOfTheSphere) {
  // Diffuse and of glass, over a checkerboard, beside the ball itself.
  SceneDescription on_floor = scene_seen({0, 2, 6}, {0, 0, 0}, 24, 48, 64);
  MaterialDescription checker = diffuse_material({0.8f, 0.8f, 0.8f});
  checker.reflectance.kind = TextureKind::checker;
  checker.reflectance.second = {0.1f, 0.1f, 0.1f};
  on_floor.patches.push_back(patch({0, -1.2, 0}, {1, 0, 0}, {0, 0, -1}, 6, checker));
  for (const MaterialDescription& material : {diffuse_material({0.8f, 0.8f, 0.8f}), dielectric_material(1.5)}) {
    SceneDescription with_ball = on_floor, with_mls = on_floor;
    with_ball.balls.push_back(balls({{{0, 0, 0}, 1}}, material));
    with_mls.splats = {mls_ball(material)};
    const double difference = block_difference(picture_of(with_mls), picture_of(with_ball));
    std::printf("root mean square of the blocks' differences %.4f\n", difference);
    EXPECT_LT(difference, 0.005);
  }
}

TEST(MlsRender, LightIsNeitherLostNorMade) {
  // In light of radiance 1 from everywhere a convex diffuse body is its reflectance, glass and mirrors are invisible: see above.
  for (const bool closed : {true, false}) {
    SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 14, 24, 64);
    scene.splats.push_back(mls_ball(diffuse_material({0.8f, 0.8f, 0.8f}), closed));
    const Measured m = render_and_measure(scene, LightStrategy::bsdf_only);
    EXPECT_NEAR(m.mean, 0.8, 0.8 * 1e-3) << (closed ? "closed" : "open");
    EXPECT_NEAR(m.least, 0.8, 0.8 * 1e-2) << (closed ? "closed" : "open");
  }
  for (const MaterialDescription& material : {dielectric_material(1.5), conductor_material()}) {
    SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 16, 32, 64);
    scene.splats.push_back(mls_ball(material));
    const Measured m = render_and_measure(scene);
    EXPECT_NEAR(m.mean, 1, 2e-3);
    EXPECT_LE(m.counters.contradictions, m.counters.paths / 1000);
    EXPECT_EQ(m.counters.stuck, 0u);
  }
}

TEST(MlsRender, PlacedAndColouredTheyAreTheSameOnAnyNumberOfThreads) {
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 22, 32, 16);
  SplatsDescription ball = mls_ball(diffuse_material({0, 0, 0}));
  ball.material.reflectance.kind = TextureKind::own;
  for (const Vec3d& c : ball.centers) ball.colors.push_back(c.x > 0 ? Rgb{0.9f, 0.1f, 0.2f} : Rgb{0.1f, 0.3f, 0.7f});
  scene.splats.push_back(ball);
  RenderControl control;
  control.threads = 1;
  const Film one = render(scene, control).film;
  control.threads = 3;
  const Film three = render(scene, control).film;
  for (std::size_t i = 0; i < one.pixels.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(one.pixels[i].radiance[c], three.pixels[i].radiance[c]);
  // Twice the points' distances at half the size is the same body.
  for (Vec3d& c : scene.splats[0].centers) c = 2 * c;
  for (float& r : scene.splats[0].radii) r *= 2;
  scene.splats[0].placement.x_axis = {0.5, 0, 0};
  scene.splats[0].placement.y_axis = {0, 0.5, 0};
  scene.splats[0].placement.z_axis = {0, 0, 0.5};
  EXPECT_LT(block_difference(render(scene, control).film, one), 2e-3);
}

TEST(MlsRender, WhatCannotBeIsRefused) {
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, 22, 8, 1);
  scene.splats.push_back(mls_ball(diffuse_material({0.5f, 0.5f, 0.5f})));
  EXPECT_NO_THROW(compile(scene));
  scene.splats[0].mls_support = 0.5;
  EXPECT_THROW(compile(scene), std::exception);
  scene.splats[0].mls_support = 4;
  scene.splats[0].bent_normals = true;
  EXPECT_THROW(compile(scene), std::exception);
}

}  // namespace
}  // namespace embrun

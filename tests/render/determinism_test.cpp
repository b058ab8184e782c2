#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

/// A bit of everything: fluid, ball, floor, lamp, environment; more tiles than threads, and no multiple of them.
SceneDescription mixed_scene() {
  SceneDescription scene = scene_seen({1.7, 1.1, 2.6}, {0, 0, 0}, 45, 50, 5);
  scene.film.width = 70;
  scene.integrator.sampler = SamplerKind::sobol;
  scene.integrator.max_depth = 16;
  scene.fluids.push_back(lattice_fluid({-0.6, -0.4, -0.6}, {0.3, 0.3, 0.6}, 0.15, 2));
  scene.balls.push_back(balls({{{0.6, -0.2, 0.2}, 0.2}}, diffuse_material({0.7f, 0.5f, 0.3f})));
  scene.patches.push_back(patch({0, -0.4, 0}, {1, 0, 0}, {0, 0, -1}, 3, diffuse_material(grey(0.5f))));
  LightDescription lamp;
  lamp.kind = LightDescription::Kind::sphere;
  lamp.position = {1, 2, 1};
  lamp.radius = 0.3;
  lamp.radiance = grey(10);
  scene.lights.push_back(lamp);
  scene.environment.constant = grey(0.3f);
  return scene;
}

/// All members are equal, to the last bit; what follows the last one is padding.
bool same_bits(const FilmPixel& a, const FilmPixel& b) {
  return std::memcmp(&a, &b, offsetof(FilmPixel, bad_samples) + sizeof a.bad_samples) == 0;
}

bool same_bits(const Film& a, const Film& b) {
  return std::equal(a.pixels.begin(), a.pixels.end(), b.pixels.begin(), b.pixels.end(),
                    [](const FilmPixel& p, const FilmPixel& q) { return same_bits(p, q); });
}

TEST(Determinism, TheSameBitsOnAnyNumberOfThreads) {
  const SceneDescription scene = mixed_scene();
  RenderControl control;
  control.threads = 1;
  const RenderResult one = render(scene, control);
  for (const int threads : {2, 7}) {
    control.threads = threads;
    const RenderResult many = render(scene, control);
    EXPECT_TRUE(same_bits(one.film, many.film)) << threads << " threads";
    EXPECT_EQ(one.counts.paths.scatterings, many.counts.paths.scatterings);
  }
  SceneDescription other = scene;
  other.integrator.seed = 1;
  EXPECT_FALSE(same_bits(one.film, render(other, control).film)) << "the seed does nothing";
}

TEST(Determinism, OfTheOtherIntegratorsToo) {
  for (const IntegratorKind kind :
       {IntegratorKind::whitted, IntegratorKind::ambient_occlusion, IntegratorKind::gauss}) {
    SceneDescription scene = mixed_scene();
    scene.integrator.kind = kind;
    RenderControl control;
    control.threads = 1;
    const RenderResult one = render(scene, control);
    for (const int threads : {2, 7}) {
      control.threads = threads;
      EXPECT_TRUE(same_bits(one.film, render(scene, control).film)) << threads << " threads";
    }
    scene.integrator.kind = IntegratorKind::path;
    EXPECT_FALSE(same_bits(one.film, render(scene, control).film)) << "the integrator does nothing";
  }
}

TEST(Determinism, TheSameBitsHoweverTheSamplesAreDivided) {
  const SceneDescription scene = mixed_scene();
  const RenderResult whole = render(scene);
  const FlatScene flat = compile(scene);
  const CpuBackend backend(flat);
  Film film = make_film(scene.film);
  backend.render_samples(film, 0, 2);
  backend.render_samples(film, 2, 1);
  backend.render_samples(film, 3, 2);
  EXPECT_TRUE(same_bits(whole.film, film));
}

TEST(Determinism, ACropIsAPieceOfThePicture) {
  SceneDescription scene = mixed_scene();
  const RenderResult whole = render(scene);
  scene.film.crop = PixelWindow{21, 9, 30, 23};
  const RenderResult part = render(scene);
  for (int y = 9; y < 32; ++y)
    for (int x = 21; x < 51; ++x)
      ASSERT_TRUE(
          same_bits(whole.film.pixels[whole.film.pixel_index(x, y)], part.film.pixels[part.film.pixel_index(x, y)]))
          << x << "," << y;
}

TEST(Determinism, ASampleCanBeReplayedAlone) {
  SceneDescription scene = mixed_scene();
  scene.film.crop = PixelWindow{40, 30, 1, 1};
  const FlatScene flat = compile(scene);
  const CpuBackend backend(flat);
  Film all = make_film(scene.film), alone = make_film(scene.film);
  backend.render_samples(all, 0, 4);
  double sum = 0;
  for (std::uint32_t i = 0; i < 4; ++i) {
    Film one = make_film(scene.film);
    backend.render_samples(one, i, 1);
    sum += one.pixels[0].radiance[0];
  }
  EXPECT_EQ(all.pixels[0].radiance[0], sum);
}

TEST(Cancel, KeepsWhatThereIs) {
  SceneDescription scene = mixed_scene();
  scene.integrator.samples = 1000000;
  std::atomic<bool> cancel{false};
  RenderControl control;
  control.cancel = &cancel;
  control.progress = [&](std::uint64_t done, std::uint64_t total) {
    EXPECT_EQ(total, 70u * 50u * 1000000u);
    if (done > 3500) cancel = true;
  };
  const RenderResult result = render(scene, control);
  EXPECT_TRUE(result.counts.cancelled);
  EXPECT_GE(good_samples(result.film), 3500u);
  EXPECT_LT(good_samples(result.film), 70u * 50u * 100000u);
  const ImageLayers layers = resolve(result.film);
  for (const float v : layers.layer("beauty").pixels) ASSERT_TRUE(std::isfinite(v));
}

}  // namespace
}  // namespace embrun

// Learning where light comes from changes the noise under water, not the mean.

#include <gtest/gtest.h>

#include "image/metrics.h"
#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

/// A floor under water, lit by a sky with a sun. `size` pixels.
SceneDescription bottom_of_a_pool(int size, int samples) {
  SceneDescription scene = scene_seen({0.5, 2.5, 1.5}, {0, -0.5, 0}, 30, size, samples);
  scene.environment.kind = EnvironmentDescription::Kind::sky;
  scene.boxes.push_back(box({-2, -0.8, -2}, {2, 0, 2}, dielectric_material(1.33, {0.3f, 0.05f, 0.01f})));
  scene.patches.push_back(patch({0, -0.5, 0}, {1, 0, 0}, {0, 0, -1}, 20, diffuse_material(grey(0.5f))));
  scene.integrator.max_depth = 64;
  return scene;
}

TEST(Guide, KeepsTheMeanAndLowersTheNoise) {
  SceneDescription scene = bottom_of_a_pool(96, 40);
  const Measured guided = render_and_measure(scene);
  scene.integrator.guide = false;
  const Measured plain = render_and_measure(scene);
  EXPECT_NEAR(guided.mean, plain.mean, 4 * std::hypot(guided.standard_error, plain.standard_error));
  EXPECT_LT(guided.standard_error, 0.5 * plain.standard_error);
  EXPECT_LT(plain.standard_error, 0.02 * plain.mean);
}

// Reflection by the water, shadow and light through a ball, all three ways of sampling lights.
TEST(Guide, KeepsTheMeanHoweverLightsAreSampled) {
  SceneDescription scene = bottom_of_a_pool(64, 90);
  scene.boxes.clear();
  scene.balls.push_back(balls({{{0, 0.1, 0}, 0.5}}, dielectric_material(1.33)));
  scene.integrator.guide = false;
  const Measured plain = render_and_measure(scene);
  scene.integrator.guide = true;
  for (const LightStrategy strategy : {LightStrategy::mis, LightStrategy::bsdf_only}) {
    const Measured guided = render_and_measure(scene, strategy);
    EXPECT_NEAR(guided.mean, plain.mean, 4 * std::hypot(guided.standard_error, plain.standard_error));
  }
}

TEST(Guide, IsNotLearntWhereItIsOfNoUse) {
  SceneDescription white = bottom_of_a_pool(4, 1);
  white.environment.kind = EnvironmentDescription::Kind::constant;
  SceneDescription dry = bottom_of_a_pool(4, 1);
  dry.boxes.clear();
  for (const SceneDescription& scene : {white, dry}) {
    const FlatScene flat = compile(scene);
    EXPECT_EQ(CpuBackend(flat).path_scene().guide.share, 0.0f);
  }
  const FlatScene flat = compile(bottom_of_a_pool(4, 1));
  EXPECT_GT(CpuBackend(flat).path_scene().guide.share, 0.0f);
}

TEST(Guide, IsTheSameOnAnyNumberOfThreads) {
  const FlatScene flat = compile(bottom_of_a_pool(32, 1));
  std::vector<float> tables[2];
  for (const int threads : {1, 5}) {
    run_on_threads(threads, [&] {
      const CpuBackend backend(flat);
      for (const Distribution2D& cells : backend.path_scene().guide.cells)
        for (int y = 0; y < guide_rows; ++y)
          for (int x = 0; x < guide_columns; ++x) tables[threads > 1].push_back(cell_probability(cells, x, y));
    });
  }
  EXPECT_EQ(tables[0], tables[1]);
}

}  // namespace
}  // namespace embrun

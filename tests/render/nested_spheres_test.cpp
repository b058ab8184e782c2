// A picture by two independent renderers of media in media: tests/data/nested_spheres/README.md.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

#include "image/metrics.h"
#include "io/image_read.h"
#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

const std::string folder = std::string(EMBRUN_TEST_DATA_DIR) + "/nested_spheres/";

/// The reference's scene at an eighth of its resolution: with a box filter, a pixel is a block of its pixels.
SceneDescription nested_spheres() {
  SceneDescription scene = scene_seen({2.4, 2.4, 4.9}, {0, 0.38, 0}, 32, 64, 512);
  scene.integrator.max_depth = 64;
  scene.boxes.push_back(box({-1, 0, -1}, {1, 1, 1}, dielectric_material(1.33, {}, 1)));
  BallsDescription bubbles, solid;
  bubbles.material = dielectric_material(1, {}, 2);
  solid.material = diffuse_material(grey(0.3f));
  std::ifstream file(folder + "balls.csv");
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    for (char& c : line) c = c == ',' ? ' ' : c;
    std::istringstream words(line);
    std::string kind;
    BallDescription ball;
    words >> kind >> ball.center.x >> ball.center.y >> ball.center.z >> ball.radius;
    (kind == "bubble" ? bubbles : solid).balls.push_back(ball);
  }
  EXPECT_EQ(bubbles.balls.size(), 24u);
  EXPECT_EQ(solid.balls.size(), 24u);
  scene.balls = {bubbles, solid};
  PatchDescription floor = patch({0, -0.05, 0}, {1, 0, 0}, {0, 0, -1}, 4, diffuse_material(grey(0.8f)));
  floor.material.one_sided = true;
  floor.material.reflectance.kind = TextureKind::checker;
  floor.material.reflectance.second = grey(0.2f);
  floor.material.reflectance.cell = 0.25;
  scene.patches.push_back(floor);
  return scene;
}

TEST(NestedSpheres, AgreeWithIndependentRenderers) {
  const RenderResult result = render(nested_spheres());
  const Measured m = measure(result.film);
  EXPECT_EQ(result.counts.paths.contradictions, 0u);
  EXPECT_EQ(m.bad, 0u);

  const Image reference = read_image(folder + "reference.pfm");
  const double expected = mean_value(reference);
  EXPECT_NEAR(m.mean, expected, 0.001 * expected);

  // Every pixel against its block, in grey.
  const Image& beauty = result.layers.layer("beauty");
  const Image& variance = result.layers.layer("variance");
  EXPECT_LT(std::sqrt(mean_value(variance)) / 64, 0.0004 * expected) << "too few samples to tell";
  int within = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const double noise = std::sqrt(static_cast<double>(variance.at(x, y)) + 0.0026 * 0.0026);
      const double difference = std::abs(static_cast<double>(beauty.at(x, y) - reference.at(x, y)));
      within += difference <= 0.025 * static_cast<double>(reference.at(x, y)) + 2 * noise;
    }
  EXPECT_GE(within, 0.95 * 64 * 64);
}

}  // namespace
}  // namespace embrun

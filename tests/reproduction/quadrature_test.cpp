// The numbers of the comparison of quadrature and chance, and that its box is the bundled one.

#include "reproduction/quadrature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "io/read_scene.h"

namespace embrun {
namespace {

Image noisy(float mean, double deviation, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, deviation);
  Image image = make_image(128, 128, 3);
  for (float& v : image.pixels) v = mean + static_cast<float>(normal(random));
  return image;
}

// A picture off by 0.1 with noise of deviation 0.3: 0.01 + 0.09 in pixels, 0.01 + 0.09 / 64 in blocks, however noisy the
// references are; together with another such picture 0.01. Each sum is of 49,152 pixels or 768 blocks.
TEST(ProductErrors, LeaveOutTheNoiseOfReferences) {
  const Image a = noisy(1.1f, 0.3, 1), b = noisy(1.1f, 0.3, 2), first = noisy(1, 0.2, 3), second = noisy(1, 0.2, 4);
  const PictureErrors own = product_errors(a, a, first, second);
  EXPECT_NEAR(own.pixel, 0.1, 0.004);
  EXPECT_NEAR(own.block, 0.01 + 0.09 / 64, 0.001);
  const PictureErrors shared = product_errors(a, b, first, second);
  EXPECT_NEAR(shared.pixel, 0.01, 0.003);
  EXPECT_NEAR(shared.block, 0.01, 0.001);
}

void expect_near(Vec3d a, Vec3d b, const char* what, std::size_t i) {
  EXPECT_NEAR(length(a - b), 0, 1e-9) << what << " of patch " << i;
}

TEST(CornellBox, IsThatOfTheSceneFile) {
  const std::string data = EMBRUN_DATA_DIR;
  const SceneDescription file =
      read_scene(data + "/cornell_bunny.xml", {{"bunny", data + "/duck.ply"}, {"as", "splats"}}).scene;
  const SceneDescription box = cornell_box(file.splats.front(), file.film.width);
  EXPECT_EQ(box.film, file.film);
  EXPECT_EQ(box.environment.kind, file.environment.kind);
  EXPECT_EQ(box.integrator.max_depth, file.integrator.max_depth);
  EXPECT_EQ(box.integrator.roulette_depth, file.integrator.roulette_depth);
  expect_near(box.camera.eye, file.camera.eye, "eye", 0);
  EXPECT_NEAR(box.camera.vertical_fov, file.camera.vertical_fov, 1e-9);
  ASSERT_EQ(box.splats.size(), 1u);
  EXPECT_EQ(box.splats.front().material, file.splats.front().material);
  ASSERT_EQ(box.patches.size(), file.patches.size());
  for (std::size_t i = 0; i < box.patches.size(); ++i) {
    const PatchDescription &ours = box.patches[i], &theirs = file.patches[i];
    expect_near(ours.center, theirs.center, "middle", i);
    expect_near(normalize(ours.axis_u), normalize(theirs.axis_u), "axis u", i);
    expect_near(normalize(ours.axis_v), normalize(theirs.axis_v), "axis v", i);
    EXPECT_NEAR(ours.half_u, theirs.half_u, 1e-9) << i;
    EXPECT_NEAR(ours.half_v, theirs.half_v, 1e-9) << i;
    EXPECT_EQ(ours.radiance, theirs.radiance) << i;
    EXPECT_EQ(ours.material.reflectance, theirs.material.reflectance) << i;
  }
}

}  // namespace
}  // namespace embrun

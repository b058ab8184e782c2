// The Cornell box with the bunny [Beddiaf2018], figure 40, as an independent renderer sees its mesh
// (tests/data/reference/README.md), and with the splats of its points in the mesh's place.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "image/metrics.h"
#include "image/tone_curve.h"
#include "io/image_read.h"
#include "io/read_scene.h"
#include "render/render_loop.h"

namespace embrun {
namespace {

constexpr int side = 128;

/// A file in the folder that EMBRUN_CLOUD_DATA names, or nothing.
std::string scan_named(const std::string& name) {
  const char* folder = std::getenv("EMBRUN_CLOUD_DATA");
  const std::string path = folder == nullptr ? "" : std::string(folder) + "/" + name;
  return std::filesystem::exists(path) ? path : "";
}

/// The box with a bunny from a file, at a quarter of the reference's resolution: a pixel is four by four of its pixels.
SceneDescription box_with(const std::string& file, const std::string& shape, int samples) {
  SceneDescription scene =
      read_scene(std::string(EMBRUN_DATA_DIR) + "/cornell_bunny.xml", {{"bunny", file}, {"as", shape}}).scene;
  scene.film.width = scene.film.height = side;
  scene.integrator.samples = samples;
  return scene;
}

Image channel_of(const Image& colour, int channel) {
  Image one = make_image(colour.width, colour.height, 1);
  for (std::size_t i = 0; i < one.pixels.size(); ++i)
    one.pixels[i] = colour.pixels[3 * i + static_cast<std::size_t>(channel)];
  return one;
}

TEST(CornellBox, WithTheBunnysMesh) {
  const std::string mesh = scan_named("bunny_mesh.ply");
  if (mesh.empty()) GTEST_SKIP() << "EMBRUN_CLOUD_DATA names no folder with bunny_mesh.ply";
  const RenderResult result = render(box_with(mesh, "ply", 256));
  const Image beauty = result.layers.layer("beauty"), variance = result.layers.layer("variance");
  const Image reference = read_image(std::string(EMBRUN_TEST_DATA_DIR) + "/reference/cornell_bunny_mitsuba.pfm");
  ASSERT_EQ(beauty.width, reference.width);
  // The standard error of the reference's full pixels, 0.008, is the mean over the channels, which it follows.
  const double reference_mean = mean_value(reference);
  for (int c = 0; c < 3; ++c) {
    const Image ours = channel_of(beauty, c), theirs = channel_of(reference, c), noise = channel_of(variance, c);
    EXPECT_NEAR(mean_value(ours) / mean_value(theirs), 1, 0.002) << "channel " << c;
    Image reference_noise = make_image(side, side, 1);
    const double error = 0.008 * mean_value(theirs) / reference_mean;
    for (float& v : reference_noise.pixels) v = static_cast<float>(error * error / 16);
    // Blocks of 2 x 2 are 8 x 8 pixels of the full picture.
    EXPECT_GE(share_within(compare_blocks(ours, theirs, &noise, &reference_noise, 2), 0.01, 2.0), 0.95)
        << "channel " << c;
  }
}

/// Pixels that show anything else than the empty box in either picture, or that touch one that does.
std::vector<bool> silhouette(const Image& a, const Image& b, const Image& empty) {
  std::vector<bool> marked(static_cast<std::size_t>(side * side));
  const auto differs = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= side || y >= side) return false;
    const auto i = static_cast<std::size_t>(y * side + x);
    const float away = 1e-3f * empty.pixels[i];
    return std::fabs(a.pixels[i] - empty.pixels[i]) > away || std::fabs(b.pixels[i] - empty.pixels[i]) > away;
  };
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
          if (differs(x + i, y + j)) marked[static_cast<std::size_t>(y * side + x)] = true;
  return marked;
}

TEST(CornellBox, WithTheBunnysSplatsInPlaceOfTheMesh) {
  const std::string mesh = scan_named("bunny_mesh.ply"), points = scan_named("bunny_35947.ply");
  if (mesh.empty() || points.empty())
    GTEST_SKIP() << "EMBRUN_CLOUD_DATA names no folder with bunny_mesh.ply and bunny_35947.ply";
  const RenderResult with_mesh = render(box_with(mesh, "ply", 256));
  const RenderResult with_splats = render(box_with(points, "splats", 256));
  SceneDescription empty = box_with(mesh, "ply", 256);
  empty.integrator.max_depth = 1;
  empty.meshes.clear();
  const Image nothing = render(empty).layers.layer("depth");
  const std::vector<bool> inside =
      silhouette(with_mesh.layers.layer("depth"), with_splats.layers.layer("depth"), nothing);

  const ToneSettings tone{0, ToneCurve::srgb, false};
  const Image a = display_values(with_mesh.layers.layer("beauty"), tone);
  const Image b = display_values(with_splats.layers.layer("beauty"), tone);
  double squares = 0, pixels = 0, within = 0;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    if (inside[i]) {
      ++within;
      continue;
    }
    for (std::size_t c = 0; c < 3; ++c) squares += std::pow(double{a.pixels[3 * i + c]} - b.pixels[3 * i + c], 2) / 3;
    ++pixels;
  }
  EXPECT_LE(squares / pixels, 2e-4);
  // The bunny takes up some of the picture.
  EXPECT_GT(within, 0.05 * side * side);
  EXPECT_LT(within, 0.4 * side * side);
}

}  // namespace
}  // namespace embrun

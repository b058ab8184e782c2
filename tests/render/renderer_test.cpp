// The public face, as a program that links the library uses it.

#include <embrun/embrun.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace embrun {
namespace {

Particles block_of_water() {
  Particles particles;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (int k = 0; k < 6; ++k) particles.positions.push_back({0.1 * i, 0.1 * j, 0.1 * k});
  return particles;
}

RenderOptions small() {
  RenderOptions options;
  options.width = 24;
  options.height = 16;
  options.samples = 4;
  options.order = 2;
  return options;
}

TEST(Face, RendersParticlesInMemory) {
  RenderReport report;
  const Picture picture = render(block_of_water(), small(), {}, &report);
  EXPECT_EQ(picture.width, 24);
  EXPECT_EQ(picture.height, 16);
  ASSERT_EQ(picture.layers.size(), 6u);
  EXPECT_EQ(picture.layers[0].name, "beauty");
  ASSERT_EQ(picture.layers[0].values.size(), 24u * 16u * 3u);
  double sum = 0;
  for (const float v : picture.layers[0].values) {
    ASSERT_TRUE(std::isfinite(v) && v >= 0);
    sum += v;
  }
  EXPECT_GT(sum, 0);
  EXPECT_EQ(report.particles, 216u);
  EXPECT_EQ(report.radius_source, "spacing");
  EXPECT_EQ(report.samples_done, 24u * 16u * 4u);
  EXPECT_EQ(report.bad_samples, 0u);
  EXPECT_EQ(report.medium_contradictions, 0u);
  EXPECT_NO_THROW(nlohmann::json::parse(to_json(report)));
  EXPECT_NE(to_text(report).find("216"), std::string::npos);
}

TEST(Face, AddsSamplesToARenderUnderWay) {
  Renderer renderer(block_of_water(), small());
  EXPECT_TRUE(renderer.add_samples(1));
  EXPECT_TRUE(renderer.add_samples(3));
  const Picture steps = renderer.picture();
  const Picture once = render(block_of_water(), small());
  EXPECT_EQ(steps.layers[0].values, once.layers[0].values);
  EXPECT_EQ(renderer.report().samples, 4);
}

TEST(Face, TellsItsProgress) {
  std::vector<std::string> stages;
  double fraction = 0;
  RenderHooks hooks;
  hooks.progress = [&](const Progress& p) {
    if (stages.empty() || stages.back() != p.stage) {
      stages.emplace_back(p.stage);
      fraction = 0;
    }
    EXPECT_GE(p.fraction, fraction);
    EXPECT_LE(p.fraction, 1);
    fraction = p.fraction;
  };
  const std::string file = ::testing::TempDir() + "face_progress.pfm";
  const std::string particles = ::testing::TempDir() + "face_progress.xyz";
  write_text_file(particles, "0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n");
  const RenderReport report = render_file(particles, file, small(), hooks);
  EXPECT_EQ(stages, (std::vector<std::string>{"reading", "building", "rendering", "writing"}));
  EXPECT_EQ(fraction, 1);
  EXPECT_EQ(report.particles, 4u);
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_NE(describe_file(particles, false).find("4"), std::string::npos);
}

TEST(Face, ARenderCancelledFromTheStartWritesNothing) {
  const std::string file = ::testing::TempDir() + "face_cancelled.pfm";
  const std::string particles = ::testing::TempDir() + "face_cancelled.xyz";
  std::filesystem::remove(file);
  write_text_file(particles, "0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n");
  const std::atomic<bool> cancel{true};
  RenderHooks hooks;
  hooks.cancel = &cancel;
  const RenderReport report = render_file(particles, file, small(), hooks);
  EXPECT_TRUE(report.cancelled);
  EXPECT_EQ(report.samples_done, 0u);
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(Face, MistakesAreRuntimeErrors) {
  EXPECT_THROW(render(Particles{}, small()), std::runtime_error);
  Particles uneven = block_of_water();
  uneven.radii = {1};
  EXPECT_THROW(render(uneven, small()), std::runtime_error);
  Particles wild = block_of_water();
  wild.positions[3][1] = std::nan("");
  EXPECT_THROW(render(wild, small()), std::runtime_error);
  RenderOptions options = small();
  options.kernel = "box";
  EXPECT_THROW(render(block_of_water(), options), std::runtime_error);
  EXPECT_THROW(render_file("no such file", "x.png", small()), std::runtime_error);
  EXPECT_THROW(check_output("x.docx", small()), std::runtime_error);
}

// Two particles sizes: each keeps its own.
TEST(Face, RadiiMayDiffer) {
  Particles particles = block_of_water();
  particles.radii.assign(particles.positions.size(), 0.05f);
  particles.positions.push_back({0.2, 0.9, 0.2});
  particles.radii.push_back(0.02f);
  RenderReport report;
  render(particles, small(), {}, &report);
  EXPECT_EQ(report.radius_source, "file");
  EXPECT_EQ(report.pinning_flags.find("--radius"), std::string::npos);  // one radius would not do
}

}  // namespace
}  // namespace embrun

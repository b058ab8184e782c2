// Levels of detail of fluids, as a program that links the library gets them.

#include <embrun/embrun.h>
#include <gtest/gtest.h>

#include <cmath>

namespace embrun {
namespace {

/// Waves on a pool, 30 x 10 x 30 particles, with some drops above.
Particles pool() {
  Particles particles;
  for (int i = 0; i < 30; ++i)
    for (int j = 0; j < 10; ++j)
      for (int k = 0; k < 30; ++k)
        particles.positions.push_back({0.1 * i, 0.1 * j + 0.05 * std::sin(0.7 * i) * j / 9, 0.1 * k});
  for (int i = 0; i < 8; ++i) particles.positions.push_back({0.35 * i, 1.4, 0.2 + 0.3 * i});
  return particles;
}

RenderOptions seen_from(double distance) {
  RenderOptions options;
  options.width = 32;
  options.height = 24;
  options.samples = 64;
  options.radius = 0.05;
  options.max_depth = 16;
  options.camera_to = Point{1.5, 0.5, 1.5};
  options.camera_from = Point{1.5 + 0.6 * distance, 0.5 + 0.5 * distance, 1.5 + 0.6 * distance};
  options.fov = 180 / 3.14159265358979 * 2 * std::atan(2.6 / distance);
  return options;
}

std::string notes_of(const RenderReport& report) {
  std::string all;
  for (const std::string& note : report.notes) all += note + "\n";
  return all;
}

double mean_of(const Picture& picture) {
  double sum = 0;
  for (const float v : picture.layers[0].values) sum += v;
  return sum / static_cast<double>(picture.layers[0].values.size());
}

TEST(FluidLevels, WhereParticlesAreLargerThanPixelsNothingChanges) {
  RenderOptions options = seen_from(6);
  options.samples = 4;
  const Picture fine = render(pool(), options);
  options.lod = 0.1;
  RenderReport report;
  const Picture same = render(pool(), options, {}, &report);
  EXPECT_EQ(fine.layers[0].values, same.layers[0].values);
  EXPECT_NE(notes_of(report).find("levels of detail: the particles' own\n"), std::string::npos) << notes_of(report);
}

TEST(FluidLevels, FarWaterLooksTheSame) {
  // 1.4 pixels are 0.3 m at the pool: between two spacings of 0.1 m and four.
  RenderOptions options = seen_from(20);
  RenderReport fine_report, report;
  const double fine = mean_of(render(pool(), options, {}, &fine_report));
  options.lod = 1.4;
  options.seed = 1;
  const Picture coarse = render(pool(), options, {}, &report);
  EXPECT_NEAR(mean_of(coarse) / fine, 1, 0.02);
  EXPECT_NE(notes_of(report).find("levels of detail: cells of 0.2"), std::string::npos) << notes_of(report);
  EXPECT_EQ(report.medium_contradictions, 0u);
  EXPECT_EQ(report.bad_samples, 0u);
  // What pins the choices of a frame is told without the particles' own surface, too.
  EXPECT_EQ(report.threshold, fine_report.threshold);
  EXPECT_EQ(report.influence_radius, fine_report.influence_radius);
  EXPECT_GE(report.recovered, 8u);
  EXPECT_GT(report.surface_bytes, 0);
  EXPECT_LT(report.surface_bytes, 0.5 * fine_report.surface_bytes);
  options.threads = 1;
  EXPECT_EQ(render(pool(), options).layers[0].values, coarse.layers[0].values);
}

TEST(FluidLevels, ClearWaterOfAnyLevelIsInvisibleInAWhiteRoom) {
  // The furnace: without absorption, in a constant environment, all of it is white at any number of bounces.
  RenderOptions options = seen_from(20);
  options.samples = 16;
  options.environment = "white";
  options.floor = "none";
  options.absorption = Color{0, 0, 0};
  options.max_depth = 4096;
  for (const double pixels : {1.0, 2.0, 4.0}) {
    options.lod = pixels;
    RenderReport report;
    const Picture picture = render(pool(), options, {}, &report);
    EXPECT_NEAR(mean_of(picture), 1, 1e-3) << notes_of(report);
    EXPECT_EQ(report.medium_contradictions, 0u);
  }
}

TEST(FluidLevels, AContainerEndsThemToo) {
  RenderOptions options = seen_from(20);
  options.container = {-0.05, -0.05, -0.05, 2.95, 2, 2.95};
  const double fine = mean_of(render(pool(), options));
  options.lod = 1;
  RenderReport report;
  EXPECT_NEAR(mean_of(render(pool(), options, {}, &report)) / fine, 1, 0.02);
  EXPECT_EQ(report.medium_contradictions, 0u);
}

TEST(FluidLevels, AreRefusedWhereThereAreNone) {
  RenderOptions options = seen_from(20);
  options.lod = 1;
  options.method = "thesis";
  EXPECT_THROW(render(pool(), options), std::runtime_error);
  options.method = "fast";
  options.representation = "mesh";
  EXPECT_THROW(render(pool(), options), std::runtime_error);
}

}  // namespace
}  // namespace embrun

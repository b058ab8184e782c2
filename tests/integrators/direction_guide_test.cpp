#include "integrators/direction_guide.h"

#include <gtest/gtest.h>

#include <vector>

#include "sampling/distribution_builder.h"
#include "support/chi_square.h"

namespace embrun {
namespace {

DistributionTable uneven_table() {
  std::vector<float> weights;
  for (int i = 0; i < guide_columns * guide_rows; ++i)
    weights.push_back(i % 7 == 0 ? 0.0f : static_cast<float>((i * 2654435761u) % 1000u));
  weights[900] = 3e5f;  // a sun
  return {weights, guide_columns, guide_rows};
}

TEST(DirectionGuide, DrawsWithTheDensityItClaims) {
  const DistributionTable table = uneven_table();
  const Distribution2D cells = table.view();
  testing_support::SphereChiSquareTest test;
  test.name = "direction_guide";
  // The chart of the test has its pole along z, the guide's along y: the test is told of directions turned.
  const auto turned = [](Vec3 d) { return Vec3{d.z, d.x, d.y}; };
  const auto back = [](Vec3 d) { return Vec3{d.y, d.z, d.x}; };
  test.sample = [&](int i) {
    return turned(sample_guide(cells, sample_2d(SamplerKind::independent, {1, 0, static_cast<std::uint32_t>(i), 0},
                                                Dimension::bsdf_direction)));
  };
  test.density = [&](Vec3 d) { return static_cast<double>(guide_pdf(cells, back(d))); };
  test.columns = guide_columns;
  test.rows = guide_rows;
  test.points_per_side = 2;
  const testing_support::ChiSquareResult result = testing_support::run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
}

TEST(DirectionGuide, SamplesLieInTheirCells) {
  const DistributionTable table = uneven_table();
  const Distribution2D cells = table.view();
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const Vec3 d = sample_guide(cells, sample_2d(SamplerKind::independent, {2, 0, i, 0}, Dimension::bsdf_direction));
    EXPECT_NEAR(length(d), 1, 1e-5);
    EXPECT_GT(guide_pdf(cells, d), 0) << "sample " << i;
  }
}

TEST(DirectionGuide, PolesAndSeamHaveCells) {
  const Vec3 directions[] = {{0, 1, 0},      {0, -1, 0},      {0, 0, -1}, {-0.0f, 0, -1},
                             {1e-8f, 0, -1}, {-1e-8f, 0, -1}, {0, 0, 1}};
  for (const Vec3& d : directions) {
    const GuideCell cell = guide_cell(d);
    EXPECT_GE(cell.x, 0);
    EXPECT_LT(cell.x, guide_columns);
    EXPECT_GE(cell.y, 0);
    EXPECT_LT(cell.y, guide_rows);
  }
}

}  // namespace
}  // namespace embrun

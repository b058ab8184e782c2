#include "sampling/distribution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sampling/distribution_builder.h"
#include "support/chi_square.h"

namespace embrun {
namespace {

TEST(Distribution1D, ProbabilitiesAreTheWeightsShares) {
  const std::vector<float> weights{1, 0, 3, 0, 0, 4, 0};
  double total = 0;
  const std::vector<float> cdf = build_cdf(weights, &total);
  const Distribution1D d{cdf.data(), 7};
  EXPECT_EQ(total, 8);
  EXPECT_EQ(cdf.front(), 0.0f);
  EXPECT_EQ(cdf.back(), 1.0f);
  for (int i = 0; i < 7; ++i) EXPECT_EQ(probability_of(d, i), weights[static_cast<size_t>(i)] / 8);
}

TEST(Distribution1D, SamplesByInversion) {
  const std::vector<float> cdf = build_cdf(std::vector<float>{1, 0, 3, 0, 0, 4, 0});
  const Distribution1D d{cdf.data(), 7};
  const float largest = 1 - 0x1p-24f;
  // u, item, remainder: by hand from cdf 0, 1/8, 1/8, 1/2, 1/2, 1/2, 1, 1
  const float table[][3] = {{0, 0, 0},
                            {0.0625f, 0, 0.5f},
                            {0.125f, 2, 0},
                            {0.3125f, 2, 0.5f},
                            {0.5f, 5, 0},
                            {0.75f, 5, 0.5f},
                            {largest, 5, largest - 0x1p-24f}};
  for (const auto& row : table) {
    const DiscreteSample s = sample_discrete(d, row[0]);
    EXPECT_EQ(s.index, static_cast<int>(row[1])) << row[0];
    EXPECT_EQ(s.remainder, row[2]) << row[0];
    EXPECT_EQ(s.probability, probability_of(d, s.index));
  }
}

TEST(Distribution1D, NeverChoosesTheImpossible) {
  std::vector<float> weights(1000);
  for (size_t i = 0; i < weights.size(); i += 7) weights[i] = static_cast<float>(i % 13);
  const std::vector<float> cdf = build_cdf(weights);
  const Distribution1D d{cdf.data(), 1000};
  for (uint32_t i = 0; i < 20'000; ++i) {
    const DiscreteSample s = sample_discrete(d, sample_1d(SamplerKind::sobol, {1, 1, i, 0}, Dimension::light_choice));
    ASSERT_GT(weights[static_cast<size_t>(s.index)], 0);
    ASSERT_GE(s.remainder, 0);
    ASSERT_LT(s.remainder, 1);
  }
}

TEST(Distribution1D, AllZeroIsUniform) {
  const std::vector<float> cdf = build_cdf(std::vector<float>(4, 0.0f));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(probability_of({cdf.data(), 4}, i), 0.25f);
}

TEST(Distribution1D, HugeAndTinyWeightsAddInDouble) {
  std::vector<float> weights(100'000, 1e-3f);
  weights[5] = 1e6f;
  const std::vector<float> cdf = build_cdf(weights);
  const Distribution1D d{cdf.data(), static_cast<int>(weights.size())};
  EXPECT_NEAR(probability_of(d, 5), 1e6 / (1e6 + 99.999), 1e-6);
}

// Density over the square is piecewise constant: probability of the cell over its area.
TEST(Distribution2D, SamplesFollowTheCells) {
  constexpr int w = 8, h = 6;
  std::vector<float> weights(w * h);
  for (size_t i = 0; i < weights.size(); ++i) weights[i] = static_cast<float>((i * 7919) % 11);
  for (size_t x = 0; x < w; ++x) weights[3 * w + x] = 0;  // a row without any
  double total = 0;
  for (const float v : weights) total += v;
  const DistributionTable table(weights, w, h);
  const Distribution2D d = table.view();
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      EXPECT_NEAR(cell_probability(d, x, y), weights[static_cast<size_t>(y * w + x)] / total, 1e-6);

  testing_support::ChiSquareTest test;
  test.name = "distribution_2d";
  test.columns = 2 * w;
  test.rows = 2 * h;
  test.points_per_side = 2;
  test.sample = [&](int i) {
    const CellSample s = sample_cell(
        d, sample_2d(SamplerKind::independent, {4, 0, static_cast<uint32_t>(i), 0}, Dimension::light_position));
    EXPECT_EQ(s.probability, cell_probability(d, s.x, s.y));
    return std::optional(std::pair<double, double>{(s.x + static_cast<double>(s.remainder.x)) / w,
                                                   (s.y + static_cast<double>(s.remainder.y)) / h});
  };
  test.density = [&](double x, double y) {
    return weights[static_cast<size_t>(y * h) * w + static_cast<size_t>(x * w)] / total * w * h;
  };
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
}

}  // namespace
}  // namespace embrun

#include "camera/pixel_filter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/chi_square.h"

namespace embrun {
namespace {

/// Compares offsets in [-reach, reach]^2 with the density of the filter, per pixel^2.
void expect_follows(const char* name, const PixelFilter& filter, double reach,
                    const std::function<double(double, double)>& density) {
  testing_support::ChiSquareTest test;
  test.name = name;
  test.columns = test.rows = 20;
  test.points_per_side = 20;
  test.sample = [&](int i) {
    const Sample2 d = sample_filter(
        filter, sample_2d(SamplerKind::independent, {2, 0, static_cast<uint32_t>(i), 0}, Dimension::camera_film));
    return std::optional(std::pair{0.5 * (1 + d.x / reach), 0.5 * (1 + d.y / reach)});
  };
  test.density = [&](double x, double y) {
    return 4 * reach * reach * density((2 * x - 1) * reach, (2 * y - 1) * reach);
  };
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
}

TEST(PixelFilter, BoxIsOnePixelExactly) {
  expect_follows("box_filter", {}, 0.5, [](double, double) { return 1.0; });
  EXPECT_EQ(sample_filter({}, {0, 0}).x, -0.5f);
  EXPECT_LT(sample_filter({}, {1 - 0x1p-24f, 0}).x, 0.5f);
}

TEST(PixelFilter, Tent) {
  const double r = 1.25;
  const auto tent = [r](double x) { return (1 - std::fabs(x) / r) / r; };
  expect_follows("tent_filter", {FilterKind::tent, 1.25f}, r, [&](double x, double y) { return tent(x) * tent(y); });
}

// Deviation radius/3, cut at radius: the normalisation is 1 - exp(-9/2).
TEST(PixelFilter, Gaussian) {
  const double r = 1.5, sigma = r / 3;
  expect_follows("gaussian_filter", {FilterKind::gaussian, 1.5f}, r, [&](double x, double y) {
    const double d2 = x * x + y * y;
    return d2 < r * r ? std::exp(-d2 / (2 * sigma * sigma)) / (2 * M_PI * sigma * sigma * (1 - std::exp(-4.5))) : 0.0;
  });
}

// The window a0 + a1 cos + a2 cos + a3 cos over +-r has integral 2 r a0.
TEST(PixelFilter, BlackmanHarris) {
  const double r = 2;
  const auto window = [r](double x) {
    const double p = M_PI * x / r;
    return (0.35875 + 0.48829 * std::cos(p) + 0.14128 * std::cos(2 * p) + 0.01168 * std::cos(3 * p)) /
           (2 * r * 0.35875);
  };
  expect_follows("blackman_harris_filter", {FilterKind::blackman_harris, 2}, r,
                 [&](double x, double y) { return window(x) * window(y); });
}

TEST(PixelFilter, EveryFilterIsFiniteAtTheCorners) {
  for (const FilterKind kind : {FilterKind::box, FilterKind::tent, FilterKind::gaussian, FilterKind::blackman_harris})
    for (const float x : {0.0f, 0.5f, 1 - 0x1p-24f})
      for (const float y : {0.0f, 0.5f, 1 - 0x1p-24f}) {
        const Sample2 d = sample_filter({kind, 1}, {x, y});
        EXPECT_TRUE(is_finite(d.x) && is_finite(d.y));
        EXPECT_LE(std::fabs(d.x), 1.0f + 1e-5f);
        EXPECT_LE(std::fabs(d.y), 1.0f + 1e-5f);
      }
}

}  // namespace
}  // namespace embrun

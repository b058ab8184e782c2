#include "reproduction/curves.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace embrun {
namespace {

const ChartSeries& series(const std::vector<Curve>& curves, const std::string& file, std::size_t which) {
  const auto found = std::find_if(curves.begin(), curves.end(), [&](const Curve& c) { return c.file == file; });
  return found->chart.series.at(which);
}

// Three balls of radius 0.1 on the x axis, the first two overlapping over 0.1: 0.2 + 0.1 + 0.2 metres of extinction 5.
TEST(Curves, IntegrateTheDensityAlongALine) {
  SizedParticles sized;
  sized.particles.positions = {{0, 0, 0}, {0.1, 0, 0}, {1, 0, 0}};
  sized.radius.radius = 0.1;
  const auto curves = depth_curves(sized, 5);
  ASSERT_EQ(curves.size(), 2u);
  const ChartSeries &through = curves[0].chart.series.at(0), &depth = curves[1].chart.series.at(0);
  EXPECT_EQ(depth.y.front(), 0);
  EXPECT_NEAR(depth.y.back(), 5 * 0.5, 1e-4);
  EXPECT_NEAR(through.y.back(), std::exp(-2.5), 1e-4);
  EXPECT_TRUE(std::is_sorted(depth.x.begin(), depth.x.end()));
  EXPECT_TRUE(std::is_sorted(depth.y.begin(), depth.y.end()));
  // Between the pair, which ends 0.4 after the start (0.2 before its first centre), and the third ball nothing is added.
  for (std::size_t i = 0; i < depth.x.size(); ++i)
    if (depth.x[i] > 0.401 && depth.x[i] < 1.099) {
      EXPECT_NEAR(depth.y[i], 5 * 0.3, 1e-4);
    }
}

TEST(Curves, ShowWhatThresholdsDo) {
  const auto curves = surface_curves(1.857);
  ASSERT_EQ(curves.size(), 4u);
  const auto finite = [](const ChartSeries& s) {
    return std::count_if(s.y.begin(), s.y.end(), [](double v) { return std::isfinite(v); });
  };
  // A smaller threshold swells: wherever there is a surface, it is higher, and there is more of it.
  const ChartSeries &low = series(curves, "figure-54.svg", 0), &middle = series(curves, "figure-54.svg", 1),
                    &high = series(curves, "figure-54.svg", 2);
  EXPECT_GT(finite(low), finite(high));
  for (std::size_t i = 0; i < low.y.size(); ++i)
    if (std::isfinite(middle.y[i]) && std::isfinite(low.y[i])) {
      EXPECT_GE(low.y[i], middle.y[i] - 1e-6);
    }
  // The drop, 4.5 spacings from the block, is there at the first order, and as high as a ball of radius R0; not at the third.
  const auto at_drop = [](const ChartSeries& s) {
    double best = 1e9, value = 0;
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (std::abs(s.x[i] - 4.5 * 1.857) >= best) continue;
      best = std::abs(s.x[i] - 4.5 * 1.857);
      value = s.y[i];
    }
    return value;
  };
  EXPECT_NEAR(at_drop(series(curves, "figure-57.svg", 0)), 0.5 * 1.857 + 1, 0.01);
  EXPECT_FALSE(at_drop(series(curves, "figure-57.svg", 1)) > 0);
  // Bumps: the third order's surface over the middle of the block is flatter than the first's.
  const auto bumps = [](const ChartSeries& s) {
    double least = 1e9, most = -1e9;
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (s.x[i] < -7 * 1.857 || s.x[i] > -3 * 1.857 || !std::isfinite(s.y[i])) continue;
      least = std::min(least, s.y[i]);
      most = std::max(most, s.y[i]);
    }
    return most - least;
  };
  EXPECT_LT(bumps(series(curves, "figure-57.svg", 1)), 0.3 * bumps(series(curves, "figure-57.svg", 0)));
  for (const Curve& curve : curves) EXPECT_NE(to_svg(curve.chart).find("</svg>"), std::string::npos);
}

}  // namespace
}  // namespace embrun

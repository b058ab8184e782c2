#include "geometry/kernel_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "measure/oracle_scene.h"

namespace embrun {
namespace {

// Beside the judge's own kernels in double precision; second derivatives are differences of its slopes.

float first(F16 lanes) {
  float all[16];
  store16(all, lanes);
  return all[0];
}

/// d^2 f/dt^2 at distance t from the foot of the perpendicular of a line that passes at distance h from the centre.
double line_curvature(oracle::Kernel kernel, double h, double t) {
  const auto slope = [&](double at) {
    const double u = std::hypot(h, at);
    return u > 0 ? oracle::kernel_slope(kernel, u) * at / u : 0.0;
  };
  const double step = 1e-6;
  return (slope(t + step) - slope(t - step)) / (2 * step);
}

template <Kernel kernel>
void expect_line_values_and_bounds() {
  const oracle::Kernel judge = measure::to_oracle(kernel);
  const double support = oracle::kernel_support(judge);
  for (double h = 0; h < support * 1.05; h += 0.0217) {
    double down = 0, up = 0;
    for (double t = 1e-3; t < support * 1.1; t += 0.0031) {
      const double bend = line_curvature(judge, h, t);
      down = std::max(down, -bend);
      up = std::max(up, bend);
    }
    for (double t = -1.1 * support; t < 1.1 * support; t += 0.173) {
      // `ahead` is towards the centre: the derivative along the line is against t's sign.
      const auto q = static_cast<float>(h * h + t * t), ahead = static_cast<float>(-t);
      const LineLanes line = KernelLanes<kernel>::on_line(splat(q), splat(ahead), splat(static_cast<float>(h * h)));
      const double u = std::hypot(h, t);
      EXPECT_NEAR(first(line.value), oracle::kernel_value(judge, u), 4e-6) << h << ' ' << t;
      EXPECT_NEAR(first(line.slope), u > 0 ? oracle::kernel_slope(judge, u) * t / u : 0.0, 2e-5) << h << ' ' << t;
      EXPECT_GE(first(line.down) + 1e-4, down) << h << ' ' << t;
      EXPECT_GE(first(line.up) + 1e-4, up) << h << ' ' << t;
    }
  }
}

template <Kernel kernel>
void expect_segment_bounds() {
  const oracle::Kernel judge = measure::to_oracle(kernel);
  const double support = oracle::kernel_support(judge);
  for (double h = 0; h < support; h += 0.0617) {
    for (double begin = -1.1 * support; begin < 1.1 * support; begin += 0.0971) {
      for (const double extent : {0.02, 0.11, 0.5}) {
        double down = 0, up = 0;
        for (double t = begin; t < begin + extent; t += 0.0013) {
          down = std::max(down, -line_curvature(judge, h, t));
          up = std::max(up, line_curvature(judge, h, t));
        }
        // Seen from the segment's begin.
        const LineLanes line = KernelLanes<kernel>::on_segment(
            splat(static_cast<float>(h * h + begin * begin)), splat(static_cast<float>(-begin)),
            splat(static_cast<float>(h * h)), splat(0.0f), splat(static_cast<float>(extent)));
        EXPECT_GE(first(line.down) + 1e-3, down) << h << ' ' << begin << ' ' << extent;
        EXPECT_GE(first(line.up) + 1e-3, up) << h << ' ' << begin << ' ' << extent;
      }
    }
  }
}

template <Kernel kernel>
void expect_bounds_in_balls() {
  const oracle::Kernel judge = measure::to_oracle(kernel);
  const double support = oracle::kernel_support(judge);
  for (double u = 0.01; u < support * 1.2; u += 0.0237) {
    for (const double h : {0.0, 0.05, 0.2, 0.7}) {
      const CurvatureLanes bounds =
          KernelLanes<kernel>::curvature_within(splat(static_cast<float>(u)), splat(static_cast<float>(h)));
      // The eigenvalues of the second derivative: along the radius f'', across it f'/u.
      for (double at = std::max(2e-6, u - h); at <= u + h; at += 0.0043) {
        const double radial = line_curvature(judge, 0, at), across = oracle::kernel_slope(judge, at) / at;
        EXPECT_GE(first(bounds.down) + 1e-3, std::max(-radial, -across)) << u << ' ' << h << ' ' << at;
        EXPECT_GE(first(bounds.up) + 1e-3, std::max(radial, across)) << u << ' ' << h << ' ' << at;
      }
    }
  }
}

TEST(KernelLanes, HaveTheKernelAndBoundItsCurvatureOnLines) {
  expect_line_values_and_bounds<Kernel::metaball>();
  expect_line_values_and_bounds<Kernel::zhu_bridson>();
  expect_line_values_and_bounds<Kernel::blinn>();
}

TEST(KernelLanes, BoundItsCurvatureOnSegments) {
  expect_segment_bounds<Kernel::metaball>();
  expect_segment_bounds<Kernel::zhu_bridson>();
  expect_segment_bounds<Kernel::blinn>();
}

TEST(KernelLanes, BoundItsCurvatureInBalls) {
  expect_bounds_in_balls<Kernel::metaball>();
  expect_bounds_in_balls<Kernel::zhu_bridson>();
  expect_bounds_in_balls<Kernel::blinn>();
}

}  // namespace
}  // namespace embrun

#include "geometry/kernels.h"

#include <gtest/gtest.h>

#include <cmath>

namespace embrun {
namespace {

// Every kernel is held to the same properties; the few exact values are worked out by hand from the formulas.
class Kernels : public testing::TestWithParam<Kernel> {};

INSTANTIATE_TEST_SUITE_P(All, Kernels, testing::Values(Kernel::metaball, Kernel::zhu_bridson, Kernel::blinn));

TEST_P(Kernels, AreOneAtTheCentreAndTwoThirdsAtAThird) {
  EXPECT_NEAR(kernel_value(GetParam(), 0.0f), 1.0f, 1e-6f);
  // Zhu-Bridson at 1/3: (8/9)^3.
  const double third = GetParam() == Kernel::zhu_bridson ? 512.0 / 729.0 : 2.0 / 3.0;
  EXPECT_NEAR(kernel_value(GetParam(), 1.0f / 3.0f), third, 1e-6);
}

TEST_P(Kernels, ArePositiveAndFallInsideTheSupportAndVanishBeyond) {
  const float support = kernel_support(GetParam());
  float previous = kernel_value(GetParam(), 0.0f);
  for (int i = 1; i < 1000; ++i) {
    const float u = support * static_cast<float>(i) / 1000.0f;
    const float value = kernel_value(GetParam(), u);
    EXPECT_GT(value, 0.0f) << u;
    EXPECT_LT(value, previous) << u;
    previous = value;
  }
  for (const float factor : {1.0f + 1e-5f, 1.01f, 2.0f, 100.0f}) {
    EXPECT_EQ(kernel_value(GetParam(), support * factor), 0.0f);
    EXPECT_EQ(kernel_derivative(GetParam(), support * factor), 0.0f);
  }
}

TEST_P(Kernels, AreContinuous) {
  // No step larger than the steepest slope allows (|f'| < 3 for all three), the edge of the support included.
  const float support = kernel_support(GetParam());
  const float step = 1e-4f;
  for (float u = 0.0f; u < support * 1.1f; u += step) {
    EXPECT_LE(std::abs(kernel_value(GetParam(), u + step) - kernel_value(GetParam(), u)), 3.0f * step) << u;
  }
}

TEST_P(Kernels, HaveTheDerivativeThatDifferencesShow) {
  const float support = kernel_support(GetParam());
  for (int i = 1; i < 200; ++i) {
    const float u = support * static_cast<float>(i) / 200.0f;
    const float step = 1e-3f;
    const double difference =
        (static_cast<double>(kernel_value(GetParam(), u + step)) - kernel_value(GetParam(), u - step)) / (2 * step);
    // f'' jumps by at most 9 at the metaball's joint: the difference over 2e-3 there is off by at most 9 * 1e-3/4.
    EXPECT_NEAR(kernel_derivative(GetParam(), u), difference, 0.0025) << u;
  }
  EXPECT_EQ(kernel_derivative(GetParam(), 0.0f), 0.0f);
}

TEST_P(Kernels, HaveNoKink) {
  // f' makes no step larger than the strongest curvature allows (|f''| < 7.5 for all three), the edge of the support
  // included: it ends at 0.
  const float support = kernel_support(GetParam());
  const float step = 1e-4f;
  for (float u = 0.0f; u < support * 1.1f; u += step) {
    EXPECT_LE(std::abs(kernel_derivative(GetParam(), u + step) - kernel_derivative(GetParam(), u)), 8.0f * step) << u;
  }
}

TEST_P(Kernels, HaveTheIntegralThatQuadratureGives) {
  // Midpoint rule over shells, 20,000 of them: error far below 1e-6.
  const double support = kernel_support(GetParam());
  const int count = 20000;
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    const double u = support * (i + 0.5) / count;
    sum += kernel_value(GetParam(), static_cast<float>(u)) * u * u;
  }
  EXPECT_NEAR(kernel_integral(GetParam()), 4.0 * 3.14159265358979 * sum * support / count, 2e-6);
}

TEST(Kernels, MetaballIntegralIsTheMethods) {
  EXPECT_NEAR(kernel_integral(Kernel::metaball), 4.0 * 3.14159265358979 * 0.0493827, 1e-6);
}

TEST(Kernels, BlinnIsCutWhereItsGaussianIsAThousandth) {
  EXPECT_NEAR(std::exp(-blinn_exponent * blinn_support * blinn_support), 1e-3, 1e-8);
  // And stays near the uncut one, exp(-beta u^2) = (2/3)^(9 u^2), everywhere.
  for (double u = 0; u < 3; u += 0.01) {
    EXPECT_NEAR(kernel_value(Kernel::blinn, static_cast<float>(u)), std::pow(2.0 / 3.0, 9 * u * u), 0.0034) << u;
  }
}

}  // namespace
}  // namespace embrun

#include "sampling/warp.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/chi_square.h"

namespace embrun {
namespace {

using testing_support::ChiSquareTest;
using testing_support::run_chi_square;
using testing_support::SphereChiSquareTest;

constexpr float largest = 1.0f - 0x1p-24f;
constexpr Sample2 corners[] = {{0, 0},          {0, largest},   {largest, 0},        {largest, largest},
                               {0.5f, 0.5f},    {0.5f, 0},      {0, 0.5f},           {largest, 0.5f},
                               {0.5f, largest}, {0.25f, 0.25f}, {0x1p-24f, 0x1p-24f}};

Sample2 numbers(int i) {
  return sample_2d(SamplerKind::independent, {20, 0, static_cast<uint32_t>(i), 0}, Dimension::bsdf_direction);
}

void expect_matches(SphereChiSquareTest test) {
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
  EXPECT_NEAR(result.density_integral, 1, 0.003) << test.name;
}

TEST(Warp, CosineHemisphere) {
  expect_matches({"cosine_hemisphere", [](int i) { return sample_cosine_hemisphere(numbers(i)); },
                  [](Vec3 d) { return cosine_hemisphere_pdf(d.z); }});
  for (const Sample2 u : corners) {
    const Vec3 d = sample_cosine_hemisphere(u);
    EXPECT_NEAR(length(d), 1, 2e-6);
    EXPECT_GT(d.z, 0);
  }
}

TEST(Warp, UniformSphere) {
  expect_matches({"uniform_sphere", [](int i) { return sample_uniform_sphere(numbers(i)); },
                  [](Vec3) { return uniform_sphere_pdf(); }});
}

TEST(Warp, UniformHemisphere) {
  expect_matches({"uniform_hemisphere", [](int i) { return sample_uniform_hemisphere(numbers(i)); },
                  [](Vec3 d) { return uniform_hemisphere_pdf(d.z); }});
  for (const Sample2 u : corners) EXPECT_GE(sample_uniform_hemisphere(u).z, 0);
}

TEST(Warp, Cone) {
  // 60 degrees: h = 1 - cos = 1/2 falls on the edge of a bin of the chart.
  expect_matches({"cone_60", [](int i) { return sample_cone(numbers(i), 0.5f); },
                  [](Vec3 d) { return d.z >= 0.5f ? cone_pdf(0.5f) : 0.0f; }});
}

// A cone as narrow as the sun's: uniform in h and stays within, to float precision. In double, h = 1 - cos(0.2665 deg).
TEST(Warp, NarrowConeKeepsItsPrecision) {
  const double half_angle = 0.2665 * 3.14159265358979 / 180;
  const double h = 2 * std::pow(std::sin(half_angle / 2), 2);
  EXPECT_NEAR(one_minus_cos_from_sin2(static_cast<float>(std::pow(std::sin(half_angle), 2))) / h, 1, 1e-6);
  ChiSquareTest test;
  test.name = "narrow_cone";
  test.sample = [&](int i) {
    const Vec3 d = sample_cone(numbers(i), static_cast<float>(h));
    const double sine2 = static_cast<double>(d.x) * d.x + static_cast<double>(d.y) * d.y;
    const double turn = std::atan2(d.y, d.x) / (2 * 3.14159265358979);
    return std::optional(std::pair{turn < 0 ? turn + 1 : turn, sine2 / (1 + std::sqrt(1 - sine2)) / h});
  };
  test.density = [](double, double) { return 1.0; };
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
  EXPECT_NEAR(cone_pdf(static_cast<float>(h)) * 2 * 3.14159265358979 * h, 1, 1e-5);
}

TEST(Warp, Disk) {
  ChiSquareTest test;
  test.name = "disk";
  test.points_per_side = 40;  // the rim cuts bins
  test.sample = [](int i) {
    const Sample2 d = sample_disk(numbers(i));
    return std::optional(std::pair<double, double>{0.5 * (1 + d.x), 0.5 * (1 + d.y)});
  };
  test.density = [](double x, double y) {
    const double a = 2 * x - 1, b = 2 * y - 1;
    return a * a + b * b <= 1 ? 4.0 * disk_pdf() : 0.0;
  };
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
  for (const Sample2 u : corners) {
    const Sample2 d = sample_disk(u);
    EXPECT_LE(d.x * d.x + d.y * d.y, 1.0f + 1e-6f);
    EXPECT_TRUE(is_finite(d.x) && is_finite(d.y));
  }
}

TEST(Warp, Triangle) {
  ChiSquareTest test;
  test.name = "triangle";
  test.columns = test.rows = 20;
  test.points_per_side = 40;  // the diagonal cuts bins
  test.sample = [](int i) {
    const Sample2 b = sample_triangle(numbers(i));
    return std::optional(std::pair<double, double>{b.x, b.y});
  };
  test.density = [](double x, double y) { return x + y <= 1 ? 2.0 : 0.0; };
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
  for (const Sample2 u : corners) {
    const Sample2 b = sample_triangle(u);
    EXPECT_GE(b.x, 0);
    EXPECT_GE(b.y, 0);
    EXPECT_LE(b.x + b.y, 1);
  }
}

// The harness itself must be able to fail: a cosine lobe is not uniform, and half of a density is not all of it.
TEST(ChiSquare, RejectsWrongDensities) {
  EXPECT_FALSE(run_chi_square(SphereChiSquareTest{"expected_failure_shape",
                                                  [](int i) { return sample_cosine_hemisphere(numbers(i)); },
                                                  [](Vec3 d) { return uniform_hemisphere_pdf(d.z); }})
                   .passed);
  EXPECT_FALSE(run_chi_square(SphereChiSquareTest{"expected_failure_scale",
                                                  [](int i) { return sample_uniform_sphere(numbers(i)); },
                                                  [](Vec3) { return 0.5f * uniform_sphere_pdf(); }})
                   .passed);
  // 4 % wrong on each half.
  EXPECT_FALSE(run_chi_square(SphereChiSquareTest{
                                  "expected_failure_small", [](int i) { return sample_uniform_sphere(numbers(i)); },
                                  [](Vec3 d) { return uniform_sphere_pdf() * (d.z > 0 ? 1.04f : 0.96f); }})
                   .passed);
}

// Published quantiles: P(X >= 18.307) = 0.05 with 10 degrees, P(X >= 124.342) = 0.05 with 100, P(X >= 6.635) = 0.01
// with 1.
TEST(ChiSquare, TailProbabilities) {
  EXPECT_NEAR(testing_support::chi_square_tail(18.307, 10), 0.05, 1e-5);
  EXPECT_NEAR(testing_support::chi_square_tail(124.342, 100), 0.05, 1e-5);
  EXPECT_NEAR(testing_support::chi_square_tail(6.6349, 1), 0.01, 1e-6);
}

}  // namespace
}  // namespace embrun

#include "lights/environment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "base/error.h"
#include "lights/environment_image.h"
#include "support/chi_square.h"

namespace embrun {
namespace {

constexpr double pi_d = 3.14159265358979323846;

Sample2 numbers(SamplerKind kind, int i) {
  return sample_2d(kind, {8, 0, static_cast<uint32_t>(i), 0}, Dimension::light_position);
}

/// Values over five orders of magnitude, a fifth of the pixels black.
EnvironmentImage contrasty_image(int width, int height) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform;
  std::vector<float> rgb;
  for (int i = 0; i < 3 * width * height; ++i) {
    const float exponent = 5 * uniform(random) - 2;
    rgb.push_back(uniform(random) < 0.2f ? 0 : std::pow(10.0f, exponent));
  }
  return {width, height, std::move(rgb)};
}

/// Pixels numbered in red, so that a look-up tells where it was.
EnvironmentImage numbered_image(int width, int height) {
  std::vector<float> rgb;
  for (int i = 0; i < width * height; ++i) rgb.insert(rgb.end(), {static_cast<float>(i), 1, 1});
  return {width, height, std::move(rgb)};
}

TEST(Environment, ConventionYUp) {
  const EnvironmentImage image = numbered_image(8, 5);
  const Environment env = image.view(UpAxis::y);
  // Centres of the middle row are at longitudes (2 k + 1) 22.5 degrees; column 4 starts at +z and goes towards -x.
  const auto in_middle_row = [](double degrees) {  // from +z towards -x
    return to_float({-std::sin(degrees * pi_d / 180), 0, std::cos(degrees * pi_d / 180)});
  };
  EXPECT_NEAR(environment_radiance(env, in_middle_row(22.5)).r, 2 * 8 + 4, 1e-4);
  EXPECT_NEAR(environment_radiance(env, in_middle_row(-22.5)).r, 2 * 8 + 3, 1e-4);
  EXPECT_NEAR(environment_radiance(env, in_middle_row(90)).r, 2 * 8 + 5.5, 1e-4);   // -x: three quarters
  EXPECT_NEAR(environment_radiance(env, in_middle_row(-90)).r, 2 * 8 + 1.5, 1e-4);  // +x: one quarter
  // Upwards is row 0 (any column: 0 to 7), downwards the last.
  EXPECT_LE(environment_radiance(env, {0, 1, 0}).r, 7);
  EXPECT_GE(environment_radiance(env, {0, -1, 0}).r, 4 * 8);
  EXPECT_EQ(environment_radiance(env, {0, 1, 0}).g, 1);
}

// z up: what was at +y is at +z, what was at +z (towards the viewer in front) is at -y, +x stays.
TEST(Environment, ConventionZUp) {
  const EnvironmentImage image = numbered_image(16, 8);
  const Environment y_up = image.view(UpAxis::y), z_up = image.view(UpAxis::z);
  for (int i = 0; i < 200; ++i) {
    const Vec3 d = sample_uniform_sphere(numbers(SamplerKind::sobol, i));
    EXPECT_NEAR(environment_radiance(y_up, d).r, environment_radiance(z_up, {d.x, -d.z, d.y}).r, 2e-2);
  }
}

// A quarter turn anticlockwise from above brings what was at +z to +x.
TEST(Environment, TurnsAnticlockwise) {
  const EnvironmentImage image = numbered_image(16, 8);
  EXPECT_NEAR(environment_radiance(image.view(UpAxis::y), normalize(Vec3{0.1f, 0.2f, 1})).r,
              environment_radiance(image.view(UpAxis::y, 0.25f), normalize(Vec3{1, 0.2f, -0.1f})).r, 1e-3);
}

TEST(Environment, DirectionAndPlaceAreInverse) {
  const EnvironmentImage image = numbered_image(4, 2);
  for (const UpAxis up : {UpAxis::y, UpAxis::z})
    for (int i = 0; i < 500; ++i) {
      const Environment env = image.view(up, 0.37f);
      const Vec3 d = sample_uniform_sphere(numbers(SamplerKind::sobol, i));
      const LatLong place = latlong_from_direction(env, d);
      EXPECT_GE(place.u, 0);
      EXPECT_LT(place.u, 1);
      EXPECT_LT(length(direction_from_latlong(env, place.u, place.v * pi) - d), 1e-5);
    }
}

TEST(Environment, SolidAnglesFillTheSphere) {
  const EnvironmentImage image = numbered_image(1024, 512);
  const Environment env = image.view(UpAxis::y);
  double sum = 0;
  for (int y = 0; y < 512; ++y) sum += 1024.0 * latlong_pixel_solid_angle(env, y);
  EXPECT_NEAR(sum, 4 * pi_d, 1e-5);
  const double first = 2 * pi_d / 1024 * (1 - std::cos(pi_d / 512));
  EXPECT_NEAR(latlong_pixel_solid_angle(env, 0) / first, 1, 1e-5);
  EXPECT_NEAR(latlong_pixel_solid_angle(env, 511) / first, 1, 1e-5);
}

TEST(Environment, SamplesFollowThePdf) {
  const EnvironmentImage image = contrasty_image(24, 10);
  struct Case {
    const char* name;
    UpAxis up;
    float turn;
  };
  for (const Case& c : {Case{"environment_z_up", UpAxis::z, 0.0f}, Case{"environment_y_up", UpAxis::y, 0.3f}}) {
    const Environment env = image.view(c.up, c.turn);
    testing_support::SphereChiSquareTest test;
    test.name = c.name;
    test.points_per_side = 40;  // the density jumps at pixels' edges
    int unequal = 0;
    test.sample = [&](int i) -> std::optional<Vec3> {
      const LightSample s = sample_environment(env, numbers(SamplerKind::independent, i));
      // A direction at a pixel's edge may be rounded into the next.
      unequal += std::fabs(s.pdf - environment_pdf(env, s.direction)) > 1e-4f * s.pdf;
      EXPECT_NEAR(length(s.direction), 1, 1e-5);
      return s.direction;
    };
    test.density = [&](Vec3 d) { return environment_pdf(env, d); };
    const auto result = run_chi_square(test);
    EXPECT_TRUE(result.passed) << result.report;
    EXPECT_LT(unequal, test.samples / 5000);
  }
}

// The estimate radiance / pdf must average to the integral of the (bilinear) radiance over the sphere, found here by
// quadrature in double through the look-up alone.
TEST(Environment, FurnaceEstimateEqualsTheIntegral) {
  const EnvironmentImage image = contrasty_image(12, 6);
  const Environment env = image.view(UpAxis::y, 0.1f);
  double integral = 0;
  constexpr int nz = 600, na = 1200;
  for (int i = 0; i < nz; ++i)
    for (int j = 0; j < na; ++j) {
      const double polar = pi_d * (i + 0.5) / nz, a = 2 * pi_d * (j + 0.5) / na;
      const Vec3 d = to_float({std::sin(polar) * std::cos(a), std::cos(polar), std::sin(polar) * std::sin(a)});
      integral += environment_radiance(env, d).g * std::sin(polar) * pi_d / nz * 2 * pi_d / na;
    }
  constexpr int n = 1 << 18;
  double estimate = 0;
  for (int i = 0; i < n; ++i) {
    const LightSample s = sample_environment(env, numbers(SamplerKind::sobol, i));
    estimate += s.radiance.g / s.pdf / n;
  }
  EXPECT_NEAR(estimate / integral, 1, 3e-3);
  EXPECT_NEAR(image.mean_radiance().g * 4 * pi_d / integral, 1, 0.2);  // piecewise constant against bilinear
}

TEST(Environment, WhereThereIsLightThereIsDensity) {
  const EnvironmentImage image = contrasty_image(9, 7);
  const Environment env = image.view(UpAxis::z);
  for (int i = 0; i < 100'000; ++i) {
    const Vec3 d = sample_uniform_sphere(numbers(SamplerKind::independent, i));
    if (!is_black(environment_radiance(env, d))) {
      ASSERT_GT(environment_pdf(env, d), 0);
    }
  }
}

// Importance sampling is worth its name: under a small bright patch the estimate's deviation is below its mean (what
// is left comes from the blurred rim of the patch). Uniform directions would have a deviation of sqrt(1/share of the
// sphere), some 45 times the mean.
TEST(Environment, FollowsABrightPatch) {
  constexpr int w = 256, h = 128;
  std::vector<float> rgb(3 * w * h, 0.1f);
  for (int y = 30; y < 34; ++y)
    for (int x = 100; x < 104; ++x)
      for (size_t c = 0; c < 3; ++c) rgb[3 * static_cast<size_t>(y * w + x) + c] = 1000;
  const EnvironmentImage image(w, h, std::move(rgb));
  const Environment env = image.view(UpAxis::y);
  double sum = 0, squares = 0;
  constexpr int n = 20'000;
  for (int i = 0; i < n; ++i) {
    const LightSample s = sample_environment(env, numbers(SamplerKind::independent, i));
    const double value = s.radiance.g / s.pdf;
    sum += value / n, squares += value * value / n;
  }
  EXPECT_LT(std::sqrt(squares - sum * sum) / sum, 0.6);
}

TEST(Environment, PolesAreFinite) {
  const EnvironmentImage image = contrasty_image(16, 8);
  for (const UpAxis up : {UpAxis::y, UpAxis::z})
    for (const Vec3 d : {Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}, Vec3{-1, 0, 0}}) {
      EXPECT_TRUE(is_finite(environment_radiance(image.view(up), d)));
      EXPECT_TRUE(is_finite(environment_pdf(image.view(up), d)));
    }
  const Environment env = image.view(UpAxis::y);
  for (const float x : {0.0f, 1 - 0x1p-24f})
    for (const float y : {0.0f, 1 - 0x1p-24f}) {
      const LightSample s = sample_environment(env, {x, y});
      EXPECT_TRUE(is_finite(s.direction) && is_finite(s.pdf) && s.pdf > 0);
    }
}

TEST(Environment, ConstantIsTheSameEverywhere) {
  Environment env;
  env.kind = EnvironmentKind::constant;
  env.constant = {1, 2, 3};
  testing_support::SphereChiSquareTest test;
  test.name = "environment_constant";
  test.sample = [&](int i) { return sample_environment(env, numbers(SamplerKind::independent, i)).direction; };
  test.density = [&](Vec3 d) { return environment_pdf(env, d); };
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
  const LightSample s = sample_environment(env, {0.3f, 0.4f});
  EXPECT_EQ(s.radiance, env.constant);
  EXPECT_EQ(s.distance, infinity);
}

TEST(Environment, NoneIsBlack) {
  EXPECT_TRUE(is_black(environment_radiance({}, {0, 1, 0})));
  EXPECT_FALSE(sample_environment({}, {0.5f, 0.5f}).valid);
  EXPECT_EQ(environment_pdf({}, {0, 1, 0}), 0);
}

TEST(EnvironmentImage, CountsBadValues) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const EnvironmentImage image(2, 1, {1, nan, 1, -3, infinity, 1});
  EXPECT_EQ(image.bad_values(), 3);
  EXPECT_EQ(image.rgb()[1], 0);
  EXPECT_EQ(image.rgb()[3], 0);
}

TEST(EnvironmentImage, AllBlackStillSamples) {
  const EnvironmentImage image(4, 2, std::vector<float>(24));
  const LightSample s = sample_environment(image.view(UpAxis::y), {0.5f, 0.5f});
  EXPECT_TRUE(s.valid);
  EXPECT_GT(s.pdf, 0);
}

TEST(EnvironmentImage, RefusesWrongSizes) {
  EXPECT_THROW(EnvironmentImage(0, 1, {}), Error);
  EXPECT_THROW(EnvironmentImage(2, 2, std::vector<float>(11)), Error);
}

}  // namespace
}  // namespace embrun

#include "materials/plastic_bsdf.h"

#include <gtest/gtest.h>

#include <cmath>

#include "materials/bsdf_measures.h"
#include "scene/compile_materials.h"

namespace embrun {
namespace {

using namespace bsdf_measures;

const Vec3 up{0, 0, 1};

/// Mean reflectance of a body of index n for diffuse light from outside [Duntley1942].
double outer_diffuse_reflectance(double n) {
  const double n2 = n * n, n4 = n2 * n2;
  return 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1)) +
         n2 * (n2 - 1) * (n2 - 1) / std::pow(n2 + 1, 3) * std::log((n - 1) / (n + 1)) -
         2 * n * n2 * (n2 + 2 * n - 1) / ((n2 + 1) * (n4 - 1)) +
         8 * n4 * (n4 + 1) / ((n2 + 1) * (n4 - 1) * (n4 - 1)) * std::log(n);
}

struct Plastic {
  BsdfParameters parameters;
  Bsdf bsdf;

  explicit Plastic(Rgb reflectance, bool nonlinear = false, float index = 1.5f) {
    parameters.inner_reflectance = static_cast<float>(inner_diffuse_reflectance(static_cast<double>(index)));
    parameters.nonlinear = nonlinear;
    bsdf.kind = BsdfKind::plastic;
    bsdf.reflectance = reflectance;
    bsdf.relative_index = index;
    bsdf.parameters = &parameters;
  }
  Plastic(const Plastic&) = delete;
  Plastic& operator=(const Plastic&) = delete;
};

// Light that fills a body evenly leaves it as it comes in: n^2 (1 - R_inner) = 1 - R_outer.
TEST(Plastic, InnerReflectanceIsTheClosedForm) {
  for (const double n : {1.1, 1.33, 1.5, 2.4})
    EXPECT_NEAR(inner_diffuse_reflectance(n), 1 - (1 - outer_diffuse_reflectance(n)) / (n * n), 2e-6);
  EXPECT_NEAR(outer_diffuse_reflectance(1.5), 0.0918, 1e-4);  // the tables' number
}

TEST(Plastic, SamplesFollowThePdf) {
  const Plastic plastic({0.3f, 0.5f, 0.7f});
  for (const double degrees : {10.0, 80.0, 130.0})
    for (const Vec3 shading : {up, normalize(Vec3{0.3f, 0.2f, 1})}) {
      const auto result = samples_against_pdf("plastic", plastic.bsdf, {up, shading}, tilted(degrees));
      EXPECT_TRUE(result.passed) << result.report;
    }
}

TEST(Plastic, WeightIsValueOverPdf) {
  for (const bool nonlinear : {false, true}) {
    const Plastic plastic({0.3f, 0.5f, 0.7f}, nonlinear);
    double worst = 0;
    EXPECT_GT(compare_weights(plastic.bsdf, {up, up}, tilted(50), worst), 500);
    EXPECT_LT(worst, 1e-3);
  }
}

// A white base under a clear coat loses nothing, seen from anywhere.
TEST(Plastic, WhiteFurnace) {
  for (const bool nonlinear : {false, true})
    for (const double degrees : {0.0, 45.0, 80.0, 100.0}) {
      const Plastic plastic({1, 1, 1}, nonlinear);
      const Furnace seen = furnace(plastic.bsdf, tilted(degrees));
      EXPECT_NEAR(seen.mean, 1, 5 * seen.error + 1e-5) << degrees;
      EXPECT_LT(seen.error, 3e-3);
    }
}

// Straight on, 0.04 is mirrored. Of a base of reflectance a, (1 - 0.04) a (1 - Ri) / (1 - a Ri) gets out when every turn
// inside takes its colour, 0.96 a when only the first does; Ri = 0.5963 for n = 1.5.
TEST(Plastic, ReflectsWhatTheSeriesSays) {
  const double inner = 1 - (1 - outer_diffuse_reflectance(1.5)) / 2.25;
  for (const bool nonlinear : {false, true}) {
    const Plastic plastic({0.5f, 0.5f, 0.5f}, nonlinear);
    const double base = nonlinear ? 0.96 * 0.5 * (1 - inner) / (1 - 0.5 * inner) : 0.96 * 0.5;
    const double whole = over_sphere([&](Vec3 wi) { return eval_bsdf(plastic.bsdf, {up, up}, up, wi).g; });
    EXPECT_NEAR(whole, base, 1e-4);
    const BsdfSample coat = sample_bsdf(plastic.bsdf, {up, up}, up, 0, {});
    ASSERT_TRUE(coat.specular);
    EXPECT_EQ(coat.wi, up);
    EXPECT_NEAR(coat.weight.g * coat.pdf, 0.04, 1e-6);
  }
}

TEST(Plastic, BaseIsReciprocal) {
  const Plastic plastic({0.3f, 0.5f, 0.7f}, true);
  Directions direction(2);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 wo = direction(), wi = direction();
    const Rgb there = eval_bsdf(plastic.bsdf, {up, up}, wo, wi) * std::fabs(wo.z);
    const Rgb back = eval_bsdf(plastic.bsdf, {up, up}, wi, wo) * std::fabs(wi.z);
    EXPECT_NEAR(there.g, back.g, 1e-5);
    EXPECT_EQ(is_black(there), wo.z * wi.z <= 0);
  }
}

TEST(Plastic, BlackBaseIsTheCoatAlone) {
  const Plastic plastic({0, 0, 0});
  for (int i = 0; i < 100; ++i) {
    const BsdfSample s = sample_bsdf(plastic.bsdf, {up, up}, tilted(60), lobe_number(i), direction_numbers(i));
    EXPECT_TRUE(s.valid && s.specular);
    EXPECT_NEAR(s.weight.g, fresnel_dielectric(0.5f, 1.5f).reflectance, 1e-6);
  }
}

}  // namespace
}  // namespace embrun

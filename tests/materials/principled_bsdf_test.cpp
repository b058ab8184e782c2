#include "materials/principled_bsdf.h"

#include <gtest/gtest.h>

#include <cmath>

#include "materials/bsdf_measures.h"

namespace embrun {
namespace {

using namespace bsdf_measures;

const Vec3 up{0, 0, 1};

struct Principled {
  BsdfParameters parameters;
  Bsdf bsdf;

  explicit Principled(PrincipledParameters p, Rgb color = {1, 1, 1}, float roughness = 0.5f, float index = 1.5f) {
    parameters.principled = p;
    bsdf.kind = BsdfKind::principled;
    bsdf.reflectance = color;
    bsdf.relative_index = index;
    bsdf.roughness = roughness;
    bsdf.alpha_u = bsdf.alpha_v = roughness * roughness;
    bsdf.parameters = &parameters;
  }
  Principled(const Principled&) = delete;
  Principled& operator=(const Principled&) = delete;
};

PrincipledParameters with(std::initializer_list<std::pair<float PrincipledParameters::*, float>> values) {
  PrincipledParameters p;
  for (const auto& [member, value] : values) p.*member = value;
  return p;
}
using P = PrincipledParameters;

const PrincipledParameters mixtures[] = {
    {},
    with({{&P::metallic, 1.0f}}),
    with({{&P::spec_trans, 1.0f}}),
    with({{&P::spec_trans, 0.5f}, {&P::metallic, 0.2f}, {&P::spec_tint, 0.5f}}),
    with({{&P::clearcoat, 1.0f}, {&P::sheen, 1.0f}, {&P::sheen_tint, 0.5f}, {&P::flatness, 0.5f}}),
    with({{&P::metallic, 0.5f}, {&P::clearcoat, 0.5f}, {&P::clearcoat_gloss, 0.3f}}),
};

TEST(Principled, SamplesFollowThePdf) {
  for (const PrincipledParameters& mixture : mixtures)
    for (const double degrees : {10.0, 70.0, 130.0})
      for (const Vec3 shading : {up, normalize(Vec3{0.3f, 0.2f, 1})}) {
        Principled material(mixture, {0.8f, 0.5f, 0.2f}, 0.6f, degrees < 90 ? 1.5f : 1 / 1.5f);
        material.bsdf.alpha_u *= 1.5f;
        material.bsdf.tangent = {1, 1, 0};
        const auto result = samples_against_pdf("principled", material.bsdf, {up, shading}, tilted(degrees, 10));
        EXPECT_TRUE(result.passed) << result.report;
      }
}

TEST(Principled, WeightIsValueOverPdf) {
  for (const PrincipledParameters& mixture : mixtures)
    for (const double degrees : {10.0, 70.0, 130.0}) {
      const Principled material(mixture, {0.8f, 0.5f, 0.2f}, 0.6f, degrees < 90 ? 1.5f : 1 / 1.5f);
      double worst = 0;
      EXPECT_GT(compare_weights(material.bsdf, {up, up}, tilted(degrees), worst), 500);
      EXPECT_LT(worst, 2e-3);
    }
}

// Without metal and glass, and with an index so near 1 that facets reflect nothing, only the base is left. Written out
// from Burley's formulas: Schlick's weight at 60 degrees is 1/32; for light that goes back where it came from, the half
// vector is the direction itself and 2 roughness cos^2 = 1 for roughness 1/2.
TEST(Principled, BaseAsPublished) {
  const Principled base({}, {0.8f, 0.8f, 0.8f}, 0.5f, 1.001f);
  EXPECT_NEAR(eval_bsdf(base.bsdf, {up, up}, up, up).g, 0.8 / M_PI, 1e-5);
  const double w = 1.0 / 32;
  const double straight = (1 - w / 2) * (1 - w / 2) + 1 * (w + w + w * w * 0);
  EXPECT_NEAR(eval_bsdf(base.bsdf, {up, up}, tilted(60), tilted(60)).g, 0.8 / M_PI * 0.5 * straight, 1e-5);

  const Principled flat(with({{&P::flatness, 1.0f}}), {0.8f, 0.8f, 0.8f}, 0.5f, 1.001f);
  const double spread = (1 - w / 2) * (1 - w / 2);
  EXPECT_NEAR(eval_bsdf(flat.bsdf, {up, up}, tilted(60), tilted(60)).g,
              0.8 / M_PI * 0.5 * 1.25 * (spread * (1 / 1.0 - 0.5) + 0.5), 1e-5);
}

// Sheen: Schlick's weight of the angle to the half vector, here 60 degrees, times the cosine.
TEST(Principled, SheenAsPublished) {
  const Rgb color{0.8f, 0.4f, 0.2f};
  const Principled plain({}, color, 0.5f, 1.001f);
  const Principled sheen(with({{&P::sheen, 0.5f}}), color, 0.5f, 1.001f);
  const Principled tinted(with({{&P::sheen, 0.5f}, {&P::sheen_tint, 1.0f}}), color, 0.5f, 1.001f);
  const Vec3 wo = tilted(60), wi = tilted(60, 180);
  const Rgb without = eval_bsdf(plain.bsdf, {up, up}, wo, wi);
  EXPECT_NEAR(eval_bsdf(sheen.bsdf, {up, up}, wo, wi).g - without.g, 0.5 / 32 * 0.5, 1e-6);
  const double luminance_709 = 0.2126 * 0.8 + 0.7152 * 0.4 + 0.0722 * 0.2;
  EXPECT_NEAR(eval_bsdf(tinted.bsdf, {up, up}, wo, wi).r - without.r, 0.5 / 32 * 0.5 * 0.8 / luminance_709, 1e-6);
}

// Metal is GGX with Schlick's Fresnel: at normal incidence the colour times D / 4, D = 1 / (pi alpha^2), alpha the square
// of the roughness.
TEST(Principled, MetalAsPublished) {
  const Principled metal(with({{&P::metallic, 1.0f}}), {0.9f, 0.6f, 0.3f}, 0.5f);
  const double d = 1 / (M_PI * 0.0625);
  EXPECT_NEAR(eval_bsdf(metal.bsdf, {up, up}, up, up).b, 0.3 * d / 4, 1e-5);
}

// GTR1's D at its middle is (1 - a^2) / (pi a^2 ln(1 / a^2)), a = 0.1 without gloss, 0.001 with; the coat reflects 0.04
// at normal incidence and counts a quarter.
TEST(Principled, ClearCoatAsPublished) {
  for (const auto& [gloss, a] : {std::pair{0.0f, 0.1}, {1.0f, 0.001}}) {
    const Principled bare({}, {0.5f, 0.5f, 0.5f});
    const Principled coated(with({{&P::clearcoat, 1.0f}, {&P::clearcoat_gloss, gloss}}), {0.5f, 0.5f, 0.5f});
    const double expected = 0.25 * 0.04 * (1 - a * a) / (M_PI * a * a * std::log(1 / (a * a)));
    const double seen = static_cast<double>(eval_bsdf(coated.bsdf, {up, up}, up, up).g) -
                        static_cast<double>(eval_bsdf(bare.bsdf, {up, up}, up, up).g);
    EXPECT_NEAR(seen / expected, 1, 1e-3);
  }
}

TEST(Principled, CoatDensityIsNormalised) {
  EXPECT_NEAR(over_sphere([](Vec3 m) { return m.z > 0 ? coat_density(0.1f, m) * m.z : 0.0f; }, 2000), 1, 2e-3);
}

// With spec_trans alone and white it is rough glass of alpha = roughness^2, from both sides.
TEST(Principled, GlassIsTheRoughDielectric) {
  BsdfParameters clear;
  Directions direction(6);
  for (const float index : {1.5f, 1 / 1.5f}) {
    const Principled material(with({{&P::spec_trans, 1.0f}}), {1, 1, 1}, 0.6f, index);
    Bsdf glass;
    glass.kind = BsdfKind::rough_dielectric;
    glass.relative_index = index;
    glass.alpha_u = glass.alpha_v = 0.36f;
    glass.parameters = &clear;
    for (int i = 0; i < 2000; ++i) {
      Vec3 wo = direction();
      wo.z = index > 1 ? std::fabs(wo.z) : -std::fabs(wo.z);
      const Vec3 wi = direction();
      const float expected = eval_bsdf(glass, {up, up}, wo, wi).g;
      EXPECT_NEAR(eval_bsdf(material.bsdf, {up, up}, wo, wi).g, expected, 1e-4f * expected + 1e-7f);
      EXPECT_NEAR(pdf_bsdf(material.bsdf, {up, up}, wo, wi), pdf_bsdf(glass, {up, up}, wo, wi), 1e-4f);
    }
  }
}

// Reflection is reciprocal: every lobe is symmetric but for Schlick's terms in the half angle, which are as well.
TEST(Principled, ReflectionIsReciprocal) {
  Directions direction(7);
  const Principled material(mixtures[4], {0.8f, 0.5f, 0.2f});
  for (int i = 0; i < 1000; ++i) {
    const Vec3 wo = direction(), wi = direction();
    if (wo.z * wi.z <= 0) continue;
    const double there = static_cast<double>(eval_bsdf(material.bsdf, {up, up}, wo, wi).g * std::fabs(wo.z));
    const double back = static_cast<double>(eval_bsdf(material.bsdf, {up, up}, wi, wo).g * std::fabs(wi.z));
    EXPECT_NEAR(there, back, 1e-4 * std::max(there, 0.01));
  }
}

// A white metal and white glass reflect no more than arrives. (A white base under its own reflection may: the model adds
// its lobes.)
TEST(Principled, FurnaceOfMetalAndGlass) {
  for (const PrincipledParameters& p : {mixtures[1], mixtures[2]})
    for (const double degrees : {0.0, 60.0, 85.0}) {
      const Principled material(p, {1, 1, 1}, 0.4f);
      const Furnace seen = furnace(material.bsdf, tilted(degrees));
      EXPECT_LT(seen.mean, 1 + 5 * seen.error + 1e-5);
      EXPECT_GT(seen.mean, 0.85);
    }
}

}  // namespace
}  // namespace embrun

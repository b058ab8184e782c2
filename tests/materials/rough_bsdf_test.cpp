#include "materials/rough_bsdf.h"

#include <gtest/gtest.h>

#include <cmath>

#include "materials/bsdf_measures.h"

namespace embrun {
namespace {

using namespace bsdf_measures;
using enum MicrofacetDistribution;

const Vec3 up{0, 0, 1};

struct RoughMaterial {
  BsdfParameters parameters;
  Bsdf bsdf;
};

RoughMaterial rough_glass(float index, float alpha_u, float alpha_v, MicrofacetDistribution distribution = ggx) {
  RoughMaterial m;
  m.parameters.distribution = distribution;
  m.bsdf.kind = BsdfKind::rough_dielectric;
  m.bsdf.relative_index = index;
  m.bsdf.alpha_u = alpha_u;
  m.bsdf.alpha_v = alpha_v;
  m.bsdf.tangent = {1, 0, 0};
  return m;
}

/// A metal that reflects everything.
RoughMaterial rough_mirror(float alpha_u, float alpha_v, MicrofacetDistribution distribution = ggx) {
  RoughMaterial m = rough_glass(1, alpha_u, alpha_v, distribution);
  m.bsdf.kind = BsdfKind::rough_conductor;
  m.bsdf.reflectance = grey(1);
  return m;
}

const Bsdf& ready(RoughMaterial& m) {
  m.bsdf.parameters = &m.parameters;
  return m.bsdf;
}

const Microfacets all_facets[] = {{ggx, 0.3f, 0.3f}, {ggx, 0.6f, 0.2f}, {beckmann, 0.3f, 0.3f}, {beckmann, 0.5f, 0.2f}};

// The facets cover the surface: the areas that they project onto it add up to its own.
TEST(Microfacets, CoverTheSurface) {
  for (const Microfacets& facets : all_facets)
    EXPECT_NEAR(over_sphere([&](Vec3 m) { return facet_density(facets, m) * max_of(m.z, 0.0f); }), 1, 1e-3);
}

// What is visible of them from any direction is what is visible of the surface: exactly for GGX, to the precision of the
// fit for Beckmann.
TEST(Microfacets, AreVisibleAsTheSurfaceIs) {
  for (const Microfacets& facets : all_facets)
    for (const double degrees : {0.0, 40.0, 80.0}) {
      const Vec3 w = tilted(degrees, 30);
      const double visible = over_sphere(
          [&](Vec3 m) { return facet_visibility(facets, w, m) * max_of(dot(w, m), 0.0f) * facet_density(facets, m); });
      EXPECT_NEAR(visible / w.z, 1, facets.distribution == ggx ? 1e-3 : 4e-3) << degrees;
    }
}

TEST(Microfacets, AreDrawnWithTheirDensity) {
  for (const Microfacets& facets : all_facets)
    for (const double degrees : {0.0, 70.0}) {
      const Vec3 wo = tilted(degrees, 20);
      testing_support::SphereChiSquareTest test;
      test.name = "facets";
      test.columns = test.rows = 40;
      test.points_per_side = 20;
      test.sample = [&](int i) { return sample_facet(facets, wo, direction_numbers(i)); };
      test.density = [&](Vec3 m) { return static_cast<double>(facet_pdf(facets, wo, m)); };
      const auto result = run_chi_square(test);
      EXPECT_TRUE(result.passed) << result.report;
    }
}

TEST(RoughConductor, SamplesFollowThePdf) {
  const Vec3 bent = normalize(Vec3{0.3f, 0.2f, 1});
  for (RoughMaterial m : {rough_mirror(0.3f, 0.3f), rough_mirror(0.5f, 0.15f), rough_mirror(0.3f, 0.3f, beckmann)})
    for (const double degrees : {10.0, 75.0, 120.0})
      for (const Vec3 shading : {up, bent}) {
        const auto result = samples_against_pdf("rough_conductor", ready(m), {up, shading}, tilted(degrees, 10));
        EXPECT_TRUE(result.passed) << result.report;
      }
}

TEST(RoughDielectric, SamplesFollowThePdf) {
  const Vec3 bent = normalize(Vec3{0.3f, 0.2f, 1});
  for (RoughMaterial m :
       {rough_glass(1.5f, 0.3f, 0.3f), rough_glass(1 / 1.5f, 0.5f, 0.3f), rough_glass(1.33f, 0.3f, 0.3f, beckmann)})
    for (const double degrees : {10.0, 75.0, 120.0})
      for (const Vec3 shading : {up, bent}) {
        const auto result = samples_against_pdf("rough_dielectric", ready(m), {up, shading}, tilted(degrees, 10));
        EXPECT_TRUE(result.passed) << result.report;
      }
}

TEST(RoughBsdfs, WeightIsValueOverPdf) {
  for (RoughMaterial m : {rough_mirror(0.3f, 0.3f), rough_mirror(0.5f, 0.15f, beckmann), rough_glass(1.5f, 0.2f, 0.4f),
                          rough_glass(1 / 1.5f, 0.3f, 0.3f), rough_glass(1.33f, 0.3f, 0.3f, beckmann)})
    for (const double degrees : {5.0, 60.0, 140.0}) {
      double worst = 0;
      EXPECT_GT(compare_weights(ready(m), {up, up}, tilted(degrees), worst), 500);
      EXPECT_LT(worst, 2e-3);
    }
}

// D of GGX at its middle is 1 / (pi alpha^2), so a mirror seen from straight above reflects light from there with
// D / 4 = 1 / (4 pi alpha^2). Beckmann has the same D there.
TEST(RoughConductor, ValueAtNormalIncidence) {
  for (const MicrofacetDistribution distribution : {ggx, beckmann}) {
    RoughMaterial m = rough_mirror(0.5f, 0.25f, distribution);
    EXPECT_NEAR(eval_bsdf(ready(m), {up, up}, up, up).g, 1 / (4 * M_PI * 0.125), 1e-5);
  }
}

// At normal incidence facets are drawn with D m.z, whose inverse is tan^2 = alpha^2 x / (1 - x) for GGX; the light goes
// to twice the angle and gets away with Smith's 2 / (1 + sqrt(1 + alpha^2 tan^2)). So the albedo is an integral over x.
TEST(RoughConductor, LosesWhatFacetsReflectAmongThemselves) {
  for (const double alpha : {0.1, 0.3, 0.6}) {
    double albedo = 0;
    constexpr int steps = 200000;
    for (int i = 0; i < steps; ++i) {
      const double x = (i + 0.5) / steps, theta = std::atan(alpha * std::sqrt(x / (1 - x)));
      if (2 * theta >= M_PI / 2) continue;
      const double t = alpha * std::tan(2 * theta);
      albedo += 2 / (1 + std::sqrt(1 + t * t)) / steps;
    }
    RoughMaterial m = rough_mirror(static_cast<float>(alpha), static_cast<float>(alpha));
    const Furnace seen = furnace(ready(m), up);
    EXPECT_NEAR(seen.mean, albedo, 5 * seen.error);
    EXPECT_LT(seen.error, 2e-3);
  }
}

// Nothing shines brighter than the furnace, and a fairly smooth surface loses next to nothing.
TEST(RoughBsdfs, FurnaceIsNeverBrighterThanWhite) {
  for (const double degrees : {0.0, 45.0, 80.0})
    for (const float alpha : {0.01f, 0.1f, 0.5f})
      for (const MicrofacetDistribution distribution : {ggx, beckmann})
        for (RoughMaterial m : {rough_mirror(alpha, alpha, distribution), rough_glass(1.5f, alpha, alpha, distribution),
                                rough_glass(1 / 1.5f, alpha, alpha, distribution)}) {
          const Furnace seen = furnace(ready(m), tilted(degrees));
          EXPECT_LT(seen.mean, 1 + 4e-3 * (distribution == beckmann) + 5 * seen.error + 1e-5);
          if (alpha == 0.01f) {
            EXPECT_GT(seen.mean, 0.995 - 5 * seen.error);
          }
          // Off the grazing angles, where facets hide each other.
          if (alpha == 0.1f && degrees < 60) {
            EXPECT_GT(seen.mean, 0.97 - 5 * seen.error);
          }
        }
}

// The furnace by quadrature of the value, which shares nothing with sampling.
TEST(RoughBsdfs, ValueAndSamplesAgreeOnTheFurnace) {
  for (RoughMaterial m : {rough_mirror(0.3f, 0.5f), rough_glass(1.5f, 0.3f, 0.3f), rough_glass(1 / 1.5f, 0.3f, 0.3f),
                          rough_glass(1.5f, 0.4f, 0.3f, beckmann)})
    for (const double degrees : {20.0, 60.0}) {
      const Bsdf& bsdf = ready(m);
      const Vec3 wo = tilted(degrees);
      const double far = static_cast<double>(bsdf.relative_index) * bsdf.relative_index;
      const double whole = over_sphere(
          [&](Vec3 wi) {
            return eval_bsdf(bsdf, {up, up}, wo, wi).g * (wi.z < 0 ? far : 1.0);
          },
          800);
      const Furnace seen = furnace(bsdf, wo);
      EXPECT_NEAR(whole, seen.mean, 5 * seen.error + 1e-3);
    }
}

// f(wo, wi) is the same both ways where it reflects; across, f over the square of the viewer's index is.
TEST(RoughBsdfs, AreReciprocal) {
  Directions direction(8);
  for (int i = 0; i < 3000; ++i) {
    const float index = i % 2 ? 1.5f : 1 / 1.5f;
    RoughMaterial there = i % 3 == 0 ? rough_mirror(0.4f, 0.2f) : rough_glass(index, 0.4f, 0.3f);
    const Vec3 wo = direction(), wi = direction();
    RoughMaterial back = there;
    const bool across = wo.z * wi.z < 0;
    if (across) back.bsdf.relative_index = 1 / index;
    const double f = static_cast<double>(eval_bsdf(ready(there), {up, up}, wo, wi).g / std::fabs(wi.z));
    const double g = static_cast<double>(eval_bsdf(ready(back), {up, up}, wi, wo).g / std::fabs(wo.z));
    const double factor = across ? static_cast<double>(index) * static_cast<double>(index) : 1;
    EXPECT_NEAR(f * factor, g, 1e-3 * std::max(g, 1e-3)) << i;
  }
}

// As roughness goes, what is left is the smooth dielectric: how often it reflects, where it goes, what it weighs.
TEST(RoughDielectric, BecomesSmooth) {
  for (const float index : {1.5f, 1 / 1.5f}) {
    RoughMaterial m = rough_glass(index, min_alpha, min_alpha);
    Bsdf smooth;
    smooth.kind = BsdfKind::dielectric;
    smooth.relative_index = index;
    const Vec3 wo = tilted(30);
    const double fresnel = static_cast<double>(sample_bsdf(smooth, {up, up}, wo, 0, {}).pdf);
    int reflected = 0;
    constexpr int count = 20000;
    for (int i = 0; i < count; ++i) {
      const BsdfSample s = sample_bsdf(ready(m), {up, up}, wo, lobe_number(i), direction_numbers(i));
      ASSERT_TRUE(s.valid);
      const BsdfSample mirror = sample_bsdf(smooth, {up, up}, wo, s.transmitted ? 0.999f : 0, {});
      EXPECT_NEAR(s.weight.g, mirror.weight.g, 2e-3 * mirror.weight.g);
      // Facets of GGX have long tails: 1 of 10^4 is turned by more than 100 alpha.
      if (direction_numbers(i).y < 0.999f) {
        EXPECT_LT(length(s.wi - mirror.wi), 0.15f);
      }
      reflected += !s.transmitted;
    }
    const double error = std::sqrt(fresnel * (1 - fresnel) / count);
    EXPECT_NEAR(static_cast<double>(reflected) / count, fresnel, 5 * error + 1e-4);
  }
}

// Stretched facets scatter further along their wide side; the tangent says which that is.
TEST(RoughConductor, FollowsTheTangent) {
  RoughMaterial m = rough_mirror(0.5f, 0.1f);
  const Rgb along = eval_bsdf(ready(m), {up, up}, up, tilted(40, 0));
  const Rgb across = eval_bsdf(ready(m), {up, up}, up, tilted(40, 90));
  EXPECT_GT(along.g, 10 * across.g);
  m.bsdf.tangent = {0, 2, 0.1f};
  EXPECT_NEAR(eval_bsdf(ready(m), {up, up}, up, tilted(40, 90)).g, along.g, 1e-4 * along.g);
}

}  // namespace
}  // namespace embrun

#include "materials/bsdf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/chi_square.h"

namespace embrun {
namespace {

const float largest = 1 - 0x1p-24f;

Bsdf water(float relative_index) {
  Bsdf b;
  b.kind = BsdfKind::dielectric;
  b.relative_index = relative_index;
  return b;
}

Bsdf diffuse(Rgb reflectance) {
  Bsdf b;
  b.kind = BsdfKind::diffuse;
  b.reflectance = reflectance;
  return b;
}

Sample2 numbers(int i) {
  return sample_2d(SamplerKind::independent, {5, 0, static_cast<uint32_t>(i), 0}, Dimension::bsdf_direction);
}

class Directions {
 public:
  explicit Directions(unsigned seed) : random_(seed) {}
  Vec3 operator()() { return normalize(Vec3{normal_(random_), normal_(random_), normal_(random_)}); }

 private:
  std::mt19937 random_;
  std::normal_distribution<float> normal_;
};

TEST(DiffuseBsdf, SamplesFollowThePdf) {
  const Vec3 axis = normalize(Vec3{1, -2, 0.5f});
  struct Case {
    const char* name;
    SurfaceNormals normals;
    Vec3 wo;
  };
  const Case cases[] = {
      {"diffuse_front", {axis, axis}, normalize(Vec3{1, 0, 0})},
      {"diffuse_behind", {axis, axis}, normalize(Vec3{-1, 0.3f, 0})},
      {"diffuse_shading_normal", {axis, normalize(axis + Vec3{0.5f, 0.5f, 0})}, normalize(Vec3{1, -1, 0.2f})},
      {"diffuse_normal_away_from_viewer", {{0, 0, 1}, normalize(Vec3{0.9f, 0, 0.5f})}, normalize(Vec3{-1, 0, 0.1f})},
  };
  for (const Case& c : cases) {
    testing_support::SphereChiSquareTest test;
    test.name = c.name;
    test.points_per_side = 16;
    test.partial = true;  // shading normals send some directions under the surface
    test.sample = [&](int i) -> std::optional<Vec3> {
      const BsdfSample s = sample_bsdf(diffuse(grey(0.5f)), c.normals, c.wo, 0, numbers(i));
      if (!s.valid) return std::nullopt;
      EXPECT_NEAR(s.pdf, pdf_bsdf(diffuse(grey(0.5f)), c.normals, c.wo, s.wi), 1e-5);
      return s.wi;
    };
    test.density = [&](Vec3 wi) { return pdf_bsdf(diffuse(grey(0.5f)), c.normals, c.wo, wi); };
    const auto result = run_chi_square(test);
    EXPECT_TRUE(result.passed) << result.report;
  }
}

TEST(DiffuseBsdf, WeightIsValueOverPdf) {
  const Vec3 g{0, 0, 1};
  const SurfaceNormals normals{g, normalize(Vec3{0.2f, 0.1f, 1})};
  const Bsdf b = diffuse({0.2f, 0.5f, 0.9f});
  for (int i = 0; i < 1000; ++i) {
    const BsdfSample s = sample_bsdf(b, normals, normalize(Vec3{1, 1, 1}), 0.3f, numbers(i));
    if (!s.valid) continue;
    const Rgb value = eval_bsdf(b, normals, normalize(Vec3{1, 1, 1}), s.wi);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(value[c] / s.pdf, s.weight[c], 2e-4 * s.weight[c] + 1e-6);
    EXPECT_FALSE(s.transmitted);
    EXPECT_FALSE(s.specular);
  }
}

// f(wo, wi) is the same both ways, and both sides of the surface scatter.
TEST(DiffuseBsdf, IsReciprocalAndTwoSided) {
  Directions direction(3);
  const Vec3 g = normalize(Vec3{1, 2, 3});
  const Bsdf b = diffuse({0.2f, 0.5f, 0.9f});
  for (int i = 0; i < 1000; ++i) {
    const Vec3 wo = direction(), wi = direction();
    const Rgb there = eval_bsdf(b, {g, g}, wo, wi) * std::fabs(dot(wo, g));
    const Rgb back = eval_bsdf(b, {g, g}, wi, wo) * std::fabs(dot(wi, g));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(there[c], back[c], 1e-6);
    EXPECT_EQ(is_black(there), dot(wo, g) * dot(wi, g) <= 0);
  }
}

// The integral of f cos over wi is the reflectance, by independent quadrature on the sphere.
TEST(DiffuseBsdf, ReflectsItsReflectance) {
  const Vec3 g = normalize(Vec3{-1, 2, 3});
  double sum = 0;
  constexpr int nz = 400, na = 400;
  for (int i = 0; i < nz; ++i)
    for (int j = 0; j < na; ++j) {
      const double z = -1 + 2 * (i + 0.5) / nz, a = 2 * M_PI * (j + 0.5) / na, r = std::sqrt(1 - z * z);
      const Vec3 wi = to_float({r * std::cos(a), r * std::sin(a), z});
      sum += eval_bsdf(diffuse({0.25f, 0.5f, 0.75f}), {g, g}, normalize(Vec3{-1, 1, 0}), wi).g * 4 * M_PI / (nz * na);
    }
  EXPECT_NEAR(sum, 0.5, 1e-4);
}

TEST(DielectricBsdf, ReflectsAsOftenAsFresnelSays) {
  const Vec3 n{0, 0, 1};
  for (const float index : {1.33f, 1 / 1.33f})
    for (const float cosine : {0.9f, 0.3f, 0.1f}) {
      const Vec3 wo{std::sqrt(1 - cosine * cosine), 0, cosine};
      const float f = fresnel_dielectric(cosine, index).reflectance;
      const BsdfSample reflected = sample_bsdf(water(index), {n, n}, wo, std::nextafter(f, 0.0f), {});
      EXPECT_FALSE(reflected.transmitted);
      EXPECT_EQ(reflected.weight, grey(1));
      EXPECT_FLOAT_EQ(reflected.pdf, f);
      EXPECT_LT(length(reflected.wi - Vec3{-wo.x, 0, cosine}), 1e-6);
      if (f == 1) continue;
      const BsdfSample refracted = sample_bsdf(water(index), {n, n}, wo, f, {});
      EXPECT_TRUE(refracted.transmitted);
      EXPECT_FLOAT_EQ(refracted.pdf, 1 - f);
      EXPECT_NEAR(-refracted.wi.x * index, wo.x, 1e-6);
      EXPECT_LT(refracted.wi.z, 0);
    }
}

TEST(DielectricBsdf, TotalInternalReflectionNeverTransmits) {
  const Vec3 n{0, 0, 1};
  const Vec3 wo = normalize(Vec3{1, 0, 0.5f});  // 63 degrees, beyond 48.75
  for (const float u : {0.0f, 0.5f, largest}) {
    const BsdfSample s = sample_bsdf(water(1 / 1.33f), {n, n}, wo, u, {});
    EXPECT_FALSE(s.transmitted);
    EXPECT_EQ(s.weight, grey(1));
  }
}

// Radiance inside an environment of radiance 1 is n^2, so looking in from air the weight is 1/n^2, looking out n^2, and
// a path in and out again has weight 1.
TEST(DielectricBsdf, RadianceFactor) {
  const Vec3 n{0, 0, 1};
  const BsdfSample in = sample_bsdf(water(1.33f), {n, n}, normalize(Vec3{0.3f, 0, 1}), largest, {});
  ASSERT_TRUE(in.transmitted);
  EXPECT_NEAR(in.weight.g, 1 / (1.33 * 1.33), 1e-6);
  const BsdfSample out = sample_bsdf(water(1 / 1.33f), {n, n}, normalize(Vec3{0.3f, 0, 1}), largest, {});
  ASSERT_TRUE(out.transmitted);
  EXPECT_NEAR(out.weight.g, 1.33 * 1.33, 2e-6);
  EXPECT_NEAR(in.weight.g * out.weight.g, 1, 3e-7);
}

// Helmholtz: the light path is the same backwards, and transmitted radiance over n^2 is the same both ways:
// (1 - F(wo)) / pdf = 1 on both sides once each weight is rid of its radiance factor, and F agrees.
TEST(DielectricBsdf, IsReciprocal) {
  Directions direction(4);
  const Vec3 n = normalize(Vec3{0.3f, -1, 0.2f});
  for (int i = 0; i < 1000; ++i) {
    const Vec3 wo = direction();
    const float index = i % 2 ? 1.33f : 1 / 1.33f;
    const BsdfSample there = sample_bsdf(water(index), {n, n}, wo, largest, {});
    if (!there.transmitted) continue;
    const BsdfSample back = sample_bsdf(water(1 / index), {n, n}, there.wi, largest, {});
    ASSERT_TRUE(back.transmitted);
    EXPECT_LT(length(back.wi - wo), 1e-5 / std::fabs(dot(wo, n)));
    // Rounding of a direction changes a small cosine by 1e-7, and the reflectance by up to 1e-7 / cosine^2.
    const float cosine = min_of(std::fabs(dot(wo, n)), std::fabs(dot(there.wi, n)));
    EXPECT_NEAR(back.pdf, there.pdf, 1e-5 + 1e-6 / cosine);
    EXPECT_NEAR(there.weight.g * index * index, back.weight.g / (index * index), 1e-5);
  }
}

TEST(DielectricBsdf, MatchedIndexIsInvisible) {
  Directions direction(5);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 wo = direction(), g = direction();
    // A shading normal that disagrees moderately changes nothing either.
    const BsdfSample s = sample_bsdf(water(1), {g, normalize(g + direction() * 0.1f)}, wo, 0, {});
    ASSERT_TRUE(s.valid && s.transmitted);
    EXPECT_EQ(s.weight, grey(1));
    if (!s.bent) {
      EXPECT_LT(length(s.wi + wo), 1e-6);
    }
  }
}

TEST(NullBsdf, GoesStraightOn) {
  const Vec3 wo = normalize(Vec3{1, 2, 3});
  const BsdfSample s = sample_bsdf({}, {{0, 1, 0}, {0, 1, 0}}, wo, 0.5f, {});
  EXPECT_TRUE(s.valid && s.specular && s.transmitted);
  EXPECT_EQ(s.wi, -wo);
  EXPECT_EQ(s.weight, grey(1));
}

TEST(ConductorBsdf, MirrorsWithItsColour) {
  BsdfParameters metal;
  metal.eta = {0, 0.2f, 1.5f};
  metal.k = {1, 3, 4};
  Bsdf b;
  b.kind = BsdfKind::conductor;
  b.reflectance = {0.9f, 0.6f, 0.3f};
  b.parameters = &metal;
  const Vec3 n{0, 0, 1};
  const BsdfSample s = sample_bsdf(b, {n, n}, n, 0.5f, {});
  EXPECT_EQ(s.wi, n);
  // ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2) at normal incidence.
  EXPECT_NEAR(s.weight.r, 0.9, 1e-6);
  EXPECT_NEAR(s.weight.g, 0.6 * 9.64 / 10.44, 1e-6);
  EXPECT_NEAR(s.weight.b, 0.3 * 16.25 / 22.25, 1e-6);
  const BsdfSample oblique = sample_bsdf(b, {n, n}, {std::sqrt(0.75f), 0, 0.5f}, 0.5f, {});
  EXPECT_NEAR(oblique.weight.r, 0.9, 1e-6);
  EXPECT_LT(length(oblique.wi - Vec3{-std::sqrt(0.75f), 0, 0.5f}), 1e-6);
}

// One face of index 1.5 reflects 0.04 at normal incidence; a sheet's two faces 2 R / (1 + R) = 1/13. Nothing is lost, and
// nothing is bent.
TEST(ThinDielectricBsdf, ReflectsWithBothFaces) {
  BsdfParameters clear;
  Bsdf b;
  b.kind = BsdfKind::thin_dielectric;
  b.relative_index = 1.5f;
  b.parameters = &clear;
  const Vec3 n{0, 0, 1};
  for (const Vec3 wo : {n, -n}) {
    const BsdfSample reflected = sample_bsdf(b, {n, n}, wo, 0.0768f, {});
    EXPECT_FALSE(reflected.transmitted);
    EXPECT_NEAR(reflected.pdf, 1.0 / 13, 1e-6);
    EXPECT_EQ(reflected.weight, grey(1));
    EXPECT_EQ(reflected.wi, wo);
    const BsdfSample through = sample_bsdf(b, {n, n}, wo, 0.0770f, {});
    EXPECT_TRUE(through.transmitted && through.specular);
    EXPECT_NEAR(through.pdf, 12.0 / 13, 1e-6);
    EXPECT_EQ(through.weight, grey(1));
    EXPECT_EQ(through.wi, -wo);
  }
  clear.specular_reflectance = {0.5f, 1, 1};
  clear.specular_transmittance = {1, 0.25f, 1};
  EXPECT_EQ(sample_bsdf(b, {n, n}, n, 0, {}).weight, (Rgb{0.5f, 1, 1}));
  EXPECT_EQ(sample_bsdf(b, {n, n}, n, 0.9f, {}).weight, (Rgb{1, 0.25f, 1}));
}

TEST(DielectricBsdf, IsTintedByItsFactors) {
  BsdfParameters tints;
  tints.specular_reflectance = {0.5f, 1, 1};
  tints.specular_transmittance = {1, 0.25f, 1};
  Bsdf b = water(1.33f);
  b.parameters = &tints;
  const Vec3 n{0, 0, 1};
  EXPECT_EQ(sample_bsdf(b, {n, n}, n, 0, {}).weight, (Rgb{0.5f, 1, 1}));
  EXPECT_NEAR(sample_bsdf(b, {n, n}, n, 0.9f, {}).weight.g, 0.25 / (1.33 * 1.33), 1e-6);
}

TEST(SpecularBsdfs, HaveNoDensity) {
  for (const BsdfKind kind : {BsdfKind::null, BsdfKind::dielectric, BsdfKind::conductor, BsdfKind::thin_dielectric}) {
    Bsdf b;
    b.kind = kind;
    b.reflectance = grey(1);
    const Vec3 n{0, 0, 1};
    EXPECT_TRUE(is_specular(b));
    EXPECT_EQ(pdf_bsdf(b, {n, n}, n, n), 0.0f);
    EXPECT_TRUE(is_black(eval_bsdf(b, {n, n}, n, n)));
  }
}

}  // namespace
}  // namespace embrun

#include "materials/fresnel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <random>

namespace embrun {
namespace {

constexpr double pi_d = 3.14159265358979323846;

/// The textbook form in double: amplitudes from the two angles of Snell's law.
double textbook_reflectance(double incident, double relative_index) {
  const double s = std::sin(incident) / relative_index;
  if (s >= 1) return 1;
  const double transmitted = std::asin(s);
  if (incident == 0) return std::pow((relative_index - 1) / (relative_index + 1), 2);
  const double rs = std::sin(incident - transmitted) / std::sin(incident + transmitted);
  const double rp = std::tan(incident - transmitted) / std::tan(incident + transmitted);
  return 0.5 * (rs * rs + rp * rp);
}

TEST(Fresnel, NormalIncidenceOfWater) {
  // (0.33 / 2.33)^2
  EXPECT_NEAR(fresnel_dielectric(1, 1.33f).reflectance, 0.0200593, 1e-7);
  EXPECT_NEAR(fresnel_dielectric(1, 1 / 1.33f).reflectance, 0.0200593, 1e-7);
}

TEST(Fresnel, AgreesWithTheTextbookAtAllAngles) {
  for (const double index : {1.33, 1 / 1.33, 1.5, 1 / 1.5, 2.4, 1.001, 1 / 1.001})
    for (int i = 0; i < 900; ++i) {
      const double angle = i * 0.1 * pi_d / 180;
      const double sine = std::sin(angle) / static_cast<double>(static_cast<float>(index));
      if (std::fabs(sine - 1) < 1e-4) continue;  // the slope is infinite at the critical angle
      const FresnelResult f = fresnel_dielectric(static_cast<float>(std::cos(angle)), static_cast<float>(index));
      // The reflectance is least well conditioned where the difference from 1 of cosine or index is small.
      EXPECT_NEAR(f.reflectance, textbook_reflectance(angle, static_cast<float>(index)), 2e-4) << index << " " << i;
      EXPECT_NEAR(f.cos_transmitted, sine < 1 ? std::sqrt(1 - sine * sine) : 0, 2e-4);
    }
}

// At Brewster's angle atan(n) p-light is not reflected, so unpolarised reflectance is half that of s-light, which is
// ((1 - n^2)/(1 + n^2))^2 there.
TEST(Fresnel, BrewsterAngle) {
  const double n = 1.33, rs = (1 - n * n) / (1 + n * n);
  EXPECT_NEAR(fresnel_dielectric(static_cast<float>(std::cos(std::atan(n))), 1.33f).reflectance, 0.5 * rs * rs, 1e-6);
}

// Water to air: asin(1/1.33) = 48.7535 degrees.
TEST(Fresnel, CriticalAngle) {
  const auto at = [](double degrees) {
    return fresnel_dielectric(static_cast<float>(std::cos(degrees * pi_d / 180)), 1 / 1.33f);
  };
  EXPECT_LT(at(48.7530).reflectance, 1.0f);
  EXPECT_GT(at(48.7530).cos_transmitted, 0.0f);
  EXPECT_EQ(at(48.7540).reflectance, 1.0f);
  EXPECT_EQ(at(48.7540).cos_transmitted, 0.0f);
  EXPECT_EQ(at(89.9999).reflectance, 1.0f);
}

TEST(Fresnel, GrazingReflectsEverything) {
  EXPECT_NEAR(fresnel_dielectric(1e-6f, 1.33f).reflectance, 1, 1e-5);
  EXPECT_EQ(fresnel_dielectric(0, 1.33f).reflectance, 1.0f);
  EXPECT_EQ(fresnel_dielectric(0, 1 / 1.33f).reflectance, 1.0f);
}

// R is the same from both sides along one light path (Stokes's relation).
TEST(Fresnel, SameFromBothSides) {
  for (int i = 1; i <= 100; ++i) {
    const float cosine = static_cast<float>(i) / 100;
    const FresnelResult in = fresnel_dielectric(cosine, 1.33f);
    const FresnelResult out = fresnel_dielectric(in.cos_transmitted, 1 / 1.33f);
    // cos^2 is rounded to 1e-7, so the cosine itself to 1e-7 / cosine; dR/dcos is below 7.
    EXPECT_NEAR(out.cos_transmitted, cosine, 2e-7 / cosine);
    EXPECT_NEAR(in.reflectance, out.reflectance, 2e-6 + 7 * 2e-7 / cosine);
  }
}

TEST(Fresnel, MatchedIndicesPassEverythingStraight) {
  for (const float cosine : {1.0f, 0.5f, 1e-3f, 1e-7f, 1e-18f, 0.0f}) {
    const FresnelResult f = fresnel_dielectric(cosine, 1);
    EXPECT_EQ(f.reflectance, 0.0f);
    EXPECT_EQ(f.cos_transmitted, cosine);
  }
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 n = normalize(Vec3{normal(random), normal(random), normal(random)});
    Vec3 w = normalize(Vec3{normal(random), normal(random), normal(random)});
    if (dot(w, n) < 0) w = -w;
    const float c = dot(w, n);
    EXPECT_EQ(refract_through(w, n, c, fresnel_dielectric(c, 1).cos_transmitted, 1), -w);
  }
}

/// Amplitudes with a complex angle of refraction.
double complex_reflectance(double cosine, std::complex<double> index) {
  const std::complex<double> sine = std::sqrt(1 - cosine * cosine) / index, t = std::sqrt(1.0 - sine * sine);
  const std::complex<double> rs = (cosine - index * t) / (cosine + index * t);
  const std::complex<double> rp = (index * cosine - t) / (index * cosine + t);
  return 0.5 * (std::norm(rs) + std::norm(rp));
}

TEST(Fresnel, ConductorsAgreeWithComplexAmplitudes) {
  for (const auto& [eta, k] : {std::pair{0.2f, 3.0f}, {1.5f, 7.0f}, {0.05f, 0.4f}, {2.5f, 0.0f}, {0.0f, 2.0f}})
    for (int i = 1; i <= 50; ++i) {
      const float cosine = static_cast<float>(i) / 50;
      EXPECT_NEAR(fresnel_conductor(cosine, eta, k), complex_reflectance(cosine, {eta, k}), 2e-5)
          << eta << " + i " << k << ", " << cosine;
    }
  EXPECT_EQ(fresnel_conductor(0.0f, 0.2f, 3.0f), 1.0f);
  EXPECT_EQ(fresnel_conductor(0.0f, 0.0f, 1.0f), 1.0f);
}

// Without absorption it is a dielectric, total reflection included.
TEST(Fresnel, ConductorWithoutAbsorptionIsADielectric) {
  for (const float index : {1.33f, 1 / 1.33f})
    for (int i = 1; i <= 50; ++i) {
      const float cosine = static_cast<float>(i) / 50;
      EXPECT_NEAR(fresnel_conductor(cosine, index, 0), fresnel_dielectric(cosine, index).reflectance, 1e-4);
    }
}

// Snell's law: the tangential part of the direction shrinks by the relative index, and the plane is kept.
TEST(Refraction, ObeysSnell) {
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 n = normalize(Vec3{normal(random), normal(random), normal(random)});
    Vec3 w = normalize(Vec3{normal(random), normal(random), normal(random)});
    if (dot(w, n) < 0) w = -w;
    const float index = i % 2 ? 1.33f : 1 / 1.33f;
    const FresnelResult f = fresnel_dielectric(dot(w, n), index);
    if (f.reflectance == 1) continue;
    const Vec3 t = refract_through(w, n, dot(w, n), f.cos_transmitted, index);
    EXPECT_NEAR(length(t), 1, 2e-6);
    EXPECT_NEAR(dot(t, n), -f.cos_transmitted, 2e-6);
    const Vec3 along = w - n * dot(w, n), along_t = t - n * dot(t, n);
    EXPECT_LT(length(along + along_t * index), 4e-6);
  }
}

TEST(Reflection, MirrorsAboutTheNormal) {
  const Vec3 r = reflect_about(normalize(Vec3{1, 2, 3}), {0, 1, 0});
  EXPECT_LT(length(r - normalize(Vec3{-1, 2, -3})), 1e-6);
}

}  // namespace
}  // namespace embrun

#include "materials/shading_normal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "materials/bsdf.h"

namespace embrun {
namespace {

const float largest = 1 - 0x1p-24f;

Bsdf water(float relative_index) {
  Bsdf b;
  b.kind = BsdfKind::dielectric;
  b.relative_index = relative_index;
  return b;
}

/// Unit vector in the x-z plane, `degrees` from +z towards +x.
Vec3 at(double degrees) {
  const double a = degrees * M_PI / 180;
  return to_float({std::sin(a), 0, std::cos(a)});
}

TEST(BendToSide, LeavesTheRightSideAlone) {
  const BentVector b = bend_to_side(at(89), at(0));
  EXPECT_FALSE(b.bent);
  EXPECT_EQ(b.v, at(89));
}

// The nearest vector on the right side lies in the plane of both and on the rim.
TEST(BendToSide, TurnsByTheLeast) {
  for (const double degrees : {90.5, 100.0, 135.0, 179.0}) {
    const BentVector b = bend_to_side(at(degrees), at(0));
    EXPECT_TRUE(b.bent);
    EXPECT_NEAR(length(b.v), 1, 1e-6);
    EXPECT_LT(length(b.v - at(90)), 3e-5);
    EXPECT_GT(dot(b.v, at(0)), 0);
  }
}

TEST(BendToSide, OppositeVectorsAreSafe) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 axis = normalize(Vec3{normal(random), normal(random), normal(random)});
    const BentVector b = bend_to_side(-axis, axis);
    EXPECT_TRUE(is_finite(b.v));
    EXPECT_NEAR(length(b.v), 1, 1e-5);
    EXPECT_NEAR(dot(b.v, axis), 0, 2e-5);
  }
}

TEST(FaceTowards, TellsFrontFromBack) {
  const FacingNormals front = face_towards({at(0), at(10)}, at(30));
  EXPECT_TRUE(front.from_front);
  EXPECT_EQ(front.shading, at(10));
  const FacingNormals back = face_towards({at(0), at(10)}, at(150));
  EXPECT_FALSE(back.from_front);
  EXPECT_EQ(back.geometric, -at(0));
  EXPECT_EQ(back.shading, -at(10));
  EXPECT_FALSE(back.bent);
}

// A shading normal farther than 60 degrees from the true one is taken for the nearest that is not.
TEST(FaceTowards, KeepsTheShadingNormalNearTheTrueOne) {
  EXPECT_LT(length(face_towards({at(0), at(59)}, at(5)).shading - at(59)), 1e-6);
  for (const double degrees : {61.0, 89.0, 120.0, 175.0}) {
    const FacingNormals front = face_towards({at(0), at(degrees)}, at(5));
    EXPECT_LT(length(front.shading - at(60)), 1e-6);
    EXPECT_TRUE(front.bent);
    EXPECT_LT(length(face_towards({at(0), at(degrees)}, at(185)).shading - at(240)), 1e-6);
  }
}

// Any normals, any direction, any choice: reflection stays on the side, transmission crosses, weights are those of the
// furnace, nothing is dropped.
TEST(ShadingNormal, EveryCaseIsValidAndWhite) {
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform;
  const auto direction = [&] { return normalize(Vec3{normal(random), normal(random), normal(random)}); };
  int bent = 0;
  for (int i = 0; i < 200'000; ++i) {
    const Vec3 g = direction(), n = direction(), wo = direction();
    const float index = i % 3 == 0 ? 1.33f : i % 3 == 1 ? 1 / 1.33f : 1.0f;
    const BsdfSample s = sample_bsdf(water(index), {g, n}, wo, uniform(random), {});
    ASSERT_TRUE(s.valid);
    ASSERT_TRUE(is_finite(s.wi));
    ASSERT_NEAR(length(s.wi), 1, 1e-5);
    const bool crossed = dot(wo, g) * dot(s.wi, g) < 0;
    ASSERT_EQ(crossed, s.transmitted);
    ASSERT_EQ(s.weight, grey(s.transmitted ? refraction_radiance_factor(index) : 1.0f));
    bent += s.bent;
  }
  EXPECT_GT(bent, 50'000);
}

TEST(ShadingNormal, AgreeingNormalsAreNeverBent) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform;
  for (int i = 0; i < 100'000; ++i) {
    const Vec3 g = normalize(Vec3{normal(random), normal(random), normal(random)});
    const Vec3 wo = normalize(Vec3{normal(random), normal(random), normal(random)});
    if (std::fabs(dot(g, wo)) < 2e-5f) continue;
    ASSERT_FALSE(sample_bsdf(water(i % 2 ? 1.33f : 1 / 1.33f), {g, g}, wo, uniform(random), {}).bent);
  }
}

// Round the inside of a drop, by total reflections whose shading normals send them across: with the true normals the cosine
// stays 0.3 and a round takes 2 pi / (2 asin 0.3) = 11 of them. Bent to the surface itself, a path would never arrive.
TEST(ShadingNormal, TotalReflectionsGetOn) {
  constexpr double tilt = 25;
  Vec3 d = at(90 - 17.46);
  double degrees = 0, cosine = 0.3;
  int reflections = 0;
  for (; degrees < 360 && reflections < 1000; ++reflections) {
    const Vec3 outwards = at(degrees);
    // Turned against the path's way, which is towards +x at the top.
    const BsdfSample s = sample_bsdf(water(1 / 1.33f), {outwards, at(degrees - tilt)}, -d, 0, {});
    ASSERT_FALSE(s.transmitted);
    ASSERT_TRUE(s.bent);
    cosine = -static_cast<double>(dot(s.wi, outwards));
    // A chord at that cosine spans twice the angle to the tangent.
    const double onwards = 2 * std::asin(cosine) * 180 / M_PI;
    d = s.wi;
    degrees += onwards;
  }
  EXPECT_NEAR(cosine, 0.1, 0.02);
  EXPECT_LE(reflections, 36);
}

// Turning the shading normal steadily past the viewer's horizon and the surface's: directions and reflectance change
// steadily as well, without a jump. Between steps of 0.01 degrees a mirror direction turns by 0.02 degrees = 3.5e-4.
TEST(ShadingNormal, IsContinuousInTheNormal) {
  const Vec3 g = at(0), wo = at(-70);  // the horizon of wo is at +20 degrees
  BsdfSample before;
  for (int i = -8000; i <= 8000; ++i) {
    const BsdfSample s = sample_bsdf(water(1.33f), {g, at(i * 0.01)}, wo, 0, {});
    ASSERT_FALSE(s.transmitted);
    if (i > -8000) {
      ASSERT_LT(length(s.wi - before.wi), 5e-4) << i;
      ASSERT_NEAR(s.pdf, before.pdf, 0.005) << i;
    }
    before = s;
  }
}

TEST(ShadingNormal, TransmissionIsContinuousInTheNormal) {
  const Vec3 g = at(0), wo = at(-70);
  BsdfSample before;
  bool have = false;
  for (int i = -8000; i <= 8000; ++i) {
    const BsdfSample s = sample_bsdf(water(1.33f), {g, at(i * 0.01)}, wo, largest, {});
    if (!s.transmitted) continue;
    if (have) {
      // Near grazing incidence the refracted direction's slope in the normal is that of Snell's law: at most
      // about 1 + n per radian where cos_i enters by (cos_i / n - cos_t).
      ASSERT_LT(length(s.wi - before.wi), 8e-4) << i;
    }
    before = s;
    have = true;
  }
  EXPECT_TRUE(have);
}

// And as the viewer moves over the shading normal's horizon.
TEST(ShadingNormal, IsContinuousInTheViewer) {
  const Vec3 g = at(0);
  BsdfSample before;
  for (int i = -8990; i <= 8990; ++i) {
    const BsdfSample s = sample_bsdf(water(1.33f), {g, at(25)}, at(i * 0.01), 0, {});
    ASSERT_FALSE(s.transmitted);
    if (i > -8990) {
      ASSERT_LT(length(s.wi - before.wi), 5e-4) << i;
    }
    before = s;
  }
}

}  // namespace
}  // namespace embrun

#include "media/homogeneous.h"

#include <gtest/gtest.h>

#include <cmath>

namespace embrun {
namespace {

TEST(Absorption, FollowsBeerAndLambert) {
  const Rgb t = absorption_transmittance({0.5f, 1.0f, 2.0f}, 3.0f);
  EXPECT_NEAR(t.r, std::exp(-1.5), 1e-7);
  EXPECT_NEAR(t.g, std::exp(-3.0), 1e-7);
  EXPECT_NEAR(t.b, std::exp(-6.0), 1e-8);
}

TEST(Absorption, MultipliesAlongAPath) {
  const Rgb whole = absorption_transmittance(clear_water_absorption, 5.0f);
  const Rgb parts =
      absorption_transmittance(clear_water_absorption, 1.5f) * absorption_transmittance(clear_water_absorption, 3.5f);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(whole[c], parts[c], 1e-6);
}

TEST(Absorption, ClearMediaTransmitAtAnyDistance) {
  EXPECT_EQ(absorption_transmittance({}, infinity), grey(1));
  EXPECT_EQ(absorption_transmittance({1, 2, 3}, 0), grey(1));
  EXPECT_EQ(absorption_transmittance({1, 0, 0}, infinity), (Rgb{0, 1, 1}));
}

// Pure water is blue: it takes red light within metres, blue within a hundred.
TEST(Absorption, ClearWaterIsBlue) {
  const Rgb through_ten_metres = absorption_transmittance(clear_water_absorption, 10);
  EXPECT_LT(through_ten_metres.r, 0.1f);
  EXPECT_GT(through_ten_metres.b, 0.9f);
  EXPECT_GT(through_ten_metres.b, through_ten_metres.g);
}

}  // namespace
}  // namespace embrun

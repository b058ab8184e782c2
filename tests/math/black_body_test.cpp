#include "math/black_body.h"

#include <gtest/gtest.h>

namespace embrun {
namespace {

Vec3d xyz_of(Rgb c) {
  const auto r = static_cast<double>(c.r), g = static_cast<double>(c.g), b = static_cast<double>(c.b);
  return {0.4124564 * r + 0.3575761 * g + 0.1804375 * b, 0.2126729 * r + 0.7151522 * g + 0.0721750 * b,
          0.0193339 * r + 0.1191920 * g + 0.9503041 * b};
}

// Chromaticities of the Planckian locus by the CIE tables; the fit of the matching functions is good to a few thousandths.
TEST(BlackBody, HasTheColoursOfThePlanckianLocus) {
  struct Point {
    double kelvin, x, y;
  };
  for (const Point& p : {Point{2856, 0.4476, 0.4074}, Point{4000, 0.3805, 0.3768}, Point{6504, 0.3135, 0.3237},
                         Point{10000, 0.2807, 0.2884}}) {
    const Vec3d xyz = xyz_of(black_body_radiance(p.kelvin));
    const double sum = xyz.x + xyz.y + xyz.z;
    EXPECT_NEAR(xyz.x / sum, p.x, 0.004) << p.kelvin;
    EXPECT_NEAR(xyz.y / sum, p.y, 0.004) << p.kelvin;
  }
}

TEST(BlackBody, ItsUnitIsTheLuminanceAt1500Kelvin) {
  const Rgb ember = black_body_radiance(1500);
  // The blue that is cut off is a little negative.
  EXPECT_NEAR(luminance(ember), 1, 0.02);
  EXPECT_GT(ember.r, ember.g);
  EXPECT_EQ(ember.b, 0);
  EXPECT_EQ(black_body_radiance(0), Rgb{});
  // Planck's law weighted with the CIE's table of luminous efficiency at steps of 20 nm: 59.99 times as bright.
  EXPECT_NEAR(luminance(black_body_radiance(2000)), 60, 1);
}

}  // namespace
}  // namespace embrun

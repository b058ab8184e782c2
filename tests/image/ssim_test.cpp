#include "image/ssim.h"

#include <gtest/gtest.h>

#include <random>

#include "image/separable_filter.h"

namespace embrun {
namespace {

Image filled(int width, int height, float value, int channels = 1) {
  Image image = make_image(width, height, channels);
  image.pixels.assign(image.pixels.size(), value);
  return image;
}

TEST(Ssim, OfAPictureWithItselfIsOne) {
  Image a = filled(40, 30, 0, 3);
  std::mt19937 random(1);
  for (float& v : a.pixels) v = std::uniform_real_distribution<float>(0, 1)(random);
  EXPECT_DOUBLE_EQ(structural_similarity(a, a).value(), 1.0);
}

// Uniform pictures have means alone: (2 0.5 0.6 + 0.0001) / (0.25 + 0.36 + 0.0001).
TEST(Ssim, OfUniformPicturesComparesTheirMeans) {
  EXPECT_NEAR(structural_similarity(filled(20, 15, 0.5f), filled(20, 15, 0.6f)).value(), 0.6001 / 0.6101, 1e-6);
}

// One window, a point of height h in its middle. The middle's weight is g = (1 / sum over k of exp(-k^2 / 4.5))^2, the
// sum from -5 to 5: 3.759232, so g = 0.0707622. Mean h g, variance h^2 g (1 - g). Against half the point the covariance
// is half the variance; against black only the constants are left above the line.
TEST(Ssim, OfAPointIsAsTheWindowWeighsIt) {
  Image a = filled(11, 11, 0), b = a;
  a.at(5, 5) = 1.0f;
  constexpr double g = 0.0707622, variance = g * (1 - g), c1 = 1e-4, c2 = 9e-4;
  EXPECT_NEAR(structural_similarity(a, b).value(), c1 * c2 / ((g * g + c1) * (variance + c2)), 1e-6);
  b.at(5, 5) = 0.5f;
  EXPECT_NEAR(structural_similarity(a, b).value(),
              (g * g + c1) * (variance + c2) / ((1.25 * g * g + c1) * (1.25 * variance + c2)), 1e-6);
}

// Fine checkerboards of 0.5 +- 0.25, one the other's negative: means 0.5, variances 0.0625, covariance -0.0625.
TEST(Ssim, OfANegativeIsNegative) {
  Image a = filled(30, 30, 0), b = a;
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 30; ++x) {
      a.at(x, y) = (x + y) % 2 != 0 ? 0.75f : 0.25f;
      b.at(x, y) = 1.0f - a.at(x, y);
    }
  }
  EXPECT_NEAR(structural_similarity(a, b).value(), (-0.125 + 9e-4) / (0.125 + 9e-4), 1e-6);
}

TEST(Ssim, ColoursCountByTheirLuma) {
  Image red = filled(16, 16, 0, 3);
  for (std::size_t i = 0; i < red.pixels.size(); i += 3) red.pixels[i] = 1.0f;
  EXPECT_NEAR(structural_similarity(red, filled(16, 16, 0.2126f, 3)).value(), 1.0, 1e-6);
}

TEST(Ssim, NeedsAWholeWindow) {
  EXPECT_FALSE(structural_similarity(filled(10, 30, 0), filled(10, 30, 0)).has_value());
  EXPECT_TRUE(structural_similarity(filled(11, 11, 0), filled(11, 11, 0)).has_value());
}

TEST(SeparableFilter, WeighsNeighboursByTheirOffset) {
  Image point = filled(7, 6, 0);
  point.at(3, 2) = 1.0f;
  const Image out = filter_separably(point, {1, 2, 4}, {3, 5, 7, 11, 13});
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 7; ++x) {
      const double along_x[] = {4, 2, 1}, along_y[] = {13, 11, 7, 5, 3};  // the point lies at offset 3 - x, 2 - y
      const double expected = x >= 2 && x <= 4 && y <= 4 ? along_x[x - 2] * along_y[y] : 0.0;
      EXPECT_EQ(out.at(x, y), static_cast<float>(expected)) << x << " " << y;
    }
  }
}

TEST(SeparableFilter, GoesOnWithTheEdge) {
  Image ramp = filled(3, 2, 0);
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 3; ++x) ramp.at(x, y) = static_cast<float>(x);
  const Image out = filter_separably(ramp, {0, 0, 0, 0, 0, 0, 0, 0, 1}, {1});  // the value four to the right
  for (int x = 0; x < 3; ++x) EXPECT_EQ(out.at(x, 0), 2.0f);
  const Image up = filter_separably(ramp, {1}, {0.25, 0.25, 0.5});
  EXPECT_EQ(up, ramp);
}

}  // namespace
}  // namespace embrun

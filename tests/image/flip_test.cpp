#include "image/flip.h"

#include <gtest/gtest.h>

#include "image/metrics.h"

namespace embrun {
namespace {

Image filled(int width, int height, float r, float g, float b) {
  Image image = make_image(width, height, 3);
  for (std::size_t i = 0; i < image.pixels.size(); i += 3) {
    image.pixels[i] = r;
    image.pixels[i + 1] = g;
    image.pixels[i + 2] = b;
  }
  return image;
}

double flip_of(const Image& a, const Image& b, double pixels_per_degree = default_pixels_per_degree) {
  return mean_value(flip_map(a, b, pixels_per_degree));
}

TEST(Flip, EqualPicturesDoNotDiffer) {
  const Image a = filled(20, 10, 0.3f, 0.9f, 0.1f);
  for (float v : flip_map(a, a).pixels) EXPECT_EQ(v, 0.0f);
}

// Blurring leaves uniform pictures as they are, and they have neither edges nor points: what is left is the colour
// distance. Greys have only lightness: black against white 100, black against sRGB 0.5 (Y = 0.21404) 53.389. The
// farthest colours are green (L*a*b* 87.73 -86.18 83.18) and blue (32.30 79.19 -107.86); with a* and b* times L/100
// their HyAB distance is 55.43 + |(-101.19, 107.81)| = 203.29. To the power of 0.7: 25.119, 16.189 and 41.274, whose 40
// % are 16.510:
//   white: 0.95 + 0.05 (25.119 - 16.510) / (41.274 - 16.510) = 0.96738;  grey: 0.95 16.189 / 16.510 = 0.93155.
TEST(Flip, UniformGreysDifferByTheirLightness) {
  const Image black = filled(30, 20, 0, 0, 0);
  EXPECT_NEAR(flip_of(black, filled(30, 20, 1, 1, 1)), 0.96738, 5e-5);
  EXPECT_NEAR(flip_of(black, filled(30, 20, 0.5f, 0.5f, 0.5f)), 0.93155, 1e-4);
}

TEST(Flip, GreenAndBlueAreFarthest) {
  EXPECT_NEAR(flip_of(filled(30, 20, 0, 1, 0), filled(30, 20, 0, 0, 1)), 1.0, 1e-6);
}

/// Made of whole numbers, so that another program can make the very same: a ramp, a checkerboard, a product.
int first_value(int x, int y, int c) {
  return c == 0 ? (5 * x + 2 * y) % 256 : c == 1 ? ((x / 8 + y / 8) % 2 != 0 ? 188 : 68) : (x * y) % 256;
}

/// The same moved by a pixel, less red, and with a square inverted.
int second_value(int x, int y, int c) {
  int v = first_value(x > 0 ? x - 1 : 0, y, c);
  if (c == 0) v = v * 9 / 10;
  return x >= 30 && x < 38 && y >= 10 && y < 18 ? 255 - v : v;
}

template <class Value>
Image picture_of(const Value& value) {
  Image image = make_image(48, 32, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) image.at(x, y, c) = static_cast<float>(value(x, y, c)) / 255.0f;
  return image;
}

// The definition's formulas by hand, in double precision: HyAB distance 21.845683.
TEST(Flip, UniformColoursDifferByTheirHyabDistance) {
  EXPECT_NEAR(flip_of(filled(48, 32, 0.25f, 0.5f, 0.75f), filled(48, 32, 0.5f, 0.5f, 0.5f)), 0.4983344, 1e-6);
}

// What the authors' own implementation (github.com/NVlabs/flip at 1eb247c, FLIP.h) gives for these pictures. It works
// in single precision: of the uniform colours above it makes 0.498361 and 0.498368 at the two resolutions.
TEST(Flip, AgreesWithItsAuthors) {
  const Image a = picture_of(first_value), b = picture_of(second_value);
  const Image map = flip_map(a, b);
  EXPECT_NEAR(mean_value(map), 0.365147, 2e-5);
  EXPECT_NEAR(map.at(0, 0), 0.024739, 1e-4);
  EXPECT_NEAR(map.at(20, 7), 0.199989, 1e-4);
  EXPECT_NEAR(map.at(33, 12), 0.771380, 1e-4);
  EXPECT_NEAR(map.at(47, 31), 0.277342, 1e-4);
  const Image coarse = flip_map(a, b, 30);
  EXPECT_NEAR(mean_value(coarse), 0.426147, 2e-5);
  EXPECT_NEAR(coarse.at(33, 12), 0.964795, 1e-4);
}

TEST(Flip, IsSymmetric) {
  const Image a = picture_of(first_value), b = picture_of(second_value);
  EXPECT_EQ(flip_map(a, b), flip_map(b, a));
}

// Farther off, fine grain melts into grey: at many pixels a degree it is seen less than at few.
TEST(Flip, GrainIsLostFromAfar) {
  const Image even = filled(64, 64, 0.5f, 0.5f, 0.5f);
  Image grain = even;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      for (int c = 0; c < 3; ++c) grain.at(x, y, c) = (x + y) % 2 != 0 ? 0.55f : 0.45f;
  EXPECT_LT(flip_of(even, grain, 120), 0.5 * flip_of(even, grain, 20));
}

TEST(Flip, OnePixelIsEnough) { EXPECT_NEAR(flip_of(filled(1, 1, 0, 0, 0), filled(1, 1, 1, 1, 1)), 0.96738, 5e-5); }

}  // namespace
}  // namespace embrun

#include "image/tone_curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/error.h"

namespace embrun {
namespace {

TEST(ToneCurve, SrgbAtPublishedPoints) {
  // IEC 61966-2-1: 12.92 x up to 0.0031308, then 1.055 x^(1/2.4) - 0.055.
  EXPECT_NEAR(srgb_encode(0.0031308f), 0.0404500, 1e-6);
  EXPECT_NEAR(srgb_encode(0.001f), 0.01292, 1e-7);
  EXPECT_NEAR(srgb_encode(0.18f), 0.4613561, 1e-6);  // 18 % grey: 117.6 of 255
  EXPECT_NEAR(srgb_encode(0.5f), 0.7353569, 1e-6);
  EXPECT_EQ(srgb_encode(1.0f), 1.0f);
  EXPECT_EQ(srgb_encode(7.0f), 1.0f);
  EXPECT_EQ(srgb_encode(-1.0f), 0.0f);
  EXPECT_EQ(srgb_encode(std::numeric_limits<float>::quiet_NaN()), 0.0f);
  for (int i = 0; i <= 255; ++i) {
    const float encoded = static_cast<float>(i) / 255.0f;
    EXPECT_NEAR(srgb_encode(srgb_decode(encoded)), encoded, 1e-6f);
  }
}

TEST(ToneCurve, FilmicKeepsMidGreyRollsOffAndRises) {
  EXPECT_EQ(filmic_curve(0.0f), 0.0f);
  EXPECT_NEAR(filmic_curve(0.18f), 0.18f, 1e-4f);
  // The fit at y = 0.72317: y (2.51 y + 0.03) = 1.334386, y (2.43 y + 0.59) + 0.14 = 1.837526.
  EXPECT_NEAR(filmic_curve(1.0f), 1.334386 / 1.837526, 1e-5);
  EXPECT_LT(filmic_curve(9.5f), 1.0f);
  EXPECT_NEAR(filmic_curve(10.013f), 1.0f, 1e-5f);
  EXPECT_EQ(filmic_curve(1e30f), 1.0f);
  float before = 0;
  for (int i = 1; i <= 4000; ++i) {
    const float v = filmic_curve(0.0025f * static_cast<float>(i));
    EXPECT_GT(v, before);
    before = v;
  }
}

/// Position on the colour circle in [0, 6).
double hue(Rgb c) {
  const double high = static_cast<double>(max_component(c));
  const double low = static_cast<double>(min_of(c.r, min_of(c.g, c.b)));
  const double chroma = high - low;
  const double r = static_cast<double>(c.r), g = static_cast<double>(c.g), b = static_cast<double>(c.b);
  if (high == r) {
    return std::fmod((g - b) / chroma + 6.0, 6.0);
  }
  return high == g ? (b - r) / chroma + 2.0 : (r - g) / chroma + 4.0;
}

TEST(ToneCurve, FilmicKeepsTheHue) {
  for (const Rgb c : {Rgb{0.1f, 0.4f, 2.5f}, Rgb{0.02f, 0.05f, 0.04f}, Rgb{6.0f, 2.0f, 0.5f}, Rgb{0.9f, 1.0f, 0.2f}}) {
    const Rgb display = tone_map(c, {});
    const Rgb linear{srgb_decode(display.r), srgb_decode(display.g), srgb_decode(display.b)};
    EXPECT_NEAR(hue(linear), hue(c), 1e-3);
  }
  const Rgb white = tone_map({30.0f, 20.0f, 12.0f}, {});  // far above the white point of 10
  EXPECT_EQ(white.r, 1.0f);
  EXPECT_EQ(white.b, 1.0f);
}

TEST(ToneCurve, ExposureIsInStops) {
  for (const ToneCurve curve : {ToneCurve::srgb, ToneCurve::filmic}) {
    const Rgb a = tone_map({0.2f, 0.1f, 0.05f}, {.exposure = 1.5f, .curve = curve});
    const float factor = std::sqrt(8.0f);
    const Rgb b = tone_map(Rgb{0.2f, 0.1f, 0.05f} * factor, {.exposure = 0.0f, .curve = curve});
    EXPECT_NEAR(a.r, b.r, 1e-6f);
    EXPECT_NEAR(a.b, b.b, 1e-6f);
  }
}

TEST(ToneCurve, BadRadianceGivesDisplayValues) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Rgb c = tone_map({nan, infinity, -1.0f}, {});
  EXPECT_EQ(c.r, 0.0f);
  EXPECT_EQ(c.g, 1.0f);
  EXPECT_EQ(c.b, 0.0f);
}

TEST(ToneCurve, NamesGoBothWays) {
  EXPECT_EQ(tone_curve_from_name("srgb"), ToneCurve::srgb);
  EXPECT_EQ(tone_curve_from_name(name_of(ToneCurve::filmic)), ToneCurve::filmic);
  EXPECT_THROW(tone_curve_from_name("aces"), Error);
}

TEST(Dither, KeepsExactLevels) {
  for (int level = 0; level <= 255; ++level) {
    for (int i = 0; i < 64; ++i) {
      ASSERT_EQ(quantize(static_cast<float>(level) / 255.0f, 37 * i, 11 * i, true), level);
    }
  }
}

TEST(Dither, MeanIsTheValueAndBlocksAreEven) {
  constexpr int size = 128, block = 8;
  const float value = 100.3f;
  double sum = 0, squares = 0;
  for (int y0 = 0; y0 < size; y0 += block) {
    for (int x0 = 0; x0 < size; x0 += block) {
      double mean = 0;
      for (int y = y0; y < y0 + block; ++y) {
        for (int x = x0; x < x0 + block; ++x) {
          const int q = quantize(value / 255.0f, x, y, true);
          ASSERT_TRUE(q == 100 || q == 101);
          mean += q / static_cast<double>(block * block);
        }
      }
      sum += mean;
      squares += (mean - 100.3) * (mean - 100.3);
    }
  }
  constexpr double blocks = (size / block) * (size / block);
  EXPECT_NEAR(sum / blocks, 100.3, 0.01);
  // White noise would spread the blocks by sqrt(0.3 * 0.7 / 64) = 0.057: no clumps means much less.
  EXPECT_LT(std::sqrt(squares / blocks), 0.057 / 2.5);
}

TEST(Dither, RoundsToNearestWithout) {
  EXPECT_EQ(quantize(100.4f / 255.0f, 3, 5, false), 100);
  EXPECT_EQ(quantize(100.6f / 255.0f, 3, 5, false), 101);
  EXPECT_EQ(quantize(2.0f, 0, 0, false), 255);
  EXPECT_EQ(quantize(-2.0f, 0, 0, true), 0);
}

// Display values are what an undithered PNG holds, before rounding.
TEST(DisplayImage, IsRoundedDisplayValues) {
  Image radiance = make_image(3, 1, 3, "beauty");
  radiance.pixels = {0.0f, 0.18f, 2.0f, 0.4f, 0.01f, 0.3f, 20.0f, 0.7f, -1.0f};
  const ToneSettings tone{0.5f, ToneCurve::filmic, false};
  const Image values = display_values(radiance, tone);
  const DisplayImage display = to_display(radiance, tone);
  for (std::size_t i = 0; i < 9; ++i)
    EXPECT_EQ(display.pixels[i], static_cast<int>(std::lround(255 * values.pixels[i]))) << i;
}

TEST(DisplayImage, CropIsDitheredAsTheWhole) {
  Image whole = make_image(16, 16, 3, "beauty");
  for (std::size_t i = 0; i < whole.pixels.size(); ++i) {
    whole.pixels[i] = static_cast<float>(i % 97) / 90.0f;
  }
  Image crop = make_image(5, 6, 3, "beauty");
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 5; ++x) {
      for (int c = 0; c < 3; ++c) {
        crop.at(x, y, c) = whole.at(x + 7, y + 3, c);
      }
    }
  }
  const DisplayImage a = to_display(whole, {}), b = to_display(crop, {}, 7, 3);
  for (std::size_t y = 0; y < 6; ++y) {
    for (std::size_t i = 0; i < 15; ++i) {
      EXPECT_EQ(b.pixels[y * 15 + i], a.pixels[((y + 3) * 16 + 7) * 3 + i]);
    }
  }
}

TEST(DisplayImage, DepthRunsFromNearToFarAndInfinityIsBlack) {
  Image depth = make_image(4, 1, 1, "depth");
  depth.pixels = {2.0f, 4.0f, 6.0f, infinity};
  const DisplayImage shown = to_display(depth, {.dither = false});
  EXPECT_EQ(shown.channels, 1);
  EXPECT_EQ(shown.pixels[0], 255);  // nearest: 1
  EXPECT_EQ(shown.pixels[1], 140);  // halfway: 0.55
  EXPECT_EQ(shown.pixels[2], 26);   // farthest: 0.1
  EXPECT_EQ(shown.pixels[3], 0);
  EXPECT_NE(shown.note.find("255 is 2 m"), std::string::npos);
  depth.pixels.assign(4, infinity);
  EXPECT_EQ(to_display(depth, {}).pixels, std::vector<std::uint8_t>(4, 0));
  depth.pixels.assign(4, 3.0f);
  EXPECT_EQ(to_display(depth, {}).pixels, std::vector<std::uint8_t>(4, 255));
}

TEST(DisplayImage, NormalsSamplesAndVariance) {
  Image normal = make_image(1, 1, 3, "normal");
  normal.pixels = {-1.0f, 0.2f, 1.0f};
  EXPECT_EQ(to_display(normal, {.dither = false}).pixels, (std::vector<std::uint8_t>{0, 153, 255}));  // 0.6 * 255
  Image samples = make_image(2, 1, 1, "samples");
  samples.pixels = {16.0f, 64.0f};
  EXPECT_EQ(to_display(samples, {.dither = false}).pixels, (std::vector<std::uint8_t>{64, 255}));
  Image variance = make_image(1, 1, 3, "variance");
  variance.pixels = {0.25f, 0.0f, 4.0f};  // standard errors 0.5, 0, 2; sRGB of 0.5 is 187.5
  const DisplayImage shown = to_display(variance, {.dither = false});
  EXPECT_EQ(shown.pixels, (std::vector<std::uint8_t>{188, 0, 255}));
}

}  // namespace
}  // namespace embrun

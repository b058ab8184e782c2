#include "image/false_color.h"

#include <gtest/gtest.h>

#include <cmath>

#include "image/tone_curve.h"

namespace embrun {
namespace {

/// 8-bit display values, as a PNG file gets them.
DisplayImage shown(const Image& image) { return to_display(image, {0, ToneCurve::srgb, false}); }

double lightness(Rgb display) {
  return 0.2126 * static_cast<double>(srgb_decode(display.r)) + 0.7152 * static_cast<double>(srgb_decode(display.g)) +
         0.0722 * static_cast<double>(srgb_decode(display.b));
}

TEST(FalseColor, GoesFromBlackToPaleYellowAndGetsLighterAllTheWay) {
  const Rgb first = false_color(0), last = false_color(1);
  EXPECT_NEAR(first.b, 4.0 / 255, 1e-6);
  EXPECT_EQ(first.r, 0.0f);
  EXPECT_NEAR(last.r, 252.0 / 255, 1e-6);
  EXPECT_NEAR(last.b, 191.0 / 255, 1e-6);
  EXPECT_NEAR(false_color(0.5).r, 183.0 / 255, 1e-6);  // b73779
  for (int i = 0; i < 1000; ++i)
    EXPECT_LT(lightness(false_color(i / 1000.0)), lightness(false_color((i + 1) / 1000.0)));
  EXPECT_EQ(false_color(-1), first);
  EXPECT_EQ(false_color(7), last);
  EXPECT_EQ(false_color(std::nan("")), first);
}

TEST(FalseColor, TheScaleIsRoundAndAboveNearlyAll) {
  Image values = make_image(1000, 1, 1);
  for (std::size_t i = 0; i < 1000; ++i) values.pixels[i] = 0.0031f * static_cast<float>(i) / 995.0f;
  EXPECT_DOUBLE_EQ(false_color_scale(values), 0.005);  // 99.5 % below 0.0031
  for (float& v : values.pixels) v *= 0.3f;            // 0.00093
  EXPECT_DOUBLE_EQ(false_color_scale(values), 0.001);
  values.pixels.assign(1000, 0.0f);
  EXPECT_EQ(false_color_scale(values), 1.0);
  values.pixels[3] = 30.0f;  // a lone pixel is not lost in black
  EXPECT_EQ(false_color_scale(values), 50.0);
}

TEST(FalseColor, PicturesShowValuesOverTheScale) {
  Image values = make_image(2, 2, 1);
  values.pixels = {0.0f, 0.25f, 0.5f, 3.0f};
  const Image picture = false_color_picture(values, 0.5);
  ASSERT_EQ(picture.height, 2);  // too narrow for a legend
  const DisplayImage display = shown(picture);
  const std::uint8_t expected[] = {0, 0, 4, 183, 55, 121, 252, 253, 191, 252, 253, 191};
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(display.pixels[i], expected[i]) << i;
}

TEST(FalseColor, WidePicturesHaveALegend) {
  const Image picture = false_color_picture(make_image(200, 3, 1), 0.02);
  ASSERT_EQ(picture.height, 3 + legend_height);
  const DisplayImage display = shown(picture);
  const auto pixel = [&](int x, int y) { return &display.pixels[static_cast<std::size_t>(3 * (200 * y + x))]; };
  // The map from edge to edge.
  EXPECT_EQ(pixel(0, 3 + 5)[2], 4);
  EXPECT_EQ(pixel(199, 3 + 5)[1], 253);
  // "0", "0.01" and "0.02" are 5, 23 and 23 pixels wide: at the left, around the middle, at the right. Nothing between.
  const auto ink = [&](int from, int to) {
    int count = 0;
    for (int y = 3 + 15; y < 3 + 22; ++y)
      for (int x = from; x < to; ++x) count += pixel(x, y)[0] == 255 ? 1 : 0;
    return count;
  };
  EXPECT_EQ(ink(0, 5), 19);  // the strokes of a 0 in 5 x 7
  EXPECT_EQ(ink(5, 88), 0);
  EXPECT_GT(ink(88, 112), 40);
  EXPECT_EQ(ink(112, 177), 0);
  EXPECT_GT(ink(177, 200), 40);
}

}  // namespace
}  // namespace embrun

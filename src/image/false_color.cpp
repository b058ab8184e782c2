#include "image/false_color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "image/tone_curve.h"

namespace embrun {
namespace {

constexpr std::array<std::array<std::uint8_t, 3>, 9> anchors{{{0x00, 0x00, 0x04},
                                                              {0x1d, 0x11, 0x47},
                                                              {0x51, 0x12, 0x7c},
                                                              {0x83, 0x26, 0x81},
                                                              {0xb7, 0x37, 0x79},
                                                              {0xe5, 0x50, 0x64},
                                                              {0xfb, 0x87, 0x61},
                                                              {0xfe, 0xc2, 0x87},
                                                              {0xfc, 0xfd, 0xbf}}};

// ---- numbers -----------------------------------------------------------------------------------------------------

constexpr int glyph_width = 5, glyph_height = 7;
constexpr std::string_view glyph_names = "0123456789.-+e";
/// Rows from the top; bit 4 is the left pixel.
constexpr std::array<std::array<std::uint8_t, glyph_height>, 14> glyphs{{{14, 17, 19, 21, 25, 17, 14},
                                                                         {4, 12, 4, 4, 4, 4, 14},
                                                                         {14, 17, 1, 2, 4, 8, 31},
                                                                         {31, 2, 4, 2, 1, 17, 14},
                                                                         {2, 6, 10, 18, 31, 2, 2},
                                                                         {31, 16, 30, 1, 1, 17, 14},
                                                                         {6, 8, 16, 30, 17, 17, 14},
                                                                         {31, 1, 2, 4, 8, 8, 8},
                                                                         {14, 17, 17, 14, 17, 17, 14},
                                                                         {14, 17, 17, 15, 1, 2, 12},
                                                                         {0, 0, 0, 0, 0, 12, 12},
                                                                         {0, 0, 0, 31, 0, 0, 0},
                                                                         {0, 4, 4, 31, 4, 4, 0},
                                                                         {0, 0, 14, 17, 31, 16, 14}}};

void set_pixel(Image& image, int x, int y, Rgb linear) {
  for (int c = 0; c < 3; ++c) image.at(x, y, c) = linear[c];
}

std::string number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", v);
  return text;
}

int text_width(const std::string& text) { return static_cast<int>(text.size()) * (glyph_width + 1) - 1; }

/// White, its top left corner at (x, y); the text must fit (it is clipped otherwise).
void draw_text(Image& image, int x, int y, const std::string& text) {
  for (const char character : text) {
    const std::size_t glyph = glyph_names.find(character);
    for (int row = 0; glyph != std::string_view::npos && row < glyph_height; ++row) {
      for (int column = 0; column < glyph_width; ++column) {
        const bool ink = (glyphs[glyph][static_cast<std::size_t>(row)] >> (glyph_width - 1 - column) & 1) != 0;
        if (ink && x + column >= 0 && x + column < image.width) set_pixel(image, x + column, y + row, grey(1.0f));
      }
    }
    x += glyph_width + 1;
  }
}

Rgb linear_false_color(double x) {
  const Rgb c = false_color(x);
  return {srgb_decode(c.r), srgb_decode(c.g), srgb_decode(c.b)};
}

/// The map from edge to edge, ticks, and the numbers below them.
void draw_legend(Image& image, int top, double scale) {
  constexpr int bar_top = 3, bar_bottom = 11, text_top = 15;
  for (int y = bar_top; y < bar_bottom; ++y) {
    for (int x = 0; x < image.width; ++x) {
      set_pixel(image, x, top + y, linear_false_color(static_cast<double>(x) / (image.width - 1)));
    }
  }
  for (const double share : {0.0, 0.5, 1.0}) {
    const int tick = static_cast<int>(share * (image.width - 1) + 0.5);
    for (int y = bar_bottom; y < text_top - 1; ++y) set_pixel(image, tick, top + y, grey(1.0f));
    const std::string text = number(share * scale);
    const int x = std::clamp(tick - text_width(text) / 2, 0, image.width - text_width(text));
    draw_text(image, x, top + text_top, text);
  }
}

}  // namespace

Rgb false_color(double x) {
  const double place = (x > 0 ? std::min(x, 1.0) : 0.0) * (anchors.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(place), anchors.size() - 2);
  const double f = place - static_cast<double>(i);
  const auto channel = [&](std::size_t c) {
    return static_cast<float>((anchors[i][c] * (1 - f) + anchors[i + 1][c] * f) / 255);
  };
  return {channel(0), channel(1), channel(2)};
}

double false_color_scale(const Image& values) {
  EMBRUN_CHECK(values.channels == 1);
  std::vector<float> sorted = values.pixels;
  if (sorted.empty()) return 1;
  const auto last =
      sorted.begin() + static_cast<std::ptrdiff_t>(std::ceil(0.995 * static_cast<double>(sorted.size()))) - 1;
  std::nth_element(sorted.begin(), last, sorted.end());
  const double high = static_cast<double>(*last > 0 ? *last : *std::max_element(sorted.begin(), sorted.end()));
  if (!(high > 0)) return 1;
  const double decade = std::pow(10.0, std::floor(std::log10(high)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (high <= step * decade) return step * decade;
  }
  return 10 * decade;
}

Image false_color_picture(const Image& values, double scale) {
  EMBRUN_CHECK(values.channels == 1 && scale > 0);
  const bool legend = values.width >= legend_least_width;
  Image out = make_image(values.width, values.height + (legend ? legend_height : 0), 3);
  for (int y = 0; y < values.height; ++y) {
    for (int x = 0; x < values.width; ++x) {
      set_pixel(out, x, y, linear_false_color(static_cast<double>(values.at(x, y)) / scale));
    }
  }
  if (legend) draw_legend(out, values.height, scale);
  return out;
}

}  // namespace embrun

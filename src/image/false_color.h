#pragma once

#include "image/image.h"
#include "math/rgb.h"

namespace embrun {

/// Display values (sRGB-encoded) of the map at x, clipped to [0, 1]: black, purple, orange, pale yellow. Straight lines
/// between nine colours of the map "magma" [VanDerWalt2015]; lightness grows with x all the way, so that the map reads
/// in grey, too.
Rgb false_color(double x);

/// A round number (1, 2 or 5 times a power of ten) that at least 99.5 % of the values of a picture with one channel do
/// not exceed: the scale for its false colours. 1 where all are 0 or less.
double false_color_scale(const Image& values);

/// The picture in false colours, of which the brightest stands for `scale` (positive, checked) and all above: linear
/// RGB to be encoded as sRGB without another tone curve. At least `legend_least_width` pixels wide, it gets a strip of
/// `legend_height` rows below: the map, and numbers at 0, half the scale and the scale.
Image false_color_picture(const Image& values, double scale);

inline constexpr int legend_height = 24;
inline constexpr int legend_least_width = 128;

}  // namespace embrun

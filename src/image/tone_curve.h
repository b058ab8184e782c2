#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "image/image.h"
#include "math/rgb.h"
#include "math/srgb.h"

namespace embrun {

/// How linear radiance becomes display values.
/// - srgb: clipped at 1, then the sRGB transfer function. Exact for pictures within [0, 1].
/// - filmic: a curve with a toe and a shoulder before the sRGB transfer function; highlights roll off up to radiance
///   10 instead of clipping at 1, so that glints on water and the sky around the sun keep their shape. 18 % grey
///   stays 18 % grey. See filmic_curve().
enum class ToneCurve { srgb, filmic };

/// The curve of that name ("srgb", "filmic"); throws Error that lists the names.
ToneCurve tone_curve_from_name(const std::string& name);
const char* name_of(ToneCurve curve);

struct ToneSettings {
  float exposure = 0;                   ///< stops: radiance is multiplied by 2^exposure first
  ToneCurve curve = ToneCurve::filmic;  ///< the default: suits water under a sky
  bool dither = true;                   ///< spread the rounding to 8 bits over neighbouring pixels (no bands)
};

/// Display-linear value of radiance x >= 0, in [0, 1], increasing: Narkowicz's fit of the ACES output transform,
///   f(y) = y (2.51 y + 0.03) / (y (2.43 y + 0.59) + 0.14),  y = 0.72317 x,
/// [Narkowicz2015], scaled so that f keeps 0.18; reaches 1 at x = 10.
float filmic_curve(float x);

/// Display values in [0, 1] (sRGB-encoded) of a radiance. The filmic curve is applied to the largest and smallest
/// channel and the middle one is placed between them as it was, which keeps the hue (the DNG reference
/// implementation maps tones so); what is far above 1 goes to white. NaN and negative channels count as 0.
Rgb tone_map(Rgb radiance, const ToneSettings& settings);

/// tone_map() of each pixel of a picture with three channels (checked): what a PNG file gets before it is rounded to 8
/// bits.
Image display_values(const Image& radiance, const ToneSettings& settings);

/// Rounds v in [0, 1] to 0..255. With dithering, adds a threshold that depends on the pixel's place alone: an
/// integer form of the R2 sequence [Roberts2018], close to blue noise. Values k/255 are kept.
std::uint8_t quantize(float v, int x, int y, bool dither);

/// An 8-bit picture of a layer: width * height * channels bytes (channels 1 or 3), row 0 at the top.
struct DisplayImage {
  int width = 0, height = 0, channels = 0;
  std::vector<std::uint8_t> pixels;
  std::string note;  ///< how the values were mapped, for the file's metadata; such as the range of depths
};

/// The layer as a picture to look at, by its name:
/// - beauty, and any name not listed: tone_map();
/// - albedo: sRGB, without exposure;      - normal: 0.5 + 0.5 n, not encoded (a component 0 is 127.5);
/// - depth: 1 at the nearest to 0.1 at the farthest finite depth of the picture, 0 where it is infinite;
/// - samples: share of the greatest count;  - variance: its root (the standard error), exposed, sRGB.
/// `x0`, `y0`: place of the image in the full picture, so that a crop is dithered as the whole is.
DisplayImage to_display(const Image& layer, const ToneSettings& settings, int x0 = 0, int y0 = 0);

}  // namespace embrun

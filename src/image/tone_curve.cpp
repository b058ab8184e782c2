#include "image/tone_curve.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.h"

namespace embrun {
namespace {

/// f(x) for the largest and the smallest channel; the middle one keeps its place between them.
Rgb map_keeping_hue(Rgb c) {
  const float high = max_component(c);
  const float low = min_of(c.r, min_of(c.g, c.b));
  const float mapped_high = filmic_curve(high);
  const float mapped_low = filmic_curve(low);
  const float slope = high > low ? (mapped_high - mapped_low) / (high - low) : 0.0f;
  const auto map = [&](float v) { return v >= high ? mapped_high : mapped_low + (v - low) * slope; };
  return {map(c.r), map(c.g), map(c.b)};
}

/// How a layer's values become display values; made once per picture.
struct DisplayMap {
  enum class Kind { radiance, albedo, normal, depth, samples, variance } kind = Kind::radiance;
  float low = 0, high = 1;  ///< range of the finite values: depth, samples
};

DisplayMap display_map_for(const Image& layer, std::string& note) {
  DisplayMap map;
  if (layer.name == "albedo") {
    map.kind = DisplayMap::Kind::albedo;
    note = "albedo, sRGB";
  } else if (layer.name == "normal") {
    map.kind = DisplayMap::Kind::normal;
    note = "0.5 + 0.5 normal, linear";
  } else if (layer.name == "variance") {
    map.kind = DisplayMap::Kind::variance;
    note = "standard error (root of the variance), sRGB";
  } else if (layer.name == "depth" || layer.name == "samples") {
    map.kind = layer.name == "depth" ? DisplayMap::Kind::depth : DisplayMap::Kind::samples;
    map.low = infinity;
    map.high = -infinity;
    for (float v : layer.pixels) {
      if (is_finite(v)) {
        map.low = min_of(map.low, v);
        map.high = max_of(map.high, v);
      }
    }
    char text[160];
    if (map.kind == DisplayMap::Kind::samples) {
      std::snprintf(text, sizeof text, "samples, linear: 255 is %g", static_cast<double>(map.high));
    } else if (map.low > map.high) {
      std::snprintf(text, sizeof text, "depth: infinite everywhere");
    } else {
      std::snprintf(text, sizeof text, "depth, linear: 255 is %g m, 25.5 is %g m, 0 is infinite",
                    static_cast<double>(map.low), static_cast<double>(map.high));
    }
    note = text;
  }
  return map;
}

float apply(const DisplayMap& map, float v, float exposure_factor) {
  switch (map.kind) {
    case DisplayMap::Kind::albedo: return srgb_encode(v);
    case DisplayMap::Kind::normal: return is_finite(v) ? clamp(0.5f + 0.5f * v, 0.0f, 1.0f) : 0.5f;
    case DisplayMap::Kind::depth:
      if (!is_finite(v)) {
        return 0.0f;
      }
      return map.high > map.low ? 1.0f - 0.9f * ((v - map.low) / (map.high - map.low)) : 1.0f;
    case DisplayMap::Kind::samples: return is_finite(v) && map.high > 0.0f ? clamp(v / map.high, 0.0f, 1.0f) : 0.0f;
    case DisplayMap::Kind::variance: return srgb_encode(sqrtf(max_of(v, 0.0f)) * exposure_factor);
    case DisplayMap::Kind::radiance: break;
  }
  return 0.0f;
}

}  // namespace

ToneCurve tone_curve_from_name(const std::string& name) {
  for (const ToneCurve curve : {ToneCurve::srgb, ToneCurve::filmic}) {
    if (name == name_of(curve)) {
      return curve;
    }
  }
  throw Error("unknown tone curve \"" + name + "\"; there are: srgb, filmic");
}

const char* name_of(ToneCurve curve) { return curve == ToneCurve::srgb ? "srgb" : "filmic"; }

float filmic_curve(float x) {
  // The fit passes 1 at y = 7.2410; beyond 10 / 0.72317 everything is white.
  const float y = 0.72317f * min_of(x, 16.0f);
  return min_of(1.0f, y * (2.51f * y + 0.03f) / (y * (2.43f * y + 0.59f) + 0.14f));
}

Rgb tone_map(Rgb radiance, const ToneSettings& settings) {
  const float factor = exp2f(settings.exposure);
  Rgb c;
  for (int i = 0; i < 3; ++i) {
    const float v = radiance[i] * factor;
    c[i] = v > 0.0f ? min_of(v, 1e30f) : 0.0f;
  }
  if (settings.curve == ToneCurve::filmic) {
    c = map_keeping_hue(c);
  }
  return {srgb_encode(c.r), srgb_encode(c.g), srgb_encode(c.b)};
}

Image display_values(const Image& radiance, const ToneSettings& settings) {
  EMBRUN_CHECK(radiance.channels == 3);
  Image out = make_image(radiance.width, radiance.height, 3);
  for (std::size_t i = 0; i < out.pixels.size(); i += 3) {
    const Rgb v = tone_map({radiance.pixels[i], radiance.pixels[i + 1], radiance.pixels[i + 2]}, settings);
    for (int c = 0; c < 3; ++c) out.pixels[i + static_cast<std::size_t>(c)] = v[c];
  }
  return out;
}

std::uint8_t quantize(float v, int x, int y, bool dither) {
  const float scaled = 255.0f * clamp(v, 0.0f, 1.0f);
  if (!dither) {
    return static_cast<std::uint8_t>(scaled + 0.5f);
  }
  // R2 sequence in units of 2^-32; a triangle wave of it is closer to blue noise than the sawtooth.
  const std::uint32_t r = static_cast<std::uint32_t>(x) * 3242174889u + static_cast<std::uint32_t>(y) * 2447445414u;
  const std::uint32_t triangle = r < 0x80000000u ? 2 * r : 2 * (0xffffffffu - r);
  // Kept off 0 and 1, so that values k/255 stay as they are in spite of rounding.
  const float threshold = 0.004f + 0.992f * static_cast<float>(triangle >> 8) * 0x1p-24f;
  return static_cast<std::uint8_t>(min_of(scaled + threshold, 255.0f));
}

DisplayImage to_display(const Image& layer, const ToneSettings& settings, int x0, int y0) {
  DisplayImage out;
  out.width = layer.width;
  out.height = layer.height;
  out.channels = layer.channels >= 3 ? 3 : 1;
  const DisplayMap map = display_map_for(layer, out.note);
  const float factor = exp2f(settings.exposure);
  out.pixels.resize(layer.pixel_count() * static_cast<std::size_t>(out.channels));
  std::size_t next = 0;
  for (int y = 0; y < layer.height; ++y) {
    for (int x = 0; x < layer.width; ++x) {
      Rgb v = out.channels == 3 ? Rgb{layer.at(x, y, 0), layer.at(x, y, 1), layer.at(x, y, 2)} : grey(layer.at(x, y));
      if (map.kind == DisplayMap::Kind::radiance) {
        v = tone_map(v, settings);
      } else {
        v = {apply(map, v.r, factor), apply(map, v.g, factor), apply(map, v.b, factor)};
      }
      for (int c = 0; c < out.channels; ++c) {
        out.pixels[next++] = quantize(v[c], x0 + x, y0 + y, settings.dither);
      }
    }
  }
  if (map.kind == DisplayMap::Kind::radiance) {
    char text[80];
    std::snprintf(text, sizeof text, "%s tone curve, exposure %+g stops", name_of(settings.curve),
                  static_cast<double>(settings.exposure));
    out.note = text;
  }
  return out;
}

}  // namespace embrun

#pragma once

#include "math/vec.h"

namespace embrun {

/// Linear RGB with Rec. 709 primaries: radiance, reflectance, throughput, extinction per channel.
struct Rgb {
  float r = 0, g = 0, b = 0;

  EMBRUN_FN float& operator[](int channel) { return channel == 0 ? r : channel == 1 ? g : b; }
  EMBRUN_FN float operator[](int channel) const { return channel == 0 ? r : channel == 1 ? g : b; }
};

EMBRUN_FN Rgb grey(float v) { return {v, v, v}; }
EMBRUN_FN Rgb operator+(Rgb a, Rgb b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
EMBRUN_FN Rgb operator-(Rgb a, Rgb b) { return {a.r - b.r, a.g - b.g, a.b - b.b}; }
EMBRUN_FN Rgb operator*(Rgb a, Rgb b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
EMBRUN_FN Rgb operator*(Rgb a, float s) { return {a.r * s, a.g * s, a.b * s}; }
EMBRUN_FN Rgb operator*(float s, Rgb a) { return a * s; }
EMBRUN_FN Rgb& operator+=(Rgb& a, Rgb b) { return a = a + b; }
EMBRUN_FN Rgb& operator*=(Rgb& a, Rgb b) { return a = a * b; }
EMBRUN_FN Rgb& operator*=(Rgb& a, float s) { return a = a * s; }
EMBRUN_FN bool operator==(Rgb a, Rgb b) { return a.r == b.r && a.g == b.g && a.b == b.b; }
EMBRUN_FN float max_component(Rgb a) { return max_of(a.r, max_of(a.g, a.b)); }
EMBRUN_FN float mean(Rgb a) { return (a.r + a.g + a.b) * (1.0f / 3.0f); }
/// Relative luminance (ITU-R BT.709).
EMBRUN_FN float luminance(Rgb a) { return 0.2126f * a.r + 0.7152f * a.g + 0.0722f * a.b; }
EMBRUN_FN bool is_black(Rgb a) { return a.r == 0.0f && a.g == 0.0f && a.b == 0.0f; }
EMBRUN_FN bool is_finite(Rgb a) { return is_finite(a.r) && is_finite(a.g) && is_finite(a.b); }
EMBRUN_FN Rgb exp_of(Rgb a) { return {expf(a.r), expf(a.g), expf(a.b)}; }

}  // namespace embrun

#pragma once

#include <cstdint>

#include "math/rgb.h"

namespace embrun {

enum class TextureKind : uint8_t { constant, checker, uv_checker, bitmap };
/// What a bitmap shows outside [0, 1].
enum class TextureWrap : uint8_t { repeat, mirror, clamp };
enum class TextureFilter : uint8_t { bilinear, nearest };

/// A colour over space, in scene coordinates. `checker` divides the plane of two axes into square cells of size `cell`
/// (metres): with i = floor((p - origin)[axis_u] / cell) and j likewise, i + j even shows `first`, odd `second`.
struct Texture {
  TextureKind kind = TextureKind::constant;
  uint8_t axis_u = 0, axis_v = 2;
  float cell = 1;
  Vec3 origin;  ///< corner of cell (0, 0), which shows `first`
  Rgb first{0.5f, 0.5f, 0.5f};
  Rgb second;
};

inline Texture constant_texture(Rgb value) {
  Texture t;
  t.first = value;
  return t;
}

EMBRUN_FN Rgb evaluate_texture(const Texture& texture, Vec3 point) {
  if (texture.kind == TextureKind::constant) return texture.first;
  const Vec3 p = point - texture.origin;
  const float i = floorf(p[texture.axis_u] / texture.cell);
  const float j = floorf(p[texture.axis_v] / texture.cell);
  const float half = 0.5f * (i + j);
  return half == floorf(half) ? texture.first : texture.second;
}

}  // namespace embrun

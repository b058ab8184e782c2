#pragma once

#include <cstdint>

#include "math/rgb.h"

namespace embrun {

enum class TextureKind : uint8_t { constant, checker, uv_checker, bitmap, own };
/// What a bitmap shows outside [0, 1].
enum class TextureWrap : uint8_t { repeat, mirror, clamp };
enum class TextureFilter : uint8_t { bilinear, nearest };

/// A picture's values: `channels` (1 or 3) for each pixel, row by row.
struct PictureView {
  const float* values = nullptr;
  int width = 0, height = 0, channels = 3;

  EMBRUN_FN Rgb at(int x, int y) const {
    const float* v = values + (static_cast<std::int64_t>(y) * width + x) * channels;
    return channels == 1 ? grey(v[0]) : Rgb{v[0], v[1], v[2]};
  }
};

/// A colour over space, in scene coordinates, or over a surface's own coordinates (u, v). `checker` divides the plane of
/// two axes into square cells of size `cell` (metres): with i = floor((p - origin)[axis_u] / cell) and j likewise, i + j
/// even shows `first`, odd `second`. `uv_checker` has cells of half a unit of u and v. `bitmap` shows `picture` in
/// [0, 1] x [0, 1], its first row at v = 0; values lie at the middles of the pixels. `own` is the colour that the surface has
/// itself, as point clouds do.
struct Texture {
  TextureKind kind = TextureKind::constant;
  uint8_t axis_u = 0, axis_v = 2;
  TextureWrap wrap = TextureWrap::repeat;
  TextureFilter filter = TextureFilter::bilinear;
  float cell = 1;
  Vec3 origin;  ///< corner of cell (0, 0), which shows `first`
  Rgb first{0.5f, 0.5f, 0.5f};
  Rgb second;
  /// (u, v) become (u_axis . (u, v, 1), v_axis . (u, v, 1)) before they are looked up.
  Vec3 u_axis{1, 0, 0}, v_axis{0, 1, 0};
  PictureView picture;
};

inline Texture constant_texture(Rgb value) {
  Texture t;
  t.first = value;
  return t;
}

/// A coordinate brought near [0, 1], where pixels can be counted; `mirror` into [0, 2].
EMBRUN_FN float wrapped_coordinate(float t, TextureWrap wrap) {
  if (!is_finite(t)) return 0.0f;
  if (wrap == TextureWrap::clamp) return clamp(t, 0.0f, 1.0f);
  return wrap == TextureWrap::mirror ? t - 2.0f * floorf(0.5f * t) : t - floorf(t);
}

/// The pixel that is shown in place of number `i` of a row of n.
EMBRUN_FN int wrapped_pixel(int i, int n, TextureWrap wrap) {
  if (wrap == TextureWrap::repeat) i = i < 0 ? i + n : i >= n ? i - n : i;
  if (wrap == TextureWrap::mirror) i = i < 0 ? -1 - i : i >= 2 * n ? i - 2 * n : i >= n ? 2 * n - 1 - i : i;
  return min_of(max_of(i, 0), n - 1);
}

EMBRUN_LOCAL_FN Rgb evaluate_bitmap(const Texture& texture, float u, float v) {
  const PictureView& picture = texture.picture;
  float x = wrapped_coordinate(u, texture.wrap) * static_cast<float>(picture.width);
  float y = wrapped_coordinate(v, texture.wrap) * static_cast<float>(picture.height);
  const auto pixel = [&](int i, int j) {
    return picture.at(wrapped_pixel(i, picture.width, texture.wrap), wrapped_pixel(j, picture.height, texture.wrap));
  };
  if (texture.filter == TextureFilter::nearest) return pixel(static_cast<int>(floorf(x)), static_cast<int>(floorf(y)));
  x -= 0.5f;
  y -= 0.5f;
  const float column = floorf(x), row = floorf(y), a = x - column, b = y - row;
  const int i = static_cast<int>(column), j = static_cast<int>(row);
  return (1.0f - b) * ((1.0f - a) * pixel(i, j) + a * pixel(i + 1, j)) +
         b * ((1.0f - a) * pixel(i, j + 1) + a * pixel(i + 1, j + 1));
}

/// `point` in the scene, `uv` the surface's coordinates there, `own` its own colour.
EMBRUN_FN Rgb evaluate_texture(const Texture& texture, Vec3 point, Vec2 uv, Rgb own = {1, 1, 1}) {
  if (texture.kind == TextureKind::constant) return texture.first;
  if (texture.kind == TextureKind::own) return own;
  if (texture.kind == TextureKind::checker) {
    const Vec3 p = point - texture.origin;
    const float i = floorf(p[texture.axis_u] / texture.cell);
    const float j = floorf(p[texture.axis_v] / texture.cell);
    const float half = 0.5f * (i + j);
    return half == floorf(half) ? texture.first : texture.second;
  }
  const Vec3 w{uv.x, uv.y, 1.0f};
  const float u = dot(texture.u_axis, w), v = dot(texture.v_axis, w);
  if (texture.kind == TextureKind::bitmap) return evaluate_bitmap(texture, u, v);
  return (u - floorf(u) > 0.5f) == (v - floorf(v) > 0.5f) ? texture.first : texture.second;
}

}  // namespace embrun

#pragma once

#include <cstdint>

#include "lights/light_sample.h"
#include "math/up_axis.h"
#include "sampling/distribution.h"
#include "sampling/warp.h"

namespace embrun {

enum class EnvironmentKind : uint8_t {
  none,      ///< black
  constant,  ///< the same radiance from every direction
  image,     ///< latitude-longitude image, bilinear between pixel centres
};

/// Light from infinitely far, over the whole sphere of directions. A view: the arrays belong to an EnvironmentImage.
///
/// Image convention (that of OpenEXR): row 0 is at the zenith; the middle column is in the direction `basis.back`, and
/// `basis.right` is a quarter of the image to its left.
struct Environment {
  EnvironmentKind kind = EnvironmentKind::none;
  Rgb constant;                ///< of `constant`
  const float* rgb = nullptr;  ///< width x height x 3
  int width = 0, height = 0;
  Distribution2D pixels;  ///< probability of each pixel for sampling
  UpBasis basis;          ///< which way is up
  float turn = 0;         ///< rotation about up, as a fraction of a circle, anticlockwise from above
};

/// Place in the image, in fractions of its width [0, 1) and height [0, 1].
struct LatLong {
  float u = 0, v = 0;
};

EMBRUN_FN LatLong latlong_from_direction(const Environment& env, Vec3 direction) {
  const float right = dot(direction, env.basis.right);
  const float back = dot(direction, env.basis.back);
  const float up = dot(direction, env.basis.up);
  const float longitude = atan2f(right, back) * (0.5f * inv_pi);
  const float u = 0.5f - longitude + env.turn;
  const float polar = atan2f(sqrtf(right * right + back * back), up);
  return {min_of(u - floorf(u), 0x1.fffffep-1f), polar * inv_pi};
}

/// Unit direction at longitude fraction `u` and polar angle `polar` (radians from the zenith).
EMBRUN_FN Vec3 direction_from_latlong(const Environment& env, float u, float polar) {
  const float longitude = 2.0f * pi * (0.5f - u + env.turn);
  const float ring = sinf(polar);
  return env.basis.right * (ring * sinf(longitude)) + env.basis.back * (ring * cosf(longitude)) +
         env.basis.up * cosf(polar);
}

EMBRUN_FN Rgb environment_pixel(const Environment& env, int x, int y) {
  const float* p = env.rgb + 3 * (static_cast<long>(y) * env.width + x);
  return {p[0], p[1], p[2]};
}

/// Bilinear look-up; columns wrap round, the first and last half row are constant along the meridian.
EMBRUN_LOCAL_FN Rgb lookup_latlong(const Environment& env, LatLong place) {
  const float x = place.u * static_cast<float>(env.width) - 0.5f;
  const float y = clamp(place.v * static_cast<float>(env.height) - 0.5f, 0.0f, static_cast<float>(env.height - 1));
  const float fx = x - floorf(x), fy = y - floorf(y);
  const int x0 = static_cast<int>(floorf(x));
  const int left = x0 < 0 ? env.width - 1 : x0;
  const int right = x0 + 1 >= env.width ? 0 : x0 + 1;
  const int top = static_cast<int>(y);
  const int bottom = min_of(top + 1, env.height - 1);
  const Rgb upper = environment_pixel(env, left, top) * (1.0f - fx) + environment_pixel(env, right, top) * fx;
  const Rgb lower = environment_pixel(env, left, bottom) * (1.0f - fx) + environment_pixel(env, right, bottom) * fx;
  return upper * (1.0f - fy) + lower * fy;
}

/// Radiance arriving from `direction` (unit, pointing away from the scene).
EMBRUN_FN Rgb environment_radiance(const Environment& env, Vec3 direction) {
  if (env.kind == EnvironmentKind::none) return {};
  if (env.kind == EnvironmentKind::constant) return env.constant;
  return lookup_latlong(env, latlong_from_direction(env, direction));
}

/// Solid angle of a pixel of row `y`.
EMBRUN_FN float latlong_pixel_solid_angle(const Environment& env, int y) {
  // cos a - cos b = 2 sin((a + b)/2) sin((b - a)/2) does not cancel at the poles.
  const float row_angle = pi / static_cast<float>(env.height);
  const int from_pole = min_of(y, env.height - 1 - y);
  const float bands = 2.0f * sinf((static_cast<float>(from_pole) + 0.5f) * row_angle) * sinf(0.5f * row_angle);
  return bands * (2.0f * pi / static_cast<float>(env.width));
}

/// Polar angle at the fraction `v` of the solid angle of row `y`, from its upper edge.
EMBRUN_FN float polar_angle_in_row(int height, int y, float v) {
  // Uniform in sin^2(polar/2) = (1 - cos polar)/2; from whichever pole is nearer, for precision.
  const bool southern = 2 * y >= height;
  const float half_row = 0.5f * pi / static_cast<float>(height);
  const float upper =
      southern ? sinf(static_cast<float>(height - 1 - y) * half_row) : sinf(static_cast<float>(y) * half_row);
  const float lower =
      southern ? sinf(static_cast<float>(height - y) * half_row) : sinf(static_cast<float>(y + 1) * half_row);
  const float f = southern ? 1.0f - v : v;
  const float half_sine2 = upper * upper * (1.0f - f) + lower * lower * f;
  const float polar = 2.0f * asinf(min_of(sqrtf(half_sine2), 1.0f));
  return southern ? pi - polar : polar;
}

/// Density with which sample_environment draws `direction`, per steradian.
EMBRUN_LOCAL_FN float environment_pdf(const Environment& env, Vec3 direction) {
  if (env.kind == EnvironmentKind::none) return 0.0f;
  if (env.kind == EnvironmentKind::constant) return uniform_sphere_pdf();
  const LatLong place = latlong_from_direction(env, direction);
  const int x = min_of(static_cast<int>(place.u * static_cast<float>(env.width)), env.width - 1);
  const int y = min_of(static_cast<int>(place.v * static_cast<float>(env.height)), env.height - 1);
  return cell_probability(env.pixels, x, y) / latlong_pixel_solid_angle(env, y);
}

/// Draws a direction: a pixel in proportion to its light, then uniformly over the pixel's solid angle.
EMBRUN_LOCAL_FN LightSample sample_environment(const Environment& env, Sample2 u) {
  LightSample s;
  if (env.kind == EnvironmentKind::none) return s;
  s.distance = infinity;
  s.valid = true;
  if (env.kind == EnvironmentKind::constant) {
    s.direction = sample_uniform_sphere(u);
    s.radiance = env.constant;
    s.pdf = uniform_sphere_pdf();
    return s;
  }
  const CellSample cell = sample_cell(env.pixels, u);
  const float longitude = (static_cast<float>(cell.x) + cell.remainder.x) / static_cast<float>(env.width);
  const float polar = polar_angle_in_row(env.height, cell.y, cell.remainder.y);
  s.direction = direction_from_latlong(env, longitude, polar);
  s.radiance = lookup_latlong(env, {longitude, polar * inv_pi});
  s.pdf = cell.probability / latlong_pixel_solid_angle(env, cell.y);
  return s;
}

}  // namespace embrun

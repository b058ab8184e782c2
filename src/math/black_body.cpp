#include "math/black_body.h"

#include <algorithm>
#include <cmath>

namespace embrun {
namespace {

/// A bell with different widths on its two sides.
double lobe(double x, double middle, double below, double above) {
  const double d = (x - middle) / (x < middle ? below : above);
  return std::exp(-0.5 * d * d);
}

/// Spectral radiance by Planck's law but for a factor, which the unit takes out.
double planck(double nanometres, double kelvin) {
  constexpr double second_radiation_constant = 1.438776877e7;  // nm K
  return std::pow(nanometres, -5) / std::expm1(second_radiation_constant / (nanometres * kelvin));
}

Vec3d black_body_xyz(double kelvin) {
  Vec3d xyz;
  constexpr double step = 2;
  for (double wavelength = 360; wavelength <= 830; wavelength += step)
    xyz = xyz + planck(wavelength, kelvin) * step * color_matching(wavelength);
  return xyz;
}

}  // namespace

Vec3d color_matching(double w) {
  return {1.056 * lobe(w, 599.8, 37.9, 31.0) + 0.362 * lobe(w, 442.0, 16.0, 26.7) - 0.065 * lobe(w, 501.1, 20.4, 26.2),
          0.821 * lobe(w, 568.8, 46.9, 40.5) + 0.286 * lobe(w, 530.9, 16.3, 31.1),
          1.217 * lobe(w, 437.0, 11.8, 36.0) + 0.681 * lobe(w, 459.0, 26.0, 13.8)};
}

Vec3d rgb_from_xyz(Vec3d xyz) {
  return {3.2404542 * xyz.x - 1.5371385 * xyz.y - 0.4985314 * xyz.z,
          -0.9692660 * xyz.x + 1.8760108 * xyz.y + 0.0415560 * xyz.z,
          0.0556434 * xyz.x - 0.2040259 * xyz.y + 1.0572252 * xyz.z};
}

Rgb black_body_radiance(double kelvin) {
  if (!(kelvin > 0)) return {};
  static const double unit = black_body_xyz(1500).y;
  const Vec3d rgb = rgb_from_xyz(black_body_xyz(kelvin) * (1 / unit));
  const auto channel = [](double v) { return static_cast<float>(std::max(v, 0.0)); };
  return {channel(rgb.x), channel(rgb.y), channel(rgb.z)};
}

}  // namespace embrun

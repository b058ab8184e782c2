#include "math/spectrum.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "math/black_body.h"

namespace embrun {
namespace {

/// The spectrum of D65, every 10 nm from 380 nm [CIE015].
constexpr double first_wavelength = 380, last_wavelength = 780, table_step = 10;
constexpr double daylight[] = {49.9755, 54.6482, 82.7549, 91.4860, 93.4318, 86.6823, 104.865, 117.008, 117.812,
                               114.861, 115.923, 108.811, 109.354, 107.802, 104.790, 107.689, 104.405, 104.046,
                               100.000, 96.3342, 95.7880, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886, 83.6992,
                               80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.3490, 61.6040, 69.8856,
                               75.0870, 63.5927, 46.4182, 66.8054, 63.3828};

double daylight_at(double wavelength) {
  const double place = (wavelength - first_wavelength) / table_step;
  const auto cell = std::min(static_cast<std::size_t>(place), std::size(daylight) - 2);
  const double share = place - static_cast<double>(cell);
  return daylight[cell] + share * (daylight[cell + 1] - daylight[cell]);
}

double value_at(std::span<const SpectrumSample> spectrum, double wavelength) {
  const auto after = std::lower_bound(spectrum.begin(), spectrum.end(), wavelength,
                                      [](const SpectrumSample& s, double w) { return s.wavelength < w; });
  if (after == spectrum.end()) return 0;
  if (after->wavelength == wavelength) return after->value;
  if (after == spectrum.begin()) return 0;
  const SpectrumSample& before = *(after - 1);
  const double share = (wavelength - before.wavelength) / (after->wavelength - before.wavelength);
  return before.value + share * (after->value - before.value);
}

/// The colour of value(wavelength), where a value of 1 has a luminance of 1.
template <class Value>
Vec3d color_of(bool in_daylight, const Value& value) {
  Vec3d sum;
  double norm = 0;
  for (double wavelength = first_wavelength; wavelength <= last_wavelength; ++wavelength) {
    const double light = in_daylight ? daylight_at(wavelength) : 1;
    const Vec3d weight = light * color_matching(wavelength);
    sum = sum + value(wavelength) * weight;
    norm += weight.y;
  }
  return rgb_from_xyz(sum * (1 / norm));
}

Rgb in_gamut(Vec3d c) {
  const auto channel = [](double v) { return static_cast<float>(std::max(v, 0.0)); };
  return {channel(c.x), channel(c.y), channel(c.z)};
}

}  // namespace

Rgb rgb_of_light(std::span<const SpectrumSample> spectrum) {
  return in_gamut(color_of(false, [&](double w) { return value_at(spectrum, w); }));
}

Rgb rgb_in_daylight(std::span<const SpectrumSample> spectrum) {
  const Vec3d color = color_of(true, [&](double w) { return value_at(spectrum, w); });
  // White is exactly white: the observer's fit and the table agree to two digits only.
  const Vec3d white = color_of(true, [](double) { return 1.0; });
  return in_gamut({color.x / white.x, color.y / white.y, color.z / white.z});
}

}  // namespace embrun

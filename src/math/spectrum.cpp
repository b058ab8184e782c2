#include "math/spectrum.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace embrun {
namespace {

/// The colour-matching functions and the spectrum of D65, every 10 nm from 380 nm [CIE015].
struct Observer {
  double x, y, z, daylight;
};
constexpr double first_wavelength = 380, table_step = 10;
constexpr Observer observer[] = {{0.001368, 0.000039, 0.006450, 49.9755}, {0.004243, 0.000120, 0.020050, 54.6482},
                                 {0.014310, 0.000396, 0.067850, 82.7549}, {0.043510, 0.001210, 0.207400, 91.4860},
                                 {0.134380, 0.004000, 0.645600, 93.4318}, {0.283900, 0.011600, 1.385600, 86.6823},
                                 {0.348280, 0.023000, 1.747060, 104.865}, {0.336200, 0.038000, 1.772110, 117.008},
                                 {0.290800, 0.060000, 1.669200, 117.812}, {0.195360, 0.090980, 1.287640, 114.861},
                                 {0.095640, 0.139020, 0.812950, 115.923}, {0.032010, 0.208020, 0.465180, 108.811},
                                 {0.004900, 0.323000, 0.272000, 109.354}, {0.009300, 0.503000, 0.158200, 107.802},
                                 {0.063270, 0.710000, 0.078250, 104.790}, {0.165500, 0.862000, 0.042160, 107.689},
                                 {0.290400, 0.954000, 0.020300, 104.405}, {0.433450, 0.994950, 0.008750, 104.046},
                                 {0.594500, 0.995000, 0.003900, 100.000}, {0.762100, 0.952000, 0.002100, 96.3342},
                                 {0.916300, 0.870000, 0.001650, 95.7880}, {1.026300, 0.757000, 0.001100, 88.6856},
                                 {1.062200, 0.631000, 0.000800, 90.0062}, {1.002600, 0.503000, 0.000340, 89.5991},
                                 {0.854450, 0.381000, 0.000190, 87.6987}, {0.642400, 0.265000, 0.000050, 83.2886},
                                 {0.447900, 0.175000, 0.000020, 83.6992}, {0.283500, 0.107000, 0.000000, 80.0268},
                                 {0.164900, 0.061000, 0.000000, 80.2146}, {0.087400, 0.032000, 0.000000, 82.2778},
                                 {0.046770, 0.017000, 0.000000, 78.2842}, {0.022700, 0.008210, 0.000000, 69.7213},
                                 {0.011359, 0.004102, 0.000000, 71.6091}, {0.005790, 0.002091, 0.000000, 74.3490},
                                 {0.002899, 0.001047, 0.000000, 61.6040}, {0.001440, 0.000520, 0.000000, 69.8856},
                                 {0.000690, 0.000249, 0.000000, 75.0870}, {0.000332, 0.000120, 0.000000, 63.5927},
                                 {0.000166, 0.000060, 0.000000, 46.4182}, {0.000083, 0.000030, 0.000000, 66.8054},
                                 {0.000042, 0.000015, 0.000000, 63.3828}};
constexpr int table_size = static_cast<int>(std::size(observer));

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

struct Xyz {
  double x = 0, y = 0, z = 0;
};

/// Sums over the visible in steps of 1 nm, divided by the sum of y.
template <class Value>
Xyz integrate(bool daylight, const Value& value) {
  Xyz sum;
  double norm = 0;
  constexpr int steps = static_cast<int>(table_step) * (table_size - 1);
  for (int i = 0; i <= steps; ++i) {
    const int cell = std::min(i / static_cast<int>(table_step), table_size - 2);
    const double f = i / table_step - cell;
    const Observer &a = observer[cell], &b = observer[cell + 1];
    const double light = daylight ? a.daylight + f * (b.daylight - a.daylight) : 1;
    const double weight = light * value(first_wavelength + i);
    sum.x += weight * (a.x + f * (b.x - a.x));
    sum.y += weight * (a.y + f * (b.y - a.y));
    sum.z += weight * (a.z + f * (b.z - a.z));
    norm += light * (a.y + f * (b.y - a.y));
  }
  return {sum.x / norm, sum.y / norm, sum.z / norm};
}

/// The matrix of Rec. 709, without a cut.
Vec3d to_rgb(const Xyz& c) {
  return {3.240479 * c.x - 1.537150 * c.y - 0.498535 * c.z, -0.969256 * c.x + 1.875991 * c.y + 0.041556 * c.z,
          0.055648 * c.x - 0.204043 * c.y + 1.057311 * c.z};
}

Rgb in_gamut(Vec3d c) {
  const auto channel = [](double v) { return static_cast<float>(std::max(v, 0.0)); };
  return {channel(c.x), channel(c.y), channel(c.z)};
}

}  // namespace

Rgb rgb_of_light(std::span<const SpectrumSample> spectrum) {
  return in_gamut(to_rgb(integrate(false, [&](double w) { return value_at(spectrum, w); })));
}

Rgb rgb_in_daylight(std::span<const SpectrumSample> spectrum) {
  const Vec3d color = to_rgb(integrate(true, [&](double w) { return value_at(spectrum, w); }));
  // White is exactly white: the tables and the matrix agree to four digits only.
  const Vec3d white = to_rgb(integrate(true, [](double) { return 1.0; }));
  return in_gamut({color.x / white.x, color.y / white.y, color.z / white.z});
}

}  // namespace embrun

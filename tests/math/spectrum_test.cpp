#include "math/spectrum.h"

#include <gtest/gtest.h>

#include <vector>

namespace embrun {
namespace {

void expect_near(Rgb color, Rgb expected, float tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(color[c], expected[c], tolerance) << "channel " << c;
}

// Light of the same power at all wavelengths has X = Y = Z = 1: the row sums of the matrix from XYZ to linear sRGB
// (IEC 61966-2-1). The observer's fit [Wyman2013] is good to a per cent.
TEST(Spectrum, EqualEnergyIsPink) {
  const std::vector<SpectrumSample> flat{{380, 1}, {780, 1}};
  expect_near(rgb_of_light(flat), {1.2048f, 0.9483f, 0.9088f}, 0.012f);
}

// sRGB's white is D65: its light, by the CIE's table every 20 nm, is grey, and a grey surface in it exactly so.
TEST(Spectrum, DaylightIsWhite) {
  const std::vector<SpectrumSample> d65{
      {380, 49.98}, {400, 82.75}, {420, 93.43}, {440, 104.9}, {460, 117.8}, {480, 115.9}, {500, 109.4},
      {520, 104.8}, {540, 104.4}, {560, 100.0}, {580, 95.79}, {600, 90.01}, {620, 87.70}, {640, 83.70},
      {660, 80.21}, {680, 78.28}, {700, 71.61}, {720, 61.60}, {740, 75.09}, {760, 46.42}, {780, 63.38}};
  const Rgb white = rgb_of_light(d65);
  expect_near(white * (1 / white.g), {1, 1, 1}, 0.02f);
  const std::vector<SpectrumSample> half{{380, 0.5}, {780, 0.5}};
  expect_near(rgb_in_daylight(half), {0.5f, 0.5f, 0.5f}, 1e-6f);
}

// Gold by its measured index [JohnsonChristy1972], by the formula for normal incidence, seen in daylight. Expected is the sum
// over the CIE's tables of the observer and of D65 at steps of 10 nm, made apart from this code. Its colour is a hard one: a
// steep edge in the green, and more red than sRGB has.
TEST(Spectrum, GoldIsGolden) {
  struct Index {
    double wavelength, n, k;
  };
  std::vector<SpectrumSample> reflectance;
  for (const Index& i :
       {Index{381.5, 1.66, 1.956}, Index{397.4, 1.47, 1.952}, Index{413.3, 1.46, 1.958}, Index{430.5, 1.45, 1.948},
        Index{450.9, 1.38, 1.914}, Index{471.4, 1.31, 1.849}, Index{495.9, 1.04, 1.833}, Index{520.9, 0.62, 2.081},
        Index{548.6, 0.43, 2.455}, Index{582.1, 0.29, 2.863}, Index{616.8, 0.21, 3.272}, Index{659.5, 0.14, 3.697},
        Index{704.5, 0.13, 4.103}, Index{756.0, 0.14, 4.542}, Index{821.1, 0.16, 5.083}})
    reflectance.push_back({i.wavelength, ((i.n - 1) * (i.n - 1) + i.k * i.k) / ((i.n + 1) * (i.n + 1) + i.k * i.k)});
  expect_near(rgb_in_daylight(reflectance), {1.035f, 0.728f, 0.365f}, 0.005f);
}

}  // namespace
}  // namespace embrun

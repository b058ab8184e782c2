#pragma once

#include <span>

#include "math/rgb.h"

namespace embrun {

/// A value at a wavelength in nanometres.
struct SpectrumSample {
  double wavelength = 0, value = 0;
};

// A spectrum as linear RGB (Rec. 709), by the CIE 1931 observer from 380 to 780 nm. Between its samples, whose
// wavelengths must increase, a spectrum is linear; beyond them it is 0. Channels outside the gamut count as 0.

/// Of light with that spectrum; one that is 1 everywhere has a luminance of 1.
Rgb rgb_of_light(std::span<const SpectrumSample> spectrum);

/// Of a surface that reflects (or a medium that absorbs) so, in daylight, D65: 1 everywhere is 1,1,1.
Rgb rgb_in_daylight(std::span<const SpectrumSample> spectrum);

}  // namespace embrun

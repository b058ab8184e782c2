#pragma once

#include "math/rgb.h"

namespace embrun {

/// Absorption of clear water per metre for the red, green and blue channel: the measured absorption of pure water at
/// the tabulated wavelengths (610, 550 and 465 nm) nearest to the dominant wavelengths of the Rec. 709 primaries
/// (611, 549 and 464 nm) [PopeFry1997]. Three samples of a steep spectrum rather than a fit to it: metres of
/// water come out right, tens of metres only roughly.
inline constexpr Rgb clear_water_absorption{0.2644f, 0.0565f, 0.0101f};

/// Transmittance over `distance` metres (0 or more, may be infinite) of a medium that only absorbs:
/// exp(-absorption * distance) per channel. A channel without absorption transmits 1 at any distance.
EMBRUN_FN Rgb absorption_transmittance(Rgb absorption, float distance) {
  return {absorption.r == 0.0f ? 1.0f : expf(-absorption.r * distance),
          absorption.g == 0.0f ? 1.0f : expf(-absorption.g * distance),
          absorption.b == 0.0f ? 1.0f : expf(-absorption.b * distance)};
}

}  // namespace embrun

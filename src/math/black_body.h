#pragma once

#include "math/rgb.h"
#include "math/vec.h"

// Host code: spectra are made colours when a scene is compiled.

namespace embrun {

/// The CIE 1931 colour matching functions at a wavelength in nanometres, by the fit of [Wyman2013].
Vec3d color_matching(double wavelength);

/// Linear RGB (Rec. 709) of XYZ; channels of colours outside the triangle of its primaries are negative.
Vec3d rgb_from_xyz(Vec3d xyz);

/// Colour of a black body's radiance [BornWolf1999], in units in which one of 1500 K (glowing lava, embers) has luminance 1. Channels that
/// come out negative, as the blue of what only glows red, are 0. Temperatures in kelvin; 0 is black.
Rgb black_body_radiance(double kelvin);

}  // namespace embrun

#pragma once

#include "image/image.h"

namespace embrun {

/// A screen 0.7 m wide of 3840 pixels seen from 0.7 m, the default of FLIP's authors: 3840 pi / 180.
inline constexpr double default_pixels_per_degree = 67.02064327658226;

/// LDR-FLIP [Andersson2020]: for each pixel the difference, from 0 to 1, that one sees when flipping between two
/// pictures of display values (sRGB-encoded, in [0, 1]; what lies outside is clipped). Colours are blurred as the eye
/// does at that many pixels per degree of the visual field and compared as Hunt-adjusted L*a*b* by their HyAB distance;
/// edges and points that only one picture has increase the error. One channel; "the" FLIP of two pictures is its mean.
/// Symmetric. Pictures must have the same size and three channels, and the resolution must be positive (checked).
Image flip_map(const Image& a, const Image& b, double pixels_per_degree = default_pixels_per_degree);

}  // namespace embrun

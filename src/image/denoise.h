#pragma once

#include "image/image.h"

namespace embrun {

/// The feature-guided filter; the defaults serve 8 to 256 samples per pixel (found on renders of a dam break under sky
/// and sun, and on made-up pictures).
struct DenoiseSettings {
  int radius = 8;               ///< half the side of the window searched for similar pixels, pixels; 1 to 16
  int patch_radius = 1;         ///< half the side of the patches compared, pixels; 0 to 4
  float strength = 0.85f;       ///< tolerance of the colour distance, in standard deviations of the noise; > 0
  float feature_tolerance = 1;  ///< tolerance of the feature distance, > 0; at 1, a difference of 0.06 in albedo, of
                                ///< 0.24 in the unit normal, or in depth of 1.2 % and 1.2 times the local slope
                                ///< brings a weight down to exp(-1)
};

/// Returns the beauty layer with its noise reduced: non-local means whose weights come from the noisy colours,
/// scaled by the per-pixel variance [Rousselle2012], and from albedo, normal and depth [Rousselle2013]. Edges that
/// the features show stay sharp. A lone bright pixel that is mostly noise is cut down to its neighbours' brightness
/// and its light spread over some twenty pixels around; one that all its samples agree on stays. A missing feature
/// layer, an infinite depth or an unknown variance is worked round; `beauty` (1 or 3 channels) is needed (throws
/// Error otherwise). Deterministic at any number of threads. Values not finite in the input count as 0; the result is
/// never negative.
Image denoise(const ImageLayers& layers, const DenoiseSettings& settings = {});

}  // namespace embrun

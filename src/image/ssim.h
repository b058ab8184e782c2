#pragma once

#include <optional>

#include "image/image.h"

namespace embrun {

/// Structural similarity [Wang2004] of two pictures of display values in [0, 1], with its authors' settings: a Gaussian
/// window of 11 x 11 pixels and sigma 1.5, K1 = 0.01, K2 = 0.03, dynamic range 1, the mean over all windows that lie
/// wholly in the picture. Three channels are compared by their luma, 0.2126 R + 0.7152 G + 0.0722 B of the display
/// values. 1 for equal pictures, at least -1. Without a value where a side is below 11 pixels. The pictures must have
/// the same size and 1 or 3 channels (checked).
std::optional<double> structural_similarity(const Image& a, const Image& b);

}  // namespace embrun

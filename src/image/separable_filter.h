#pragma once

#include <vector>

#include "image/image.h"

namespace embrun {

/// Weights of a filter along one axis, for the offsets -radius to radius: an odd number of them.
using FilterTaps = std::vector<double>;

/// The filter along x, then along y, of a picture with one channel: at each pixel the sum of weight(offset) times the
/// pixel at that offset. Beyond the edges the edge's pixels go on. The same bits for any number of threads.
Image filter_separably(const Image& image, const FilterTaps& along_x, const FilterTaps& along_y);

}  // namespace embrun

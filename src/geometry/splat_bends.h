#pragma once

#include <vector>

#include "geometry/splat.h"

namespace embrun {

/// Linear fields of normals, one for each splat: the symmetric matrix that best turns its normal into those of the splats
/// that it overlaps, by least squares [Botsch2004]. 0 where too few do. The same bits for any number of threads.
std::vector<SplatBend> bend_normals(const std::vector<Splat>& splats);

}  // namespace embrun

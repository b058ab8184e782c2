#pragma once

#include <vector>

#include "geometry/splat.h"

namespace embrun {

/// The sphere of radius 1 that an icosahedron becomes whose triangles are divided into 256 each, with the thesis's radius for
/// 2,562 splats.
std::vector<Splat> sphere_splats();

}  // namespace embrun

#pragma once

#include <vector>

#include "math/vec.h"

namespace embrun::testing_support {

/// Particles on a cubic lattice of spacing s, x fastest, the first at the origin.
inline std::vector<Vec3> cubic_lattice(int nx, int ny, int nz, float s) {
  std::vector<Vec3> positions;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        positions.push_back(s * Vec3{static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)});
  return positions;
}

}  // namespace embrun::testing_support

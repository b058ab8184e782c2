#pragma once

#include <cstdint>

namespace embrun {

/// How particles make a medium.
enum class DensityModel : std::uint8_t {
  /// Each is a ball; where balls of one fluid overlap, scattering and absorption are averaged; none outside.
  balls,
  /// A smooth sum over the particles, weighted by the solvers' cubic spline.
  smooth,
};

/// What counts where particles of several fluids overlap. Fluids without extinction do not compete.
enum class MediaOverlap : std::uint8_t {
  min,  ///< the fluid of the lowest extinction there (mean of the channels)
  max,  ///< that of the highest
  sum,  ///< a mixture: extinctions add, and the colliding fluid is drawn in proportion
};

}  // namespace embrun

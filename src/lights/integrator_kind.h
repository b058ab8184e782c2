#pragma once

#include <cstdint>

namespace embrun {

/// Which integrator follows the light; its stages are listed in the file of src/integrators that is named here.
enum class IntegratorKind : std::uint8_t {
  path,               ///< path_stages.h: all of it
  whitted,            ///< whitted.h: direct light, mirror reflection and refraction
  ambient_occlusion,  ///< ambient_occlusion.h: how open the surroundings of surfaces are
  gauss,              ///< gauss.h: all of it, the first diffuse reflection by a quadrature rule
};
inline constexpr int integrator_kinds = 4;

}  // namespace embrun

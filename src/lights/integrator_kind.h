#pragma once

#include <cstdint>

namespace embrun {

/// Which integrator follows the light; its stages are listed in the file of src/integrators that is named here.
enum class IntegratorKind : std::uint8_t {
  path,               ///< path_stages.h: all of it
  whitted,            ///< whitted.h: direct light, mirror reflection and refraction
  ambient_occlusion,  ///< ambient_occlusion.h: how open the surroundings of surfaces are
};
inline constexpr int integrator_kinds = 3;

}  // namespace embrun

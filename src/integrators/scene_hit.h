#pragma once

#include <cstdint>

#include "geometry/surface_hit.h"

namespace embrun {

/// What an intersector reports: the nearest crossing, and what was crossed.
struct SceneHit {
  SurfaceHit surface;
  std::uint32_t material = 0;    ///< index into PathScene::materials
  std::int32_t light = -1;       ///< index of the area light that shines from here, or -1
  std::int16_t fluid = -1;       ///< index of the implicit surface, or -1
  std::int16_t splats = -1;      ///< index of the cloud of splats, or -1
  std::int8_t solid = -1;        ///< number of the solid for MediaState, or -1
  std::uint8_t media_class = 0;  ///< class of the medium inside; 0: it has no inside
  /// How far off the surface, along its geometric normal, a new ray has to start to be safely on its side, metres.
  float offset = 0;
  Vec2 uv;       ///< the geometry's coordinates; 0 unless the material needs them
  Vec3 tangent;  ///< where u grows, not normalised; 0 unless the material needs it
};

}  // namespace embrun

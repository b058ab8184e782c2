#pragma once

#include <cstdint>
#include <functional>

#include "scene/compile.h"

namespace embrun {

/// What the meshes of a scene's fluids took.
struct FluidMeshCounts {
  double seconds = 0;
  std::uint64_t vertices = 0, triangles = 0;
  // Of the first fluid's surface.
  float threshold = 0, influence_radius = 0;
  std::uint64_t recovered = 0;
};

/// Makes meshes of fluids for compile(). `counts` adds up what they took, if given; `progress` is told how much of one is
/// done, from any thread but by one at a time.
FluidMesher fluid_mesher(FluidMeshCounts* counts = nullptr, std::function<void(double fraction)> progress = {});

}  // namespace embrun

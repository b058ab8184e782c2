#pragma once

#include <cstdint>
#include <functional>

#include "scene/compile.h"

namespace embrun {

/// What the meshes of a scene's fluids, and the grids of what is in them, took.
struct FluidMeshCounts {
  double seconds = 0;
  std::uint64_t vertices = 0, triangles = 0;
  double grid_seconds = 0;
  std::uint64_t grid_cells = 0;
  // Of the first fluid's surface.
  float threshold = 0, influence_radius = 0;
  std::uint64_t recovered = 0;
};

/// Is told how much of a mesh or grid is done, from any thread but by one at a time.
using MeshProgress = std::function<void(double fraction)>;

/// Makes meshes of fluids for compile(). `counts` adds up what they took, if given.
FluidMesher fluid_mesher(FluidMeshCounts* counts = nullptr, MeshProgress progress = {});

/// The scene with what is in its fluids of SurfaceMethod::mesh on grids, as the pipeline has it that they stand for (method section 7). Particles that glow stay particles: grids do not glow.
SceneDescription with_grid_media(const SceneDescription& scene, FluidMeshCounts* counts = nullptr,
                                 const MeshProgress& progress = {});

/// compile() with both.
FlatScene compile_meshing(const SceneDescription& scene, FluidMeshCounts* counts = nullptr,
                          const MeshProgress& progress = {});

}  // namespace embrun

#pragma once

#include <functional>
#include <span>

#include "scene/flat_scene.h"
#include "scene/scene_description.h"

namespace embrun {

/// Makes the mesh of a fluid's surface for SurfaceMethod::mesh: closed, with normals, in the coordinates of `positions`,
/// which are those of the fluid and its images in the walls that it wets. `radii` is empty or one a position.
using FluidMesher = std::function<TriangleMesh(std::span<const Vec3> positions, std::span<const float> radii,
                                               const FluidDescription& fluid)>;

/// Validates a scene and makes the arrays that rays touch: coordinates recentred in double precision, media sorted into
/// priority classes, the fluids' surfaces built. Throws Error for a scene that validate() rejects, and for one with
/// more than 7 different media or 32 fluids. A scene with fluids that are to be meshed needs a mesher.
FlatScene compile(const SceneDescription& scene, const FluidMesher& mesher = {});

}  // namespace embrun

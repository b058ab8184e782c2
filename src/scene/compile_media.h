#pragma once

#include "media/particle_density_build.h"
#include "scene/scene_description.h"

namespace embrun {

/// The particles of all media as one density, in coordinates relative to `recentring`. Its fluids are those of the scene in
/// their order, then the volumes; what has no medium of particles takes a place and has none. Throws Error when there are
/// too many.
ParticleDensity compile_density(const SceneDescription& scene, Vec3d recentring);

}  // namespace embrun

#pragma once

#include <vector>

#include "geometry/box.h"
#include "media/grid_medium_build.h"
#include "media/particle_density_build.h"
#include "scene/scene_description.h"

namespace embrun {

/// The particles of a fluid's medium in coordinates relative to `recentring`. `particles` views the arrays.
struct PlacedParticles {
  std::vector<Vec3> positions;
  std::vector<float> radii;
  DensityParticles particles;

  PlacedParticles() = default;
  PlacedParticles(PlacedParticles&&) = default;
  PlacedParticles& operator=(PlacedParticles&&) = default;
  PlacedParticles(const PlacedParticles&) = delete;
  PlacedParticles& operator=(const PlacedParticles&) = delete;
};
/// `fluid.medium` must be given.
PlacedParticles place_particles(const FluidDescription& fluid, Vec3d recentring);

/// The particles of all media as one density, in coordinates relative to `recentring`. Its fluids are those of the scene in
/// their order, then the volumes; what has no medium of particles takes a place and has none. Throws Error when there are
/// too many.
ParticleDensity compile_density(const SceneDescription& scene, Vec3d recentring);

/// A medium on a grid in coordinates relative to `recentring`. `bounds`: a box of the scene that all bodies are in.
GridMediumData compile_grid_medium(const GridMediumDescription& medium, Vec3d recentring, const Box3& bounds);

}  // namespace embrun

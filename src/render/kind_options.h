#pragma once

#include <string>
#include <vector>

#include "embrun/embrun.h"
#include "render/default_scene.h"
#include "scene/scene_description.h"

// What RenderOptions say of the inside of the fluid, of other fluids, and of other kinds of particle.

namespace embrun {

/// Throws Error for what make_scene() would not find wrong without the files: unknown names, radii, a tank without a
/// container.
void check_kind_options(const RenderOptions& options);

/// The options with everything left out that is read from files.
RenderOptions without_files(const RenderOptions& options);

/// Density over that at rest, which is the median's, where the particles have one; else empty.
std::vector<float> relative_densities(const ParticleSet& particles, std::vector<std::string>& notes,
                                      const std::string& name);

/// What the first fluid's particles do to light, if the options say anything of it.
void add_inside(FluidDescription& fluid, const MeasuredParticles& measured, const RenderOptions& options,
                std::vector<std::string>& notes);

/// Adds the other fluids, the particles of other kinds and the tank to a scene that has its first fluid. `bounds` (those of
/// the first fluid) grows by the others'. Reads the files.
void add_other_particles(SceneDescription& scene, const MeasuredParticles& measured, const RenderOptions& options,
                         Box3d& bounds, std::vector<std::string>& notes);

}  // namespace embrun

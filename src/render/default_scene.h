#pragma once

#include <string>
#include <vector>

#include "embrun/embrun.h"
#include "particles/particle_set.h"
#include "particles/radius.h"
#include "particles/spacing.h"
#include "scene/scene_description.h"

namespace embrun {

/// The particles of a render, measured.
struct MeasuredParticles : SizedParticles {  ///< those of water
  std::string file;                          ///< where they are from, or empty
  /// Particles of other kinds that the same file held; by ParticleKind, or empty.
  std::vector<ParticleSet> others;
};

/// Tells the kinds apart and sizes the water (size_particles). `name` stands for the particles in messages. Throws Error
/// where no radius can be had, the particles lie too far apart, or none is water.
MeasuredParticles measure(ParticleSet particles, const RenderOptions& options, const std::string& name);

/// The water of the options, clear.
MaterialDescription water_material(const RenderOptions& options);
/// The surface that the options ask for.
SurfaceSettings surface_settings(const MeasuredParticles& particles, const RenderOptions& options);

/// Bounds of all but a few stray particles, one radius wider.
Box3d robust_bounds(const MeasuredParticles& particles);

/// Height along `up` of a floor that cuts through the lowest layer of particles, whose underside hangs above the floor
/// they lie on: the usual height of that layer's centres.
double lowest_layer(const MeasuredParticles& particles, const UpBasis& up);

/// Gives a scene that has its bodies and its `up` the environment, the floor, the meshes, the camera, the film and the integrator
/// of the options. The camera is framed on `bounds` and the floor; `floor_height` is for who does not say one.
void add_surroundings(SceneDescription& scene, const RenderOptions& options, Box3d bounds, double floor_height,
                      std::vector<std::string>& notes);

/// The scene that the options describe: the fluid, its surroundings, the camera. What they leave open is chosen from the
/// particles. `notes` receives what was put right. Reads the environment, the meshes, and the particles of other fluids
/// and kinds. Throws Error as check_options does.
SceneDescription make_scene(const MeasuredParticles& particles, const RenderOptions& options,
                            std::vector<std::string>& notes);

}  // namespace embrun

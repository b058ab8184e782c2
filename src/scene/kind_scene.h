#pragma once

#include <string>
#include <vector>

#include "particles/particle_kinds.h"
#include "scene/scene_description.h"

// The parts of a scene that particles of each kind are made into, as the thesis has them [Beddiaf2018]: foam is a volume
// that only scatters (here one that fades smoothly, where the thesis has balls), bubbles are balls of air, sand is opaque balls, spray is balls of the fluid. Fluids have priorities
// from 1 up; where bodies overlap, bubbles win over fluids and glass over bubbles.

namespace embrun {

inline constexpr int bubble_priority = 100;
inline constexpr int glass_priority = 200;

/// What is not in the files, as shares of the fluid's particle radius R0: solvers give the particles of foam none, but it is
/// smaller than the water's.
double default_kind_radius(ParticleKind kind, double fluid_radius);

/// How particles of one kind look; what is not given is the kind's own.
struct KindLook {
  double radius = 0;         ///< metres, > 0: of all, or of the median particle where `radii` differ
  std::vector<float> radii;  ///< one per particle, or empty
  Rgb color;                 ///< reflectance of sand, albedo of foam
  Rgb extinction;  ///< of foam, per metre, at a spacing of two radii; infinite: it is balls that reflect `color`
};

/// Defaults for balls of `radius` metres: foam as of foam_medium.
KindLook default_look(ParticleKind kind, double radius);

/// White foam of particles of `radius` metres. The density is the smooth one, which fades over two radii and adds up where
/// particles crowd: balls of one density have hard rims, and look like peas. A lone particle is 6/pi = 1.9 mean free paths
/// thick through its middle, and half of that 0.7 radii beside it.
ParticleMediumDescription foam_medium(double radius);

/// What balls of a kind (bubble, spray, sand) are made of in a scene whose water is `fluid`.
MaterialDescription default_material(ParticleKind kind, const MaterialDescription& fluid);

/// Of infinite extinction in all channels: what is so dense is no medium but an opaque surface.
bool is_opaque(Rgb extinction);
/// What an opaque body of a fluid is made of: its colour, under the reflecting surface of the fluid.
MaterialDescription opaque_fluid_material(const MaterialDescription& fluid, Rgb albedo);

/// Where particles are from: a file, and how they were told from its others. Empty: from nowhere.
struct ParticleSource {
  std::string file, kinds;
};

/// Adds particles to the scene. Spray takes the material of `fluid`; water is not for this function: it is a fluid.
/// No particle adds nothing.
void add_particles(SceneDescription& scene, ParticleKind kind, const std::vector<Vec3d>& positions,
                   const KindLook& look, const MaterialDescription& fluid, const ParticleSource& source = {});

/// Makes the fluids of a scene touch each other without air between: each, in the order of rising priority, takes the
/// particles of all after it into its own surface. Those do nothing to light there. Their radii and files stay behind.
void join_fluids(std::vector<FluidDescription>& fluids);

}  // namespace embrun

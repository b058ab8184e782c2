#pragma once

#include <optional>
#include <span>

#include "geometry/coarse_surface.h"
#include "geometry/implicit_surface.h"
#include "geometry/lattice_surface_build.h"
#include "geometry/surface_settings.h"

// Levels of detail of a fluid's surface. Level 0 is the particles' own; level k >= 1 is that of a lattice of cells of s 2^k,
// s the rest spacing: the number density, blurred by s 2^k/sqrt(2), where it is the same share of the one at rest as the
// particles' threshold is of their field inside. What is too thin for that stays particles.

namespace embrun {

struct CoarseSurface {
  LatticeSurface bulk;
  std::optional<ImplicitSurface> spray;
  float threshold = 0, influence_radius = 0;  ///< T and b (metres) of the particles' own surface
  std::size_t spray_particles = 0;

  CoarseSurfaceView view() const;
  std::size_t bytes() const;
};

/// Rest spacing s of the particles (2 R0 where the settings have none), metres.
float rest_spacing(const SurfaceSettings& settings);

/// The coarsest level of which the lattice's cells are no larger than `footprint` (metres); 0: the particles' own.
EMBRUN_FN int surface_level_for(float footprint, float spacing, int coarsest) {
  int level = 0;
  for (float cell = 2.0f * spacing; level < coarsest && cell <= footprint; cell *= 2.0f) ++level;
  return level;
}

/// Level `level` >= 1 of particles that all have the radius of the settings. Nothing where it is no use: the particles are
/// few in a wide domain, or no bulk is left. Runs on the threads of the enclosing TBB arena; the result does not depend on
/// their number. Throws Error for settings that make no surface.
std::optional<CoarseSurface> build_coarse_surface(std::span<const Vec3> positions, const SurfaceSettings& settings,
                                                  int level);

}  // namespace embrun

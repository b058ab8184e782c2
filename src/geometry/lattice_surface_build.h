#pragma once

#include <optional>
#include <span>
#include <vector>

#include "geometry/lattice_surface.h"

namespace embrun {

/// Owner of what a LatticeSurfaceView points to.
struct LatticeSurface {
  CellGrid bricks;
  std::vector<std::int32_t> states;
  std::vector<LatticeBrick> near;
  float cell = 0;

  LatticeSurfaceView view() const { return {bricks, states.data(), near.data(), cell}; }
  std::size_t bytes() const { return states.size() * sizeof(states[0]) + near.size() * sizeof(near[0]); }
};

/// The surface D = T of particles at rest spacing `spacing` (metres) on a lattice of cells of `cell` metres: D is the number
/// density, each particle spread over 3^3 of the lattice's values and those again by quadratic B-splines, so blurred by
/// cell/sqrt(2) (standard deviation along an axis), and T is `share` of the one at rest. `field` receives D/T at each
/// particle. Nothing where the lattice would have too many bricks: a few particles in a wide domain. Runs on the threads of
/// the enclosing TBB arena; the result does not depend on their number.
std::optional<LatticeSurface> build_lattice_surface(std::span<const Vec3> positions, double spacing, double cell,
                                                    double share, std::vector<float>& field);

}  // namespace embrun

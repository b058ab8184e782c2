#pragma once

#include <cstddef>

#include "particles/particle_set.h"

namespace embrun {

/// How densely a solver's particles fill the fluid.
struct SpacingEstimate {
  /// Whether there is a body of fluid to measure; spray, sheets one particle thick and lone particles have none.
  bool has_bulk = false;
  /// Rest spacing s = nu^(-1/3), metres, with nu the number density in the bulk (the method's section 1); 0: no bulk.
  double spacing = 0;
  /// Median distance to the nearest other particle, metres. Disorder makes it smaller than s. 0: there is one
  /// particle only, or most coincide with another.
  double nearest_neighbour = 0;
  /// The share of the places looked at, all well filled with particles, that was found to be bulk: 0 to 1.
  double bulk_share = 0;
};

/// Measures both, from a fixed random sample: the same particles give the same bits, whatever the machine and the
/// number of threads. Positions must be finite. Time and memory are linear in the particles.
///
/// The density is read at random places, not at particles (where it is always high), with a kernel about as wide as
/// five spacings. A place counts as bulk when the particles around it lie about it evenly: their weighted centre is
/// near it (not so by a free surface) and they spread alike along all axes (not so in a sheet). Of the bulk's densities
/// the mean of the shortest half is taken (Rousseeuw's shorth), which ignores a minority of compressed or torn fluid.
SpacingEstimate estimate_spacing(const ParticleSet& particles);

}  // namespace embrun

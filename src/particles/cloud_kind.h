#pragma once

#include <string>

#include "particles/cloud_normals.h"
#include "particles/particle_set.h"

namespace embrun {

/// Whether points are samples of surfaces (a scan) rather than particles that fill a fluid, and how that was told.
struct CloudVerdict {
  bool is_surface = false;
  std::string reason;  ///< "the file has normals"
  /// Measured only where the attributes do not decide.
  bool has_shape = false;
  CloudShape shape;

  /// Median surface variation (CloudShape::variation) from which points with normals or colours are yet taken to fill space: it
  /// is 0.27 in SPH fluids, 1/3 in a ball.
  static constexpr double of_volumes = 0.2;
};

/// In this order: what only solvers write (velocity, density, mass, pressure, id) makes particles; what only scanners write
/// (intensity, confidence, returns) makes a surface; normals or colours do unless neighbourhoods fill space;
/// else neighbourhoods must be flat (CloudShape::is_surface).
CloudVerdict tell_surface(const ParticleSet& particles);

}  // namespace embrun

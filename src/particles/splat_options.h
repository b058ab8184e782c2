#pragma once

#include <cstddef>
#include <optional>

#include "math/vec.h"

namespace embrun {

/// Whose normals a cloud takes.
enum class NormalChoice {
  automatic,  ///< the file's where it has them, else estimated
  file,       ///< the file's; an error where there are none
  estimate,   ///< by principal components, whatever the file has
};

/// How a cloud becomes splats. The defaults are for a scan of which nothing is known.
struct SplatOptions {
  NormalChoice normals = NormalChoice::automatic;
  /// Neighbours that a normal is taken from, 3 to 256; absent: from the cloud's noise and curvature.
  std::optional<std::size_t> neighbours;
  /// Where the scanner stood, metres, in the frame of the positions: all normals are turned to it, the file's too.
  /// Absent: the place that the file tells (ParticleSet::sensor) turns estimated ones; else they look outwards.
  std::optional<Vec3d> sensor;
  /// One radius for all splats, metres, > 0; absent: the file's attribute "radius", else from the spacing.
  std::optional<double> radius;
  /// Radii of the file or from the spacing are multiplied by this, > 0.
  double radius_scale = 1;
  bool ellipses = false;       ///< elliptical splats, where radii come from the spacing
  std::optional<bool> closed;  ///< whether the cloud bounds a body; absent: told from the splats
  bool keep_duplicates = false;
  /// How many times a point's mean distance to its neighbours may be that of theirs; 0 keeps outliers.
  double outlier_ratio = 3;
  double thin = 0;  ///< metres: one point stays in each cube of this edge; 0: all

  bool operator==(const SplatOptions&) const = default;
};

}  // namespace embrun

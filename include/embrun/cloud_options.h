#pragma once

#include <array>
#include <optional>
#include <string>

namespace embrun {

/// How far the surface mls feels a point where nothing is said, in splat radii.
inline constexpr double default_mls_support = 3;

/// How the points of a scan become splats. Names are those of the command line; a wrong one throws and lists the right ones.
struct CloudOptions {
  std::string points = "auto";   ///< auto, surface (samples of surfaces), fluid (particles of one)
  std::string normals = "auto";  ///< auto (the file's, else estimated), file, estimate
  /// How many nearest points a normal is estimated from, 3 to 256; default: from the noise.
  std::optional<int> neighbours;
  std::optional<std::array<double, 3>> sensor;  ///< where the scanner stood: normals are turned to it
  std::optional<double> splat_radius;           ///< metres, of all; default: the file's, else from the spacing
  double splat_scale = 1;                       ///< other radii are multiplied by it
  std::string splat_shape = "disc";             ///< disc, ellipse
  std::string closed = "auto";                  ///< whether the cloud bounds a body: auto, yes, no
  double outlier_ratio = 3;  ///< points so many times as far from their neighbours as those are go; 0: none
  bool keep_duplicates = false;
  double thin = 0;  ///< metres: one point stays in each cube of this edge; 0: all
};

}  // namespace embrun

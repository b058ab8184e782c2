#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "math/rgb.h"
#include "math/vec.h"
#include "particles/cloud_normals.h"
#include "particles/cloud_splats.h"
#include "particles/particle_set.h"
#include "particles/splat_options.h"

namespace embrun {

/// Which way estimated normals look.
enum class NormalSource { file, estimated_outwards, estimated_to_sensor };

/// Where the splats' radii come from.
enum class SplatRadiusSource { given, file, spacing };

/// "given", "file" or "spacing".
const char* to_string(SplatRadiusSource source);

/// What make_splats() found and did, for people.
struct SplatReport {
  std::size_t points_in = 0;
  std::size_t duplicates = 0, outliers = 0, thinned = 0;  ///< points left out, in this order
  CloudShape shape;                                       ///< of the points that stayed
  NormalSource normals = NormalSource::file;
  std::size_t neighbours = 0;        ///< that normals were estimated from; 0 where none were
  std::size_t pieces = 0;            ///< that were oriented by themselves; 0 where nothing was
  std::size_t replaced_normals = 0;  ///< of the file, that were zero and were estimated
  std::size_t turned_normals = 0;    ///< of the file, that were turned to the sensor of the options
  double normal_difference = 0;      ///< degrees, mean angle between normals of the file and estimated ones, a sample's
  SplatRadiusSource radius = SplatRadiusSource::spacing;
  double least_radius = 0, median_radius = 0, greatest_radius = 0;  ///< metres
  std::size_t replaced_radii = 0;  ///< that were no positive number: of the file, or of points in one place
  std::size_t at_border = 0;       ///< splats by a border of the surface, where radii come from the spacing
  bool closed_given = false;       ///< by the options
  double open_share = 0;           ///< see CloudClosedness::open_share; 0 where closed_given
};

/// Oriented discs (or ellipses) that cover a sampled surface: what the renderer takes. All arrays have one entry a
/// splat, or none at all where it says "or empty".
struct SplatCloud {
  /// Centres (`particles.positions`, metres, double precision, in the file's frame) with all attributes of the file, splat by
  /// splat; not in the file's order, but along a space-filling curve.
  ParticleSet particles;
  std::vector<Vec3> normals;  ///< unit length
  std::vector<float> radii;   ///< metres, > 0 and finite; of an ellipse the greater half axis
  /// Half axes of elliptical splats, metres, at right angles to each other and to the normal (to single precision);
  /// `major` is the longer. Or empty: all are discs.
  std::vector<SplatAxes> axes;
  std::vector<Rgb> colours;  ///< linear, each channel in [0, 1], from the attribute "color" (sRGB); or empty
  /// The splats bound a body and normals look out of it: a ray that goes in comes out through a back face.
  bool closed = false;
  SplatReport report;

  std::size_t size() const { return radii.size(); }
};

/// Makes splats of points: leaves out duplicates and outliers and thins as asked; estimates normals and radii where there are
/// none; tells open clouds from closed ones. The same bits for any number of threads. `file` stands for the cloud in
/// messages. Throws Error where an option is out of range, where normals are asked of a file without, and where there
/// is nothing to estimate from (fewer than 3 different points).
SplatCloud make_splats(ParticleSet particles, const SplatOptions& options, std::string_view file);

}  // namespace embrun

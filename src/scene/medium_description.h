#pragma once

#include <optional>
#include <string>
#include <vector>

#include "math/rgb.h"
#include "math/vec.h"
#include "media/particle_medium.h"
#include "media/phase_function.h"
#include "scene/placement.h"

// Media as plain data, part of scene_description.h.

namespace embrun {

/// The names of the particles' attributes that values per particle are from, or empty.
struct ParticleMediumSources {
  std::string density, extinction, albedo, emission, temperature;

  bool operator==(const ParticleMediumSources&) const = default;
};

/// What the particles of a fluid or a volume do to light: each is a ball that scatters and absorbs. Where balls of one
/// fluid overlap, scattering and absorption are each averaged; outside every ball there is none.
///
/// Per-particle values are empty, or one for each particle of the owner.
struct ParticleMediumDescription {
  Rgb extinction{1, 1, 1};      ///< per metre at rest density, each channel 0 or more and finite
  double extinction_scale = 1;  ///< factor on all extinctions, 0 or more
  Rgb albedo{1, 1, 1};          ///< scattering / extinction, each channel in [0, 1]
  PhaseFunction phase;
  double density_radius = 0;  ///< of the balls, metres; 0: the particles' own. With radii per particle they are scaled
                              ///< so that a particle of the owner's radius gets this one
  DensityModel model = DensityModel::balls;

  std::vector<float> densities;  ///< relative to rest density; factors on `extinction`
  std::vector<Rgb> extinctions;  ///< per metre, instead of `extinction` and `densities`
  std::vector<Rgb> albedos;      ///< instead of `albedo`
  /// Glow: radiance of a particle's matter if it were opaque (emission per metre is absorption times this), or the
  /// temperature in kelvin of a black body that gives it. At most one of the two.
  std::vector<Rgb> emission;
  std::vector<float> temperatures;
  double emission_scale = 1;  ///< factor on the glow; with temperatures, the luminance of a black body of 1500 K
  ParticleMediumSources sources;

  bool operator==(const ParticleMediumDescription&) const = default;
};

/// Numbers on a box of cells, which are those of the cells' centres.
struct ValueGridDescription {
  int nx = 0, ny = 0, nz = 0;
  int channels = 1;           ///< 1 or 3
  std::vector<float> values;  ///< [((z ny + y) nx + x) channels + channel]
  bool nearest = false;       ///< the number of the cell a point is in; else trilinear between the centres
  Placement placement;        ///< of [0,1]^3, which the cells divide, in the world
  std::string file;           ///< where the numbers are from, or empty

  bool operator==(const ValueGridDescription&) const = default;
};

/// A medium that differs from place to place, given by numbers on grids. It fills the bodies whose material names it, as
/// far as the box of `extinction_grid` reaches.
struct GridMediumDescription {
  Rgb extinction{1, 1, 1};  ///< per metre, where there is no grid of it
  std::optional<ValueGridDescription> extinction_grid;
  double scale = 1;                 ///< factor on the extinction
  Rgb albedo{0.75f, 0.75f, 0.75f};  ///< scattering / extinction, in [0, 1], where there is no grid of it
  std::optional<ValueGridDescription> albedo_grid;
  PhaseFunction phase;

  bool operator==(const GridMediumDescription&) const = default;
};

/// Particles that fill space with a medium and have no surface: foam, fog, fire. They count wherever they are, in air
/// and inside other bodies.
struct VolumeDescription {
  std::vector<Vec3d> positions;
  std::vector<float> radii;  ///< one per particle, or empty: `radius` for all. A particle of radius 0 is not there
  double radius = 0.025;     ///< metres, > 0
  ParticleMediumDescription medium;
  std::string file;                     ///< where the particles are from, or empty
  std::vector<std::string> more_files;  ///< whose particles follow those of `file`
  std::string kinds;  ///< how they were told from the file's others (see kind_mapping_from_text), or empty

  bool operator==(const VolumeDescription&) const = default;
};

}  // namespace embrun

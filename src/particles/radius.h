#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "particles/particle_set.h"
#include "particles/spacing.h"

namespace embrun {

/// Where the particles' radius comes from, the first that there is.
enum class RadiusSource {
  given,              ///< by the user
  file,               ///< the attribute "radius" ("pscale" in the file)
  spacing,            ///< s/2
  nearest_neighbour,  ///< no bulk to measure s in: half the median distance to the nearest neighbour
};

struct RadiusChoice {
  RadiusSource source = RadiusSource::given;
  /// Particle radius R0, metres; the median where particles have different ones.
  double radius = 0;
  /// One per particle where they differ, else empty. 0 marks a particle whose radius the file gives as 0 or less, or as
  /// no number: it cannot be rendered.
  std::vector<float> radii;
  std::size_t without_radius = 0;  ///< how many are marked
};

/// Decides the radius. Throws Error naming `file` when `given` is not positive and finite, when no particle of a file
/// with radii has a usable one, and when there is nothing to derive a radius from (a single particle, all in one place).
RadiusChoice choose_radius(const ParticleSet& particles, const SpacingEstimate& spacing, std::optional<double> given,
                           std::string_view file);

/// Removes the particles that are marked in choice.radii from both and adds a note to the set.
void drop_particles_without_radius(ParticleSet& particles, RadiusChoice& choice);

/// Throws Error naming `file` when the particles are so far from each other that single precision, relative to the
/// middle of their bounds, cannot place them to 1/50 of `radius`: one runaway particle is enough.
void check_extent(const ParticleSet& particles, double radius, std::string_view file);

/// Particles with what their surface takes.
struct SizedParticles {
  ParticleSet particles;
  SpacingEstimate spacing;
  RadiusChoice radius;
};

/// Estimates the rest spacing, decides the radius, removes the particles without one, and checks the extent.
SizedParticles size_particles(ParticleSet particles, std::optional<double> given, std::string_view file);

/// "given", "file", "spacing" or "nearest-neighbour".
const char* to_string(RadiusSource source);

}  // namespace embrun

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "media/particle_density.h"

namespace embrun {

/// The particles of one fluid or volume, in scene coordinates. Per-particle arrays are empty or as long as `positions`.
struct DensityParticles {
  std::span<const Vec3> positions;
  std::span<const float> radii;  ///< of the balls, metres; or empty: `radius` for all. 0: the particle is not there
  float radius = 0;
  DensityModel model = DensityModel::balls;
  /// Smooth: the volume that a particle of radius `radius` stands for, m^3; others in proportion to their balls. The kernel
  /// reaches four radii, as the solvers' does.
  float volume = 0;

  Rgb extinction;  ///< per metre
  Rgb albedo;
  PhaseFunction phase;
  std::vector<float> factors;    ///< on `extinction`
  std::vector<Rgb> extinctions;  ///< per metre, instead of `extinction` times a factor
  std::vector<Rgb> albedos;      ///< instead of `albedo`
  std::vector<Rgb> emission;     ///< radiance of a particle's matter if it were opaque
};

/// Sizes of a built density, for reports.
struct ParticleDensityStats {
  std::size_t balls = 0, bricks = 0, cells = 0, blocks = 0, bytes = 0;
  float brick = 0;  ///< side, metres
};

struct DensitySource;

/// The particles of all fluids as one medium, ready for rays; immutable once built.
class ParticleDensity {
 public:
  ParticleDensity() = default;
  /// At most max_density_fluids; a fluid's place is its bit in masks. The result does not depend on the number of threads.
  /// `brick` is the side of the bricks in metres, or 0: chosen.
  ParticleDensity(std::span<const DensityParticles> fluids, MediaOverlap overlap, float brick = 0);

  /// Valid while this object lives (moving it keeps views valid).
  const ParticleDensityView& view() const { return view_; }
  ParticleDensityStats stats() const;

 private:
  std::vector<float> majorants_;  ///< one channel after the other; of grey media one
  std::vector<std::uint32_t> brick_index_;
  std::vector<DensityBrick> bricks_;
  std::vector<DensityCell> cells_;
  std::vector<DensityBlock> blocks_;
  std::vector<std::uint8_t> block_fluid_;
  std::vector<float> block_reach_;
  std::vector<std::uint32_t> block_colours_;
  std::vector<BallColours> colours_;
  std::vector<DensityFluid> fluids_;
  ParticleDensityView view_;
  std::size_t balls_ = 0;

  void fill(DensitySource& source, float brick);
};

}  // namespace embrun

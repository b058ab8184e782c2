#pragma once

#include <array>
#include <functional>
#include <vector>

#include "math/rgb.h"
#include "math/vec.h"
#include "media/particle_density_build.h"

namespace embrun {

/// The extinction of particles on a sparse grid: tiles of 8 x 8 x 8 cells. A cell's number is the mean over the points of
/// a finer grid in it, so it is that of the cell, not of its centre.
struct DensityGrid {
  static constexpr int tile_side = 8;
  static constexpr std::size_t tile_cells = 512;

  float cell = 0;  ///< metres
  Vec3 origin;     ///< the low corner of tile (0, 0, 0)
  std::vector<std::array<int, 3>> tiles;
  int channels = 1;               ///< of the extinction: 1, the same for all three, or 3
  std::vector<float> extinction;  ///< per metre; [(tile 512 + cell) channels + channel], cells x fastest
  std::vector<Rgb> albedo;  ///< [tile 512 + cell], scattering / extinction; empty where all particles have the same
};

/// Samples the extinction of one fluid's particles (method section 3, as rays meet it): where balls overlap it is their
/// mean, outside every ball 0. The low corner of the cells is a multiple of their side from that of the scene's
/// coordinates, so that grids of the same cells are aligned. Glow is left out. Runs on the threads of the enclosing TBB
/// arena; the grid does not depend on their number. `progress` is told how much is done.
/// Throws Error when the cells are too fine or too many.
DensityGrid sample_density(const DensityParticles& particles, float cell,
                           const std::function<void(double fraction)>& progress = {});

}  // namespace embrun

#pragma once

#include <cstdint>

#include "base/prefetch.h"
#include "geometry/grid_walk.h"
#include "math/lanes.h"
#include "math/rgb.h"
#include "media/particle_medium.h"
#include "media/phase_function.h"

// The particles of all fluids and volumes of a scene as one medium: what per-ray code reads. Bricks (large cells) bound the
// extinction from above; cells within them list the balls that reach into them. Coordinates are the scene's.

namespace embrun {

/// Fluids and volumes that can be told apart: bits of a mask.
inline constexpr int max_density_fluids = 32;

/// What all particles of a fluid share.
struct DensityFluid {
  Rgb extinction;  ///< per metre, of a particle of factor 1
  Rgb albedo;
  PhaseFunction phase;
  bool smooth = false;       ///< DensityModel::smooth
  bool own_colours = false;  ///< its particles have BallColours
  float reach_squared = 0;   ///< of all its balls (see block_reach), or 0: they differ
};

/// Sixteen balls of one fluid. Places that are not used are far off and have factor 0.
struct alignas(64) DensityBlock {
  float x[16], y[16], z[16];
  float factor[16];  ///< on DensityFluid::extinction; smooth: times the kernel's norm and the particle's volume
};

/// What a particle of its own colour is, besides its factor.
struct BallColours {
  Rgb tint;  ///< on the extinction, each channel in [0, 1]
  Rgb albedo;
  Rgb emission;  ///< radiance of its matter if it were opaque
};

/// Value of DensityCell::fluid where there are several.
inline constexpr std::uint32_t mixed_fluids = 255;

struct DensityCell {
  std::uint32_t first_block = 0;
  std::uint32_t block_count : 24 = 0;  ///< ordered by fluid
  std::uint32_t fluid : 8 = 0;         ///< of all its blocks, or mixed_fluids
};

struct alignas(64) DensityBrick {
  CellGrid grid;  ///< the box of its balls
  std::uint32_t first_cell = 0;
};

inline constexpr std::uint32_t no_brick = 0xffffffffu;

/// A view of arrays that a ParticleDensity owns.
struct ParticleDensityView {
  CellGrid grid;  ///< of bricks
  /// Per channel, by cell of `grid`: no point of the brick has a larger extinction, per metre. Proven; 0 where there is none.
  const float* majorants[3] = {nullptr, nullptr, nullptr};
  const std::uint32_t* brick_index = nullptr;  ///< by cell of `grid`, or no_brick
  const DensityBrick* bricks = nullptr;
  const DensityCell* cells = nullptr;
  const DensityBlock* blocks = nullptr;
  const std::uint8_t* block_fluid = nullptr;
  const float* block_reach =
      nullptr;  ///< 16 for each block: squared radii, or supports of a smooth fluid; null: all the same
  const std::uint32_t* block_colours = nullptr;  ///< 16 for each block: indices into `colours`; null: no own colours
  const BallColours* colours = nullptr;
  const DensityFluid* fluids = nullptr;
  int fluid_count = 0;
  MediaOverlap overlap = MediaOverlap::sum;
  std::uint32_t present = 0;  ///< mask of the fluids that have any extinction
  bool grey = true;           ///< all extinctions are the same in the three channels
  float mean_extinction = 0;  ///< roughly, over the space that the balls fill and the gaps between them; per metre
  bool piecewise = true;      ///< no fluid is smooth: extinction is constant between the balls' surfaces

  EMBRUN_FN Rgb majorant(int brick_cell) const {
    return {majorants[0][brick_cell], majorants[1][brick_cell], majorants[2][brick_cell]};
  }
};

/// Extinctions of several fluids at one point, made one.
struct OverlapSum {
  Rgb extinction;
  float rank = -1.0f;

  /// True when `k` now is what counts (or, in a sum, what was added).
  EMBRUN_FN bool add(MediaOverlap overlap, Rgb k) {
    const float rank_of_k = mean(k);
    if (!(rank_of_k > 0.0f)) return false;
    if (overlap == MediaOverlap::sum) {
      extinction += k;
      return true;
    }
    if (rank >= 0.0f && !(overlap == MediaOverlap::min ? rank_of_k < rank : rank_of_k > rank)) return false;
    rank = rank_of_k;
    extinction = k;
    return true;
  }
};

/// Shape of the solvers' cubic spline [Monaghan1992] over its support, at u^2 = (r/h)^2; 1 at the centre, 0 from u = 1 on.
EMBRUN_FN F16 cubic_spline(F16 u_squared) {
  const F16 safe = max_of(u_squared, splat(1e-12f));
  const F16 u = safe * rsqrt_of(safe);
  const F16 outer = max_of(1.0f - u, splat(0.0f)), inner = max_of(0.5f - u, splat(0.0f));
  // 2 (1 - u)^3 everywhere, less 8 (1/2 - u)^3 within half the support: 1 - 6 u^2 + 6 u^3 there.
  return 2.0f * (outer * outer * outer) - 8.0f * (inner * inner * inner);
}

/// A block's factors at a point, with the weights that its particles have there, and their number.
struct BlockFactors {
  F16 factor;
  int count = 0;  ///< of the balls that hold the point
};

/// The squared radii of a block's balls.
EMBRUN_FN F16 reach_squared(const ParticleDensityView& view, const DensityFluid& fluid, std::uint32_t block) {
  return fluid.reach_squared > 0.0f ? splat(fluid.reach_squared)
                                    : load16(view.block_reach + 16 * static_cast<std::size_t>(block));
}

EMBRUN_FN BlockFactors factors_at(const ParticleDensityView& view, const DensityFluid& fluid, std::uint32_t number,
                                  Vec3 p) {
  const DensityBlock& block = view.blocks[number];
  const F16 dx = load16(block.x) - p.x, dy = load16(block.y) - p.y, dz = load16(block.z) - p.z;
  const F16 distance_squared = dx * dx + dy * dy + dz * dz;
  const F16 radius_squared = reach_squared(view, fluid, number), factor = load16(block.factor);
  if (fluid.smooth) return {cubic_spline(distance_squared / radius_squared) * factor, 0};
  return {select_less(distance_squared, radius_squared, factor, splat(0.0f)),
          count_less(distance_squared, radius_squared)};
}

/// What one fluid's particles are together at a point.
struct FluidSums {
  F16 factor;
  Rgb tinted;  ///< of own colours: factor x tint
  int count = 0;

  EMBRUN_FN FluidSums() : factor(splat(0.0f)) {}

  EMBRUN_FN void add(const ParticleDensityView& view, const DensityFluid& fluid, std::uint32_t block,
                     const BlockFactors& own) {
    count += own.count;
    factor += own.factor;
    if (!fluid.own_colours) return;
    float lanes[16];
    store16(lanes, own.factor);
    for (std::uint32_t i = 0; i < 16; ++i)
      if (lanes[i] > 0.0f) tinted += view.colours[view.block_colours[16 * block + i]].tint * lanes[i];
  }
  /// The fluid's extinction: the mean over its balls, or the smooth sum.
  EMBRUN_FN Rgb extinction(const DensityFluid& fluid) const {
    if (count == 0 && !fluid.smooth) return {};
    const float norm = fluid.smooth ? 1.0f : 1.0f / static_cast<float>(count);
    return fluid.extinction * (fluid.own_colours ? tinted * norm : grey(sum_lanes(factor) * norm));
  }
};

/// The blocks of one fluid in a cell, one fluid after the other.
struct FluidRun {
  std::uint32_t begin, end;
  int fluid;

  EMBRUN_FN FluidRun(const ParticleDensityView& view, const DensityCell& cell) : begin(cell.first_block) {
    fluid = static_cast<int>(cell.fluid);
    end = begin + cell.block_count;
    if (cell.fluid == mixed_fluids) shorten(view);
  }
  EMBRUN_FN bool next(const ParticleDensityView& view, const DensityCell& cell) {
    begin = end;
    end = cell.first_block + cell.block_count;
    if (begin == end) return false;
    shorten(view);
    return true;
  }

 private:
  EMBRUN_FN void shorten(const ParticleDensityView& view) {
    const std::uint32_t last = end;
    fluid = view.block_fluid[begin];
    for (end = begin + 1; end < last && view.block_fluid[end] == fluid;) ++end;
  }
};

/// Extinction of the fluid of a run at a point.
EMBRUN_FN Rgb extinction_of(const ParticleDensityView& view, const FluidRun& run, Vec3 p) {
  const DensityFluid& fluid = view.fluids[run.fluid];
  FluidSums sums;
  for (std::uint32_t block = run.begin; block < run.end; ++block)
    sums.add(view, fluid, block, factors_at(view, fluid, block, p));
  return sums.extinction(fluid);
}

/// The cell of a brick that holds a point; null beside the box of its balls.
EMBRUN_FN const DensityCell* cell_of(const ParticleDensityView& view, const DensityBrick& brick, Vec3 p) {
  const Vec3 at = (p - brick.grid.low) * brick.grid.cells_per_metre;
  // Written so that what lies below 0, which truncation would take for cell 0, is out.
  if (!(at.x >= 0.0f && at.y >= 0.0f && at.z >= 0.0f)) return nullptr;
  const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
  if (x >= brick.grid.nx || y >= brick.grid.ny || z >= brick.grid.nz) return nullptr;
  return &view.cells[brick.first_cell + static_cast<std::uint32_t>(brick.grid.index(x, y, z))];
}
/// The same; null where no ball reaches.
EMBRUN_FN const DensityCell* cell_at(const ParticleDensityView& view, const DensityBrick& brick, Vec3 p) {
  const DensityCell* cell = cell_of(view, brick, p);
  return cell != nullptr && cell->block_count != 0 ? cell : nullptr;
}

/// The cell that holds a point of the scene; null where no ball reaches.
EMBRUN_FN const DensityCell* cell_holding(const ParticleDensityView& view, Vec3 p) {
  const Vec3 at = (p - view.grid.low) * view.grid.cells_per_metre;
  if (!(at.x >= 0.0f && at.y >= 0.0f && at.z >= 0.0f)) return nullptr;
  const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
  if (x >= view.grid.nx || y >= view.grid.ny || z >= view.grid.nz) return nullptr;
  const std::uint32_t brick = view.brick_index[view.grid.index(x, y, z)];
  return brick == no_brick ? nullptr : cell_at(view, view.bricks[brick], p);
}

/// Extinction at a point of a cell of several fluids.
EMBRUN_LOCAL_FN Rgb mixed_extinction(const ParticleDensityView& view, const DensityCell& cell, Vec3 p,
                                     std::uint32_t mask) {
  FluidRun run(view, cell);
  OverlapSum total;
  do {
    if ((mask >> run.fluid & 1u) != 0) total.add(view.overlap, extinction_of(view, run, p));
  } while (run.next(view, cell));
  return total.extinction;
}

/// Extinction at a point of a cell that has any balls, per metre, of the fluids in `mask`.
EMBRUN_FN Rgb extinction_in_cell(const ParticleDensityView& view, const DensityCell& cell, Vec3 p, std::uint32_t mask) {
  if (cell.fluid == mixed_fluids) return mixed_extinction(view, cell, p, mask);
  return (mask >> cell.fluid & 1u) != 0 ? extinction_of(view, FluidRun(view, cell), p) : Rgb{};
}

/// What a path meets where it collides: one fluid, as it is there.
struct LocalMedium {
  int fluid = -1;  ///< -1: nothing is there
  Rgb extinction;  ///< of that fluid alone, per metre
  Rgb albedo;      ///< scattering / extinction
  Rgb emission;    ///< emission / extinction: radiance that the collision brings
};

/// Albedo and glow of one fluid's own colours at a point: scattering, absorption and emission are averaged each.
EMBRUN_LOCAL_FN void mix_own_colours(const ParticleDensityView& view, const DensityCell& cell, Vec3 p,
                                     LocalMedium& local) {
  Rgb scattering, extinction, emission;
  const DensityFluid& fluid = view.fluids[local.fluid];
  for (std::uint32_t block = cell.first_block; block < cell.first_block + cell.block_count; ++block) {
    if (view.block_fluid[block] != local.fluid) continue;
    float lanes[16];
    store16(lanes, factors_at(view, fluid, block, p).factor);
    for (int i = 0; i < 16; ++i) {
      if (!(lanes[i] > 0.0f)) continue;
      const BallColours& own = view.colours[view.block_colours[16 * block + static_cast<std::uint32_t>(i)]];
      const Rgb k = own.tint * lanes[i];
      extinction += k;
      scattering += k * own.albedo;
      emission += k * (grey(1.0f) - own.albedo) * own.emission;
    }
  }
  for (int c = 0; c < 3; ++c) {
    const float norm = extinction[c] > 0.0f ? 1.0f / extinction[c] : 0.0f;
    local.albedo[c] = min_of(scattering[c] * norm, 1.0f);
    local.emission[c] = emission[c] * norm;
  }
}

/// Which fluid of several a path collides with at a point of a cell, and its extinction. Of a mixture it is drawn by `u` in
/// [0, 1), in proportion to the extinctions in `channel`.
EMBRUN_LOCAL_FN void choose_fluid(const ParticleDensityView& view, const DensityCell& cell, Vec3 p, std::uint32_t mask,
                                  int channel, float u, LocalMedium& local) {
  OverlapSum total;
  FluidRun run(view, cell);
  do {
    if ((mask >> run.fluid & 1u) == 0) continue;
    const Rgb k = extinction_of(view, run, p);
    if (!total.add(view.overlap, k)) continue;
    if (view.overlap == MediaOverlap::sum) {
      // One number draws among any count: what it leaves undecided is spread over [0, 1) again.
      const float share = k[channel] > 0.0f ? k[channel] / total.extinction[channel] : 0.0f;
      if (!(u < share)) {
        u = (u - share) / (1.0f - share);
        continue;
      }
      u = u / share;
    }
    local.fluid = run.fluid;
    local.extinction = k;
  } while (run.next(view, cell));
}

/// One of several things that scatter at a point, drawn in proportion to how much they do.
struct ScatterChoice {
  float u = 0;                  ///< draws, in [0, 1)
  float total = 0, chosen = 0;  ///< scattering, mean of the channels, per metre: of all, of the one

  /// True when what is offered is chosen, for now.
  EMBRUN_FN bool offer(float scattering) {
    if (!(scattering > 0.0f)) return false;
    total += scattering;
    // One number draws among any count: what it leaves undecided is spread over [0, 1) again.
    const float share = scattering / total;
    const bool taken = u < share;
    u = taken ? u / share : (u - share) / (1.0f - share);
    if (taken) chosen = scattering;
    return taken;
  }
};

/// Offers the fluids at a point of a cell to the choice. True when one of them is chosen: `local`.
EMBRUN_LOCAL_FN bool offer_fluids(const ParticleDensityView& view, const DensityCell& cell, Vec3 p, std::uint32_t mask,
                                  ScatterChoice& choice, LocalMedium& local) {
  OverlapSum total;
  LocalMedium counts;
  bool taken = false;
  FluidRun run(view, cell);
  do {
    if ((mask >> run.fluid & 1u) == 0) continue;
    const Rgb k = extinction_of(view, run, p);
    if (!total.add(view.overlap, k)) continue;
    counts.fluid = run.fluid;
    counts.extinction = k;
    counts.albedo = view.fluids[run.fluid].albedo;
    if (view.fluids[run.fluid].own_colours) mix_own_colours(view, cell, p, counts);
    if (view.overlap == MediaOverlap::sum && choice.offer(mean(k * counts.albedo))) {
      local = counts;
      taken = true;
    }
  } while (run.next(view, cell));
  if (view.overlap == MediaOverlap::sum || counts.fluid < 0 || !choice.offer(mean(counts.extinction * counts.albedo)))
    return taken;
  local = counts;
  return true;
}

/// What a path collides with at a point of a cell, where the extinction is `k`. `u`: as in choose_fluid.
EMBRUN_FN LocalMedium collide_in_cell(const ParticleDensityView& view, const DensityCell& cell, Vec3 p,
                                      std::uint32_t mask, Rgb k, int channel, float u) {
  LocalMedium local;
  if (cell.fluid == mixed_fluids) {
    choose_fluid(view, cell, p, mask, channel, u, local);
    if (local.fluid < 0) return local;
  } else {
    local.fluid = static_cast<int>(cell.fluid);
    local.extinction = k;
  }
  local.albedo = view.fluids[local.fluid].albedo;
  if (view.fluids[local.fluid].own_colours) mix_own_colours(view, cell, p, local);
  return local;
}

}  // namespace embrun

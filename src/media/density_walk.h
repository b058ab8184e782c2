#pragma once

#include "media/particle_density.h"

// The exact walk (method section 3): along a line the extinction is constant between the points where it enters and leaves
// balls, so optical depth needs no step size. Only for densities that are piecewise constant.

namespace embrun {

/// The parts of a line in the balls of a block: [enter, exit), empty where a ball is missed.
struct DensityChords {
  F16 enter, exit;
};

/// Chords along the line through `from`, as distances from it.
EMBRUN_FN DensityChords chords_of(const ParticleDensityView& view, std::uint32_t number, Vec3 from, Vec3 direction) {
  const DensityBlock& block = view.blocks[number];
  const F16 dx = load16(block.x) - from.x, dy = load16(block.y) - from.y, dz = load16(block.z) - from.z;
  const F16 middle = dx * direction.x + dy * direction.y + dz * direction.z;
  // The offset from the line as a vector: no difference of large squares.
  const F16 ox = dx - middle * direction.x, oy = dy - middle * direction.y, oz = dz - middle * direction.z;
  const F16 half_squared =
      reach_squared(view, view.fluids[view.block_fluid[number]], number) - (ox * ox + oy * oy + oz * oz);
  const F16 half = sqrt_of(max_of(half_squared, splat(0.0f)));
  return {middle - half, middle + half};
}

/// Blocks of a cell whose chords are kept; those beyond are computed again for every event.
inline constexpr std::uint32_t kept_chords = 8;

/// The extinction along a line within one cell, from event to event.
struct CellEvents {
  EMBRUN_FN CellEvents(const ParticleDensityView& density, const DensityCell& list, Vec3 at, Vec3 along)
      : view(density), cell(list), from(at), direction(along) {
    const std::uint32_t kept = cell.block_count < kept_chords ? cell.block_count : kept_chords;
    for (std::uint32_t i = 0; i < kept; ++i) kept_[i] = chords_of(view, cell.first_block + i, from, direction);
  }

  /// Extinction on [s, next) of the fluids in `mask`; `next` is the first event after s, infinite behind the last.
  EMBRUN_FN Rgb at(float s, std::uint32_t mask, float& next) const {
    OverlapSum total;
    F16 nearest = splat(infinity);
    FluidRun run(view, cell);
    do {
      if ((mask >> run.fluid & 1u) == 0) continue;
      const DensityFluid& fluid = view.fluids[run.fluid];
      FluidSums sums;
      for (std::uint32_t block = run.begin; block < run.end; ++block) {
        const DensityChords chords = chords_at(block);
        const F16 here = splat(s), never = splat(infinity), zero = splat(0.0f);
        // Inside from the entry on (enter <= s), up to but not at the exit (s < exit).
        const F16 exit = select_less(here, chords.enter, zero, chords.exit);
        sums.add(view, fluid, block,
                 {select_less(here, exit, load16(view.blocks[block].factor), zero), count_less(here, exit)});
        nearest = min_of(
            nearest, select_less(here, chords.enter, chords.enter, select_less(here, chords.exit, chords.exit, never)));
      }
      total.add(view.overlap, sums.extinction(fluid));
    } while (run.next(view, cell));
    next = min_lane(nearest);
    return total.extinction;
  }

 private:
  const ParticleDensityView& view;
  const DensityCell& cell;
  Vec3 from, direction;
  DensityChords kept_[kept_chords];

  EMBRUN_FN DensityChords chords_at(std::uint32_t block) const {
    const std::uint32_t i = block - cell.first_block;
    return i < kept_chords ? kept_[i] : chords_of(view, block, from, direction);
  }
};

/// Calls visit(cell, t_begin, t_end, extinction) for the stretches of a line from t_begin to t_end with any extinction, in
/// order, until it returns true. True if it did.
template <class Visitor>
EMBRUN_LOCAL_FN bool walk_density(const ParticleDensityView& view, Vec3 origin, Vec3 direction, float t_begin,
                                  float t_end, std::uint32_t mask, Visitor& visit) {
  for (GridWalk bricks(view.grid, origin, direction, t_begin, t_end); !bricks.done; bricks.advance()) {
    const std::uint32_t index = view.brick_index[bricks.index()];
    if (index == no_brick) continue;
    const DensityBrick& brick = view.bricks[index];
    for (GridWalk cells(brick.grid, origin, direction, bricks.begin, bricks.end()); !cells.done; cells.advance()) {
      const DensityCell& cell = view.cells[brick.first_cell + static_cast<std::uint32_t>(cells.index())];
      if (cell.block_count == 0) continue;
      const float start = cells.begin, length = cells.end() - start;
      const CellEvents events(view, cell, origin + start * direction, direction);
      for (float s = 0.0f; s < length;) {
        float next;
        const Rgb k = events.at(s, mask, next);
        next = min_of(next, length);
        if (!is_black(k) && visit(cell, start + s, start + next, k)) return true;
        s = next;
      }
    }
  }
  return false;
}

}  // namespace embrun

#pragma once

#include <cstdint>

#include "base/prefetch.h"
#include "geometry/implicit_surface_trace.h"
#include "math/lanes.h"

namespace embrun {

// Many rays against one implicit surface, as intersect_implicit_surface answers them one by one. Sixteen are under way
// at a time, a lane each, and sixteen more while these wait: they step from cell to cell together, so that their reads of memory overlap, and the cells'
// models are tested together. Only where a model cannot rule a crossing out the ray is looked at alone. A lane whose
// ray has ended takes the next one. What becomes of a ray does not depend on the others.
//
// `Rays` is where they come from and their answers go to:
//   int count() const;
//   const Ray& ray(int i) const;       // i in [0, count)
//   Side side(int i) const;
//   SurfaceHit& hit(int i);            // to be filled; left alone where there is none
//   void settle(int i, bool found);    // called once for each ray, in any order

/// Calls for what a near cell feels of a list: the parts from the first to the last.
template <class Eight>
EMBRUN_FN void prefetch_list(const Eight* lists, const SurfaceCell& cell) {
  if (cell.list_bits == 0) return;
  const int first = lowest_bit(cell.list_bits), end = highest_bit(cell.list_bits) + 1, log2 = cell.place.eights_log2();
  prefetch_range(lists + cell.list + (static_cast<std::size_t>(first) << log2),
                 (static_cast<std::size_t>(end - first) << log2) * sizeof(Eight));
}
EMBRUN_FN void prefetch_lists(const ImplicitSurfaceView& s, const SurfaceCell& cell) {
  if (s.equal_radii) {
    prefetch_list(s.packed, cell);
    if (cell.recovered_eights > 0) prefetch_range(s.packed_recovered + cell.recovered, sizeof(PackedRecoveredEight));
  } else {
    prefetch_list(s.wide, cell);
    if (cell.recovered_eights > 0) prefetch_range(s.wide_recovered + cell.recovered, sizeof(WideRecoveredEight));
  }
}

/// How many rays before its turn the first word and record of a ray are called for.
inline constexpr int prefetch_word_ahead = 6, prefetch_record_ahead = 3;

/// The word of the cell that a ray starts in, or null for one that starts outside the grid.
EMBRUN_FN const std::uint32_t* start_word(const ImplicitSurfaceView& s, const Ray& ray) {
  const float scale = 1.0f / s.cell_size;
  const int x = static_cast<int>((ray.origin.x - static_cast<float>(s.origin[0])) * scale);
  const int y = static_cast<int>((ray.origin.y - static_cast<float>(s.origin[1])) * scale);
  const int z = static_cast<int>((ray.origin.z - static_cast<float>(s.origin[2])) * scale);
  if (static_cast<unsigned>(x) >= static_cast<unsigned>(s.cells[0]) ||
      static_cast<unsigned>(y) >= static_cast<unsigned>(s.cells[1]) ||
      static_cast<unsigned>(z) >= static_cast<unsigned>(s.cells[2])) {
    return nullptr;
  }
  return surface_word(s, x, y, z);
}
EMBRUN_FN void prefetch_start_word(const ImplicitSurfaceView& s, const Ray& ray) {
  if (const std::uint32_t* word = start_word(s, ray)) prefetch(word);
}
EMBRUN_FN void prefetch_start_record(const ImplicitSurfaceView& s, const Ray& ray) {
  const std::uint32_t* word = start_word(s, ray);
  if (word != nullptr && (*word & cell_word::near) != 0) prefetch(surface_record(s, *word));
}

/// The rays under way. Lengths in grid units.
struct alignas(64) BatchLanes {
  float origin[3][16], direction[3][16], inverse[3][16];
  float low[16], high[16];
  float clear_main[16];
  std::int32_t cell[3][16];
  std::int32_t word[16];
  std::int32_t shift[16];     ///< of the octant's code in a word
  std::int32_t ahead[3][16];  ///< -1 where the direction is not negative
  std::int32_t inside[16];    ///< -1 or 0
  float record[16][16];       ///< of the cell in the lane: number k of the record in record[k]
  float model[3][16];         ///< of that cell along the ray, see model_along
  float clear_recovered[16];
  std::int32_t ray[16];
  double moved[16];
  std::int32_t sheet[16];    ///< as RayStart has it
  std::uint32_t on_surface;  ///< bits: the ray starts on the surface, in this cell
};

/// Puts the next ray that meets the grid into a lane; false when none is left.
template <Kernel kernel, bool equal_radii, class Rays>
EMBRUN_LOCAL_FN bool fill_lane(const ImplicitSurfaceView& s, Rays& rays, int& next, BatchLanes& lanes, int lane) {
  while (next < rays.count()) {
    const int i = next++;
    // What the rays to come will read first is called for now.
    if (i + prefetch_word_ahead < rays.count()) prefetch_start_word(s, rays.ray(i + prefetch_word_ahead));
    if (i + prefetch_record_ahead < rays.count()) prefetch_start_record(s, rays.ray(i + prefetch_record_ahead));
    GridRay local;
    float low, high;
    if (!to_grid(s, rays.ray(i), local, lanes.moved[lane], low, high)) {
      rays.settle(i, false);
      continue;
    }
    RayStart start;
    const Side side = known_start(s, rays.ray(i), rays.side(i), lanes.moved[lane], start);
    bool inside;
    int cell[3];
    const std::uint32_t word = start_walk<kernel, equal_radii>(s, local, low, side, cell, inside, start);
    int octant = 0;
    for (int a = 0; a < 3; ++a) {
      const bool ahead = local.direction[a] >= 0.0f;
      octant += ahead ? 1 << a : 0;
      lanes.origin[a][lane] = local.origin[a];
      lanes.direction[a][lane] = local.direction[a];
      lanes.inverse[a][lane] = local.inverse_direction[a];
      lanes.cell[a][lane] = cell[a];
      lanes.ahead[a][lane] = ahead ? -1 : 0;
    }
    lanes.word[lane] = static_cast<std::int32_t>(word);
    lanes.shift[lane] = 3 * octant;
    lanes.low[lane] = low;
    lanes.high[lane] = high;
    lanes.clear_main[lane] = start.clear_main;
    lanes.clear_recovered[lane] = start.clear_recovered;
    lanes.inside[lane] = inside ? -1 : 0;
    lanes.ray[lane] = i;
    lanes.sheet[lane] = start.sheet;
    const std::uint32_t bit = 1u << lane;
    lanes.on_surface = start.on_surface ? lanes.on_surface | bit : lanes.on_surface & ~bit;
    return true;
  }
  return false;
}

/// One step of all lanes: from the cells they are in to the next ones.
struct BatchStep {
  F16 corner[3];  ///< low corner of the cell
  F16 end;        ///< t at which the ray leaves it, or the cube of cells it skips
  I16 next[3];
  alignas(64) std::int32_t next_word[16];
  std::uint32_t near = 0;     ///< lanes in a near cell
  std::uint32_t leaving = 0;  ///< lanes that end here unless they hit
};

/// As walk_grid steps one ray.
EMBRUN_LOCAL_FN BatchStep step_lanes(const ImplicitSurfaceView& s, const BatchLanes& lanes, std::uint32_t active) {
  BatchStep step;
  const I16 word = load16(lanes.word);
  const I16 code = (word >> load16(lanes.shift)) & 7;
  const I16 low_edges = splat_int(static_cast<std::int32_t>(cell_word::edges & 0xffffffffu));
  const I16 high_edges = splat_int(static_cast<std::int32_t>(cell_word::edges >> 32));
  const I16 skip = (select(less(code, splat_int(4)), low_edges, high_edges) >> ((code & 3) << 3)) & 0xff;
  const I16 is_near = less(word, splat_int(0));
  step.near = lane_bits(is_near) & active;
  const I16 reach = select(is_near, splat_int(1), skip);

  // The forward cube of `reach` cells, and where the ray leaves it.
  I16 corner[3];
  F16 exit[3];
  for (int a = 0; a < 3; ++a) {
    const I16 cell = load16(lanes.cell[a]), ahead = load16(lanes.ahead[a]);
    corner[a] = select(ahead, cell, cell + 1 - reach);
    step.corner[a] = to_float(corner[a]);
    const F16 plane = to_float(select(ahead, corner[a] + reach, corner[a]));
    exit[a] = (plane - load16(lanes.origin[a])) * load16(lanes.inverse[a]);
  }
  const F16 nearest = min_of(min_of(exit[0], exit[1]), exit[2]);
  step.end = max_of(nearest, load16(lanes.low));

  // The next cell: exactly one on along the axis of exit; on the others where the ray is, within the cube.
  I16 leaves = at_most(load16(lanes.high), step.end);
  I16 undecided = splat_int(-1);
  for (int a = 2; a >= 0; --a) {
    const I16 last = corner[a] + reach - 1;
    const I16 along = floor_of(load16(lanes.origin[a]) + load16(lanes.direction[a]) * step.end);
    const I16 held = select(less(along, corner[a]), corner[a], select(less(last, along), last, along));
    const I16 across = select(load16(lanes.ahead[a]), last + 1, corner[a] - 1);
    const I16 here = undecided & at_most(exit[a], nearest);
    undecided = undecided & (here ^ -1);
    step.next[a] = select(here, across, held);
    leaves = leaves | less(step.next[a], splat_int(0)) | less(splat_int(s.cells[a] - 1), step.next[a]);
  }
  step.leaving = lane_bits(leaves) & active;

  // Its word and record are on their way while this cell is looked into: the walk waits for memory most of all.
  const I16 tile = ((step.next[2] >> 2) * s.tiles[1] + (step.next[1] >> 2)) * s.tiles[0] + (step.next[0] >> 2);
  store16(step.next_word, (tile << 6) + ((step.next[2] & 3) << 4) + ((step.next[1] & 3) << 2) + (step.next[0] & 3));
  for (std::uint32_t m = active & ~step.leaving; m != 0; m &= m - 1) {
    const int lane = __builtin_ctz(m);
    const std::uint32_t next = s.words[step.next_word[lane]];
    step.next_word[lane] = static_cast<std::int32_t>(next);
    // The first record stands in where there is none. By bits: as a condition it is made a branch, which is a guess that
    // waits for memory.
    const auto near_bits = static_cast<std::uint32_t>(static_cast<std::int32_t>(next) >> 31);
    prefetch(s.cell + (next & near_bits & ~cell_word::near));
  }
  return step;
}

/// The records of the cells that lanes are in; they were called for a round ago.
EMBRUN_LOCAL_FN void load_records(const ImplicitSurfaceView& s, BatchLanes& lanes, std::uint32_t which) {
  const void* rows[16];
  for (int lane = 0; lane < 16; ++lane) {
    const std::uint32_t word = static_cast<std::uint32_t>(lanes.word[lane]);
    // The first record stands in for the other lanes'.
    rows[lane] = s.cell + ((which >> lane & 1u) != 0 ? word & ~cell_word::near : 0u);
  }
  transpose16(rows, which, lanes.record);
}

/// Takes all lanes to their next cells.
EMBRUN_LOCAL_FN void advance_lanes(BatchLanes& lanes, const BatchStep& step) {
  for (int a = 0; a < 3; ++a) store16(lanes.cell[a], step.next[a]);
  store16(lanes.low, step.end);
  // As RayStart::end_at.
  store16(lanes.clear_main, min_of(load16(lanes.clear_main), step.end));
  store16(lanes.clear_recovered, min_of(load16(lanes.clear_recovered), step.end));
  store16(lanes.word, load16(step.next_word));
  lanes.on_surface &= ~step.near;
}

/// Whether the rays may meet the boxes of their cells' recovered particles between `low` and `high`; `o`: from the cells'
/// centres. The boxes are a little larger, for the rounding of rays from thousands of cells away.
EMBRUN_LOCAL_FN I16 may_meet_recovered(const BatchLanes& lanes, const F16 o[3], F16 low, F16 high) {
  I16 box;  // number 11 of the record
  __builtin_memcpy(&box, lanes.record[11], sizeof box);
  constexpr float part = 1.0f / CellBox::parts;
  low = max_of(low, load16(lanes.clear_recovered));
  for (int a = 0; a < 3; ++a) {
    const F16 first = to_float(box >> (10 * a) & 31) * part - (0.5f + 1e-3f);
    const F16 last = to_float(box >> (10 * a + 5) & 31) * part + (part - 0.5f + 1e-3f);
    const F16 inverse = load16(lanes.inverse[a]);
    const F16 to_first = (first - o[a]) * inverse, to_last = (last - o[a]) * inverse;
    low = max_of(low, min_of(to_first, to_last));
    high = min_of(high, max_of(to_first, to_last));
  }
  return at_most(low, high);
}

/// Lanes whose cells may hold a crossing, by the model in the record; leaves the model along the ray in the
/// lanes.
EMBRUN_LOCAL_FN std::uint32_t possible_lanes(BatchLanes& lanes, const BatchStep& step) {
  const F16 low = load16(lanes.low), high = min_of(step.end, load16(lanes.high));
  F16 c[10], o[3], d[3];
  for (int k = 0; k < 10; ++k) c[k] = load16(lanes.record[k]);
  for (int a = 0; a < 3; ++a) {
    o[a] = load16(lanes.origin[a]) - (step.corner[a] + 0.5f);
    d[a] = load16(lanes.direction[a]);
  }
  const F16 hx = 2.0f * c[4] * o[0] + c[7] * o[1] + c[8] * o[2];
  const F16 hy = c[7] * o[0] + 2.0f * c[5] * o[1] + c[9] * o[2];
  const F16 hz = c[8] * o[0] + c[9] * o[1] + 2.0f * c[6] * o[2];
  const F16 value = c[0] + c[1] * o[0] + c[2] * o[1] + c[3] * o[2] + 0.5f * (hx * o[0] + hy * o[1] + hz * o[2]);
  const F16 slope = (c[1] + hx) * d[0] + (c[2] + hy) * d[1] + (c[3] + hz) * d[2];
  const F16 curve = c[4] * d[0] * d[0] + c[5] * d[1] * d[1] + c[6] * d[2] * d[2] + c[7] * d[0] * d[1] +
                    c[8] * d[0] * d[2] + c[9] * d[1] * d[2];

  const I16 inside = load16(lanes.inside);
  const F16 sign = select(inside, splat(-1.0f), splat(1.0f));
  // Number 10 of the record is the slack, upper in the upper half.
  I16 slacks;
  __builtin_memcpy(&slacks, lanes.record[10], sizeof slacks);
  const F16 slack = as_float(select(inside, slacks << 16, slacks & static_cast<std::int32_t>(0xffff0000u)));
  const F16 p1 = sign * slope, p2 = sign * curve;
  store16(lanes.model[0], sign * value);
  store16(lanes.model[1], p1);
  store16(lanes.model[2], p2);
  const F16 p0 = sign * value + slack;
  // Number 13 of the record is list_bits, 15 recovered_eights in the low half, place, and kind in the highest byte.
  I16 list_bits, last;
  __builtin_memcpy(&list_bits, lanes.record[13], sizeof list_bits);
  __builtin_memcpy(&last, lanes.record[15], sizeof last);
  const I16 none = splat_int(0);
  const I16 no_main = equal(list_bits, none);
  const F16 from = max_of(low, select(no_main, load16(lanes.clear_recovered), load16(lanes.clear_main)));
  const F16 zero = splat(0.0f);
  const F16 at_from = p0 + from * (p1 + from * p2), at_high = p0 + high * (p1 + high * p2);
  const F16 slope_from = p1 + 2.0f * (p2 * from), slope_high = p1 + 2.0f * (p2 * high);
  const F16 disc = slope_from * slope_from - 4.0f * (p2 * at_from);
  const I16 hill = less(p2, zero) & less(zero, slope_from) & less(slope_high, zero) & at_most(zero, disc);
  const I16 main = at_most(from, high) & (at_most(zero, at_from) | at_most(zero, at_high) | hill);

  // From outside either field may be met, the recovered one in its box; from inside the main one has to be left. Where there
  // is no main field the model bounds the other one.
  const I16 has_main = no_main ^ -1, has_recovered = equal(last & 0xffff, none) ^ -1;
  const I16 look =
      select(inside, no_main | main,
             (main & has_main) | (has_recovered & (main | has_main) & may_meet_recovered(lanes, o, low, high)));
  return lane_bits(look | equal(last >> 24, splat_int(static_cast<std::int32_t>(SurfaceCellKind::split))));
}

/// Looks for the crossing in the near cell of one lane.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool lane_hit(const ImplicitSurfaceView& s, const BatchLanes& lanes, const BatchStep& step, int lane,
                              SurfaceHit& hit) {
  GridRay ray;
  Vec3 center;
  for (int a = 0; a < 3; ++a) {
    ray.origin[a] = lanes.origin[a][lane];
    ray.direction[a] = lanes.direction[a][lane];
    ray.inverse_direction[a] = lanes.inverse[a][lane];
    center[a] = lane_of(step.corner[a], lane) + 0.5f;
  }
  const SurfaceCell& cell = *surface_record(s, static_cast<std::uint32_t>(lanes.word[lane]));
  const RayStart start{(lanes.on_surface >> lane & 1u) != 0, lanes.sheet[lane], lanes.clear_main[lane],
                       lanes.clear_recovered[lane]};
  const bool inside = lanes.inside[lane] != 0;
  const float low = lanes.low[lane], high = min_of(lane_of(step.end, lane), lanes.high[lane]);
  const Parabola model{lanes.model[0][lane], lanes.model[1][lane], lanes.model[2][lane]};
  float t;
  if (cell.kind == SurfaceCellKind::split
          ? !split_hit<kernel, equal_radii>(s, cell, center, ray, inside, low, high, start, t, hit)
          : !leaf_hit<kernel, equal_radii>(s, cell, ray.origin - center, ray.direction, inside, model, low, high, start,
                                           t, hit)) {
    return false;
  }
  place_hit(s, ray, lanes.moved[lane], t, hit);
  return true;
}

/// Sixteen lanes and where they are in a step.
struct BatchGroup {
  BatchLanes lanes;
  BatchStep step;
  std::uint32_t active = 0;
  std::uint32_t look = 0;  ///< lanes whose cells may hold a crossing
};

/// The first half of a step, which ends with calling for the particles that the second will read.
EMBRUN_LOCAL_FN void begin_step(const ImplicitSurfaceView& s, BatchGroup& group) {
  if (group.active == 0) return;
  group.step = step_lanes(s, group.lanes, group.active);
  group.look = 0;
  if (group.step.near == 0) return;
  load_records(s, group.lanes, group.step.near);
  group.look = possible_lanes(group.lanes, group.step) & group.step.near;
  for (std::uint32_t m = group.look; m != 0; m &= m - 1) {
    prefetch_lists(s, *surface_record(s, static_cast<std::uint32_t>(group.lanes.word[__builtin_ctz(m)])));
  }
}

template <Kernel kernel, bool equal_radii, class Rays>
EMBRUN_LOCAL_FN void end_step(const ImplicitSurfaceView& s, Rays& rays, int& next, BatchGroup& group) {
  if (group.active == 0) return;
  BatchLanes& lanes = group.lanes;
  std::uint32_t found = 0;
  for (std::uint32_t m = group.look; m != 0; m &= m - 1) {
    const int lane = __builtin_ctz(m);
    if (!lane_hit<kernel, equal_radii>(s, lanes, group.step, lane, rays.hit(lanes.ray[lane]))) continue;
    rays.settle(lanes.ray[lane], true);
    found |= 1u << lane;
  }
  const std::uint32_t leaving = group.step.leaving & ~found;
  for (std::uint32_t m = leaving; m != 0; m &= m - 1) rays.settle(lanes.ray[__builtin_ctz(m)], false);
  advance_lanes(lanes, group.step);
  for (std::uint32_t m = leaving | found; m != 0; m &= m - 1) {
    const int lane = __builtin_ctz(m);
    if (!fill_lane<kernel, equal_radii>(s, rays, next, lanes, lane)) group.active &= ~(1u << lane);
  }
}

template <Kernel kernel, bool equal_radii, class Rays>
EMBRUN_LOCAL_FN void intersect_surface_batch_as(const ImplicitSurfaceView& s, Rays& rays) {
  // Two groups take turns: while one reads its particles, those of the other are on their way.
  BatchGroup groups[2];
  int next = 0;
  for (BatchGroup& group : groups) {
    __builtin_memset(&group.lanes, 0, sizeof group.lanes);
    for (int lane = 0; lane < 16; ++lane) {
      if (!fill_lane<kernel, equal_radii>(s, rays, next, group.lanes, lane)) break;
      group.active |= 1u << lane;
    }
  }
  begin_step(s, groups[0]);
  while ((groups[0].active | groups[1].active) != 0) {
    begin_step(s, groups[1]);
    end_step<kernel, equal_radii>(s, rays, next, groups[0]);
    begin_step(s, groups[0]);
    end_step<kernel, equal_radii>(s, rays, next, groups[1]);
  }
}

/// First crossings of many rays, each as intersect_implicit_surface finds it.
template <class Rays>
EMBRUN_LOCAL_FN void intersect_implicit_surface_batch(const ImplicitSurfaceView& s, Rays& rays) {
  if (s.equal_radii) {
    switch (s.kernel) {
      case Kernel::metaball: return intersect_surface_batch_as<Kernel::metaball, true>(s, rays);
      case Kernel::zhu_bridson: return intersect_surface_batch_as<Kernel::zhu_bridson, true>(s, rays);
      case Kernel::blinn: return intersect_surface_batch_as<Kernel::blinn, true>(s, rays);
    }
  } else {
    switch (s.kernel) {
      case Kernel::metaball: return intersect_surface_batch_as<Kernel::metaball, false>(s, rays);
      case Kernel::zhu_bridson: return intersect_surface_batch_as<Kernel::zhu_bridson, false>(s, rays);
      case Kernel::blinn: return intersect_surface_batch_as<Kernel::blinn, false>(s, rays);
    }
  }
}

}  // namespace embrun

#pragma once

#include "math/next_float.h"
#include "media/grid_medium.h"
#include "media/particle_flight.h"

// Flights through a medium given on a grid: delta and ratio tracking by the blocks' majorants, as in particle_flight.h.

namespace embrun {

/// The part of a line in the box of a grid, in the box's coordinates: [0, length] in the line's own unit, from `offset` on.
/// It begins at the box, so that a far origin costs no precision there.
struct GridStretch {
  Vec3 start, direction;
  float offset = 0, length = 0;

  EMBRUN_FN GridStretch(const GridMedium& medium, const DensityRay& ray) {
    const Vec3 origin = medium.to_extinction.point(ray.origin);
    direction = medium.to_extinction.vector(ray.direction);
    float begin = ray.begin, end = ray.end;
    for (int axis = 0; axis < 3; ++axis) {
      const float o = origin[axis], d = direction[axis];
      if (d == 0.0f) {
        if (!(o >= 0.0f && o <= 1.0f)) return;
        continue;
      }
      const float to_low = -o / d, to_high = (1.0f - o) / d;
      begin = max_of(begin, min_of(to_low, to_high));
      end = min_of(end, max_of(to_low, to_high));
    }
    if (!(begin < end)) return;
    offset = begin;
    length = end - begin;
    const Vec3 entry = origin + begin * direction;
    start = {clamp(entry.x, 0.0f, 1.0f), clamp(entry.y, 0.0f, 1.0f), clamp(entry.z, 0.0f, 1.0f)};
  }
  EMBRUN_FN GridWalk blocks(const GridMedium& medium) const {
    return GridWalk(medium.blocks, start, direction, 0.0f, length);
  }
  EMBRUN_FN Vec3 at(float s) const { return start + s * direction; }
};

/// On by a flight's step, at least to the next number: extreme majorants must not keep a ray where it is.
EMBRUN_FN float step_on(float s, float step) { return max_of(s + step, next_float(s)); }

/// Delta tracking [Woodcock1965] in one channel. `depth`: optical depth of the first tentative collision. Majorants found
/// too small are counted in `exceeded`. Flight::local has no fluid.
EMBRUN_LOCAL_FN Flight track_grid_flight(const GridMedium& medium, const DensityRay& ray, int channel, float depth,
                                         RandomStream& random, std::uint64_t& exceeded) {
  Flight flight;
  const GridStretch stretch(medium, ray);
  for (GridWalk blocks = stretch.blocks(medium); !blocks.done; blocks.advance()) {
    const Rgb majorants = medium.majorants[blocks.index()];
    const float majorant = majorants[channel], end = blocks.end();
    float s = blocks.begin;
    while (true) {
      const float left = (end - s) * majorant;
      if (depth >= left) {
        depth -= left;
        if (!medium.grey) flight.ratio *= majorant_ratio(majorants, channel, end - s);
        break;
      }
      const float step = depth / majorant;
      s = step_on(s, step);
      const Rgb k = value_at(medium.extinction, stretch.at(s));
      exceeded += exceeds(k, majorants) ? 1 : 0;
      const Sample2 u = random.next_pair();
      const bool real = u.x * majorant < k[channel];
      if (!medium.grey) {
        flight.ratio *= majorant_ratio(majorants, channel, step);
        const Rgb f = real ? k : above_zero(majorants - k);
        flight.ratio *= f * (1.0f / f[channel]);
      }
      if (real) {
        flight.collided = true;
        flight.t = stretch.offset + s;
        flight.local.extinction = k;
        flight.local.albedo = albedo_at(medium, ray.origin + flight.t * ray.direction);
        return flight;
      }
      depth = flight_depth(u.y);
    }
  }
  return flight;
}

/// Ratio tracking [Novak2014]: an estimate of the transmittance without bias.
EMBRUN_LOCAL_FN Rgb track_grid_transmittance(const GridMedium& medium, const DensityRay& ray, RandomStream& random,
                                             std::uint64_t& exceeded) {
  Rgb through = grey(1.0f);
  float depth = flight_depth(random.next_pair().x);
  const GridStretch stretch(medium, ray);
  for (GridWalk blocks = stretch.blocks(medium); !blocks.done; blocks.advance()) {
    const Rgb majorants = medium.majorants[blocks.index()];
    const float majorant = max_component(majorants), end = blocks.end();
    float s = blocks.begin;
    while (true) {
      const float left = (end - s) * majorant;
      if (depth >= left) {
        depth -= left;
        break;
      }
      s = step_on(s, depth / majorant);
      const Rgb k = value_at(medium.extinction, stretch.at(s));
      exceeded += exceeds(k, majorants) ? 1 : 0;
      const Sample2 u = random.next_pair();
      depth = flight_depth(u.x);
      through *= above_zero(grey(1.0f) - k * (1.0f / majorant));
      // Almost nothing left: goes on by chance, so that opaque media end.
      const float most = max_component(through);
      if (most < 0.05f) {
        if (!(u.y * 0.1f < most)) return {};
        through *= 0.1f / most;
      }
    }
  }
  return max_component(through) > 0.0f ? through : Rgb{};
}

}  // namespace embrun

#pragma once

#include "media/density_walk.h"
#include "media/particle_density.h"
#include "sampling/random_stream.h"

// Where light collides in a medium of particles, and how much of it gets through: two samplers of the same distribution.
//
// Coloured media. A flight is drawn in one channel, but the three have different densities. So it comes with the ratios of
// its density in each channel to that in the channel drawn; spectral_weight() makes of them the factor on the throughput by
// the balance heuristic over the channels [Wilkie2014, Miller2019].

namespace embrun {

/// What a ray's way through the particles led to.
struct Flight {
  bool collided = false;
  float t = 0;         ///< where: the ray parameter
  Rgb ratio{1, 1, 1};  ///< of the flight's density in each channel to that in the channel drawn
  LocalMedium local;   ///< what was hit; its albedo is not in `ratio`
};

/// How flights are drawn. Both draw from the same distribution.
enum class FlightSampler : std::uint8_t {
  tracking,  ///< delta tracking: tentative collisions by the bricks' majorants [Woodcock1965]
  events,    ///< the exact walk; smooth densities are tracked all the same
};

/// A stretch of a line through the particles, and the fluids that count on it.
struct DensityRay {
  Vec3 origin, direction;  ///< unit
  float begin = 0, end = infinity;
  std::uint32_t fluids = ~0u;  ///< mask
};

/// Chances that a flight is drawn in each channel: those of the light that the path carries.
EMBRUN_FN Rgb channel_shares(Rgb throughput) {
  const float sum = throughput.r + throughput.g + throughput.b;
  return sum > 0.0f ? throughput * (1.0f / sum) : grey(1.0f / 3.0f);
}
EMBRUN_FN int draw_channel(Rgb shares, float u) {
  return u < shares.r ? 0 : u < shares.r + shares.g || !(shares.b > 0.0f) ? 1 : 2;
}

/// Factor on the throughput: each channel's density over the mean of them by the chances with which channels are drawn.
EMBRUN_FN Rgb spectral_weight(Rgb ratio, Rgb shares) {
  const float mean_ratio = shares.r * ratio.r + shares.g * ratio.g + shares.b * ratio.b;
  return ratio * (1.0f / mean_ratio);
}

/// Optical depth that a flight reaches, exponentially distributed, from u in [0, 1).
EMBRUN_FN float flight_depth(float u) { return -logf(1.0f - u); }

// ---- tracking ----------------------------------------------------------------------------------------------------

/// exp(-(a - b) s) per channel: what the majorants of the channels make of the ratios over a distance.
EMBRUN_FN Rgb majorant_ratio(Rgb majorant, int channel, float distance) {
  return exp_of((grey(majorant[channel]) - majorant) * distance);
}

/// Differences of extinctions and their majorant are not negative but for rounding.
EMBRUN_FN Rgb above_zero(Rgb v) { return {max_of(v.r, 0.0f), max_of(v.g, 0.0f), max_of(v.b, 0.0f)}; }

/// What rounding may add to an extinction.
inline constexpr float majorant_slack = 1.0001f;

/// True when a majorant was too small, but for rounding.
EMBRUN_FN bool exceeds(Rgb extinction, Rgb majorant) {
  return extinction.r > majorant_slack * majorant.r || extinction.g > majorant_slack * majorant.g ||
         extinction.b > majorant_slack * majorant.b;
}

/// A tentative collision: a point that delta tracking stops at.
struct TentativeCollision {
  float t = 0;
  Vec3 point;
  int brick = 0;  ///< the cell of ParticleDensityView::grid
  Sample2 u;      ///< decides whether it is real; draws what comes then
  Rgb ratio;      ///< of coloured media: as Flight::ratio, of the way since the last one
};

/// Draws the tentative collisions along a ray, one by one.
struct TentativeCollisions {
  Rgb rest = grey(1.0f);  ///< as TentativeCollision::ratio, of the way behind the last of them

  TentativeCollisions() = default;
  /// `first_depth`: optical depth, by the majorants, of the first.
  EMBRUN_FN TentativeCollisions(const ParticleDensityView& view, const DensityRay& ray, int drawn_channel,
                                float first_depth)
      : bricks_(view.grid, ray.origin, ray.direction, ray.begin, ray.end),
        channel_(drawn_channel),
        depth_(first_depth) {
    if (!bricks_.done) enter_brick(view);
  }

  /// False: there is none any more before the ray's end.
  EMBRUN_FN bool next(const ParticleDensityView& view, const DensityRay& ray, RandomStream& random,
                      TentativeCollision& found) {
    while (!bricks_.done) {
      const float left = (end_ - t_) * majorant_;
      if (depth_ < left) {
        const float step = depth_ / majorant_;
        t_ += step;
        found.t = t_;
        found.point = ray.origin + t_ * ray.direction;
        found.brick = bricks_.index();
        found.u = random.next_pair();
        if (!view.grey) {
          found.ratio = rest * majorant_ratio(view.majorant(found.brick), channel_, step);
          rest = grey(1.0f);
        }
        depth_ = flight_depth(found.u.y);
        return true;
      }
      depth_ -= left;
      if (!view.grey) rest *= majorant_ratio(view.majorant(bricks_.index()), channel_, end_ - t_);
      bricks_.advance();
      if (!bricks_.done) enter_brick(view);
    }
    return false;
  }

 private:
  GridWalk bricks_;
  int channel_ = 0;
  float depth_ = 0, t_ = 0, end_ = 0, majorant_ = 0;

  EMBRUN_FN void enter_brick(const ParticleDensityView& view) {
    majorant_ = view.majorants[channel_][bricks_.index()];
    t_ = bricks_.begin;
    end_ = bricks_.end();
  }
};

/// The density at a tentative collision: true when it is real, and then `flight` is complete. `cell`: what lies there, or
/// null.
EMBRUN_FN bool collides(const ParticleDensityView& view, const DensityRay& ray, int channel,
                        const TentativeCollision& at, const DensityCell* cell, Flight& flight,
                        std::uint64_t& exceeded) {
  const Rgb k = cell != nullptr ? extinction_in_cell(view, *cell, at.point, ray.fluids) : Rgb{};
  const float bound = view.majorants[channel][at.brick];
  const bool real = at.u.x * bound < k[channel];
  if (view.grey) {
    exceeded += k.g > majorant_slack * bound ? 1 : 0;
  } else {
    const Rgb majorant = view.majorant(at.brick);
    exceeded += exceeds(k, majorant) ? 1 : 0;
    const Rgb f = real ? k : above_zero(majorant - k);
    flight.ratio *= at.ratio * f * (1.0f / f[channel]);
  }
  if (!real) return false;
  flight.local = collide_in_cell(view, *cell, at.point, ray.fluids, k, channel, at.u.y);
  flight.collided = flight.local.fluid >= 0;
  flight.t = at.t;
  // Of a mixture it is the colliding fluid that the flight's density is of.
  if (!view.grey && flight.collided)
    for (int c = 0; c < 3; ++c)
      flight.ratio[c] *=
          k[c] > 0.0f ? flight.local.extinction[c] / k[c] * (k[channel] / flight.local.extinction[channel]) : 0.0f;
  return true;
}

/// Delta tracking on the exact density. `depth`: optical depth of the first tentative collision. Majorants found too small
/// are counted in `exceeded`.
EMBRUN_LOCAL_FN Flight track_flight(const ParticleDensityView& view, const DensityRay& ray, int channel, float depth,
                                    RandomStream& random, std::uint64_t& exceeded) {
  Flight flight;
  TentativeCollisions tentative(view, ray, channel, depth);
  TentativeCollision at;
  while (tentative.next(view, ray, random, at)) {
    const DensityCell* cell = cell_at(view, view.bricks[view.brick_index[at.brick]], at.point);
    if (collides(view, ray, channel, at, cell, flight, exceeded)) return flight;
  }
  flight.ratio *= tentative.rest;
  return flight;
}

/// Ratio tracking [Novak2014]: an estimate of the transmittance without bias.
EMBRUN_LOCAL_FN Rgb track_transmittance(const ParticleDensityView& view, const DensityRay& ray, RandomStream& random,
                                        std::uint64_t& exceeded) {
  Rgb through = grey(1.0f);
  float depth = flight_depth(random.next_pair().x);
  for (GridWalk bricks(view.grid, ray.origin, ray.direction, ray.begin, ray.end); !bricks.done; bricks.advance()) {
    const std::uint32_t index = view.brick_index[bricks.index()];
    if (index == no_brick) continue;
    const DensityBrick& brick = view.bricks[index];
    const Rgb bound = view.majorant(bricks.index());
    const float majorant = max_component(bound), end = bricks.end();
    float t = bricks.begin;
    while (true) {
      const float left = (end - t) * majorant;
      if (depth >= left) {
        depth -= left;
        break;
      }
      t += depth / majorant;
      const Vec3 p = ray.origin + t * ray.direction;
      const Sample2 u = random.next_pair();
      depth = flight_depth(u.x);
      const DensityCell* cell = cell_at(view, brick, p);
      if (cell == nullptr) continue;
      const Rgb k = extinction_in_cell(view, *cell, p, ray.fluids);
      exceeded += exceeds(k, bound) ? 1 : 0;
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

// ---- events ------------------------------------------------------------------------------------------------------

/// Adds up optical depth until it reaches that of the collision.
struct CollisionFinder {
  int channel = 0;
  float depth = 0;  ///< left to go, in the channel
  Rgb passed;       ///< optical depth up to the collision, or the end
  const DensityCell* cell = nullptr;
  Rgb extinction;
  float t = 0, middle = 0;  ///< of the collision; of the stretch that it lies in

  EMBRUN_FN bool operator()(const DensityCell& list, float begin, float end, Rgb k) {
    const float here = k[channel] * (end - begin);
    if (depth >= here) {
      depth -= here;
      passed += k * (end - begin);
      return false;
    }
    const float step = min_of(depth / k[channel], end - begin);
    passed += k * step;
    cell = &list;
    extinction = k;
    t = begin + step;
    middle = 0.5f * (begin + end);
    return true;
  }
};

/// The exact walk to a collision at optical depth `depth` in a channel. `u`: draws the fluid of a mixture.
EMBRUN_LOCAL_FN Flight walk_flight(const ParticleDensityView& view, const DensityRay& ray, int channel, float depth,
                                   float u) {
  CollisionFinder finder;
  finder.channel = channel;
  finder.depth = depth;
  const bool found = walk_density(view, ray.origin, ray.direction, ray.begin, ray.end, ray.fluids, finder);
  Flight flight;
  if (!view.grey) flight.ratio = exp_of(grey(finder.passed[channel]) - finder.passed);
  if (!found) return flight;
  // The middle of the stretch is in the same balls, and not on the surface of one.
  flight.local = collide_in_cell(view, *finder.cell, ray.origin + finder.middle * ray.direction, ray.fluids,
                                 finder.extinction, channel, u);
  flight.collided = flight.local.fluid >= 0;
  flight.t = finder.t;
  if (!view.grey && flight.collided)
    flight.ratio *= flight.local.extinction * (1.0f / flight.local.extinction[channel]);
  return flight;
}

struct DepthSum {
  Rgb depth;

  EMBRUN_FN bool operator()(const DensityCell&, float begin, float end, Rgb k) {
    depth += k * (end - begin);
    return false;
  }
};

/// Optical depth of the stretch, exact but for rounding. Only for densities that are piecewise constant.
EMBRUN_LOCAL_FN Rgb optical_depth(const ParticleDensityView& view, const DensityRay& ray) {
  DepthSum sum;
  walk_density(view, ray.origin, ray.direction, ray.begin, ray.end, ray.fluids, sum);
  return sum.depth;
}

// ---- the interface -----------------------------------------------------------------------------------------------

/// The next collision of light that flies along the ray, drawn in `channel`. `u` in [0, 1) decides how far, `random` the
/// rest.
EMBRUN_LOCAL_FN Flight next_collision(const ParticleDensityView& view, const DensityRay& ray, FlightSampler sampler,
                                      int channel, float u, RandomStream& random, std::uint64_t& exceeded) {
  if ((ray.fluids & view.present) == 0) return {};
  if (sampler == FlightSampler::events && view.piecewise)
    return walk_flight(view, ray, channel, flight_depth(u), random.next_pair().x);
  return track_flight(view, ray, channel, flight_depth(u), random, exceeded);
}

/// How much light gets along the ray: exactly by events, by tracking an estimate whose mean it is.
EMBRUN_LOCAL_FN Rgb transmittance(const ParticleDensityView& view, const DensityRay& ray, FlightSampler sampler,
                                  RandomStream& random, std::uint64_t& exceeded) {
  if ((ray.fluids & view.present) == 0) return grey(1.0f);
  if (sampler == FlightSampler::events && view.piecewise) return exp_of(optical_depth(view, ray) * -1.0f);
  return track_transmittance(view, ray, random, exceeded);
}

}  // namespace embrun

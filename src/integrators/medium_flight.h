#pragma once

#include "integrators/path_scene.h"
#include "integrators/path_state.h"
#include "media/flight_batch.h"
#include "media/grid_flight.h"
#include "media/homogeneous.h"

// What happens to a path between two boundaries: absorption, and collisions with what scatters there. Media that are the same
// everywhere in a body absorb by their transmittance and scatter by free flight; particles and media on grids do both by free
// flight. The flights are independent, and the shortest one counts.

namespace embrun {

/// Where a path collided with a medium on its way to the next boundary, and what it met.
struct MediumCollision {
  float t = 0;
  PhaseFunction phase;
  Rgb albedo{1, 1, 1};
  Rgb emission;       ///< radiance that the collision brings
  float way_end = 0;  ///< PathFlight::way_end
};

/// Mask of the fluids whose particles count where the media are these.
EMBRUN_FN std::uint32_t fluids_within(const PathScene& scene, const MediaState& media) {
  return (scene.volumes | (static_cast<std::uint32_t>(media.inside_solids) & scene.media[media.current()].fluids)) &
         scene.density.present;
}

/// True where a path may collide.
EMBRUN_FN bool may_collide(const PathScene& scene, const MediaState& media) {
  const Medium& medium = scene.media[media.current()];
  return fluids_within(scene, media) != 0 || medium.grid >= 0 || !is_black(medium.scattering);
}

/// exp(-coefficient * distance), for channels of one coefficient at any distance.
EMBRUN_FN Rgb homogeneous_ratio(Rgb coefficient, int channel, float distance) {
  return exp_of((grey(coefficient[channel]) - coefficient) * distance);
}

/// The path's flight through a medium on a grid up to `end`, by `u` and a stream of its own: asked again with a nearer end,
/// it is the same flight up to there.
EMBRUN_LOCAL_FN Flight fly_in_grid(const GridMedium& grid, const PathState& path, float end, int channel, float u,
                                   std::uint64_t& exceeded) {
  constexpr std::uint32_t stream = 1u << 16;  // beyond those of the particles
  RandomStream random(path.key, Dimension::tracking, stream + path.passed);
  return track_grid_flight(grid, {path.ray.origin, path.ray.direction, path.ray.t_min, end, 0}, channel,
                           flight_depth(u), random, exceeded);
}

/// A path's flight to `t` at most, begun: what is to be asked of the particles, and the rest, which waits for their answer.
/// A particle that is met before undoes the others.
struct PathFlight {
  FlightQuery query;
  float way_end = 0;       ///< where the way through the medium ends: at a boundary or a lamp, or never
  Rgb shares;              ///< chances of the channels
  bool scattered = false;  ///< in a medium that is the same everywhere
  Flight in_grid;          ///< in one that is given on a grid
  float grid_u = 0;        ///< fly_in_grid's
};

EMBRUN_LOCAL_FN PathFlight begin_flight(const PathScene& scene, const PathState& path, float t,
                                        PathCounters& counters) {
  const Ray& ray = path.ray;
  const Medium& medium = scene.media[path.media.current()];
  const SamplerKind kind = scene.settings.sampler;
  PathFlight flight;
  flight.way_end = t;
  FlightQuery& query = flight.query;
  // Flights beyond the first of one event are drawn from a stream of their own.
  query.random = RandomStream(path.key, Dimension::tracking, path.passed);
  const bool first = path.passed == 0;
  flight.shares = channel_shares(path.throughput);
  const Sample2 spare = first ? Sample2{} : query.random.next_pair();
  query.channel = draw_channel(flight.shares, first ? sample_1d(kind, path.key, Dimension::channel) : spare.x);
  query.u = first ? sample_1d(kind, path.key, Dimension::free_flight) : spare.y;

  float end = t;
  if (!is_black(medium.scattering)) {
    const float scattering = medium.scattering[query.channel];
    const float free = scattering > 0.0f ? flight_depth(query.random.next_pair().x) / scattering : infinity;
    flight.scattered = free < t - ray.t_min;
    if (flight.scattered) end = ray.t_min + free;
  }
  query.ray = {ray.origin, ray.direction, ray.t_min, end, fluids_within(scene, path.media)};
  if (medium.grid >= 0) {
    flight.grid_u = query.ray.fluids != 0 ? query.random.next_pair().x : query.u;
    flight.in_grid = fly_in_grid(scene.grids[medium.grid], path, end, query.channel, flight.grid_u, counters.majorants);
    if (flight.in_grid.collided) query.ray.end = flight.in_grid.t;
  }
  return flight;
}

/// Ends it with the particles' answer. True when the path collides: `collision` is filled in, and the throughput has the
/// weight of the flight (the albedo not yet) and the absorption up to there. False: it has the weight of getting through,
/// but not the absorption, which is advance_path's.
EMBRUN_LOCAL_FN bool end_flight(const PathScene& scene, PathState& path, const PathFlight& flight, const Flight& met,
                                MediumCollision& collision) {
  const Medium& medium = scene.media[path.media.current()];
  const float begin = path.ray.t_min;
  const int channel = flight.query.channel;
  float end = flight.query.ray.end;
  Rgb ratio = met.ratio;
  Rgb grid_ratio = flight.in_grid.ratio;
  if (met.collided) {
    end = met.t;
    collision = {end, scene.density.fluids[met.local.fluid].phase, met.local.albedo, met.local.emission,
                 flight.way_end};
    // The flight through the grid counts up to here only.
    std::uint64_t counted = 0;
    if (medium.grid >= 0)
      grid_ratio = fly_in_grid(scene.grids[medium.grid], path, end, channel, flight.grid_u, counted).ratio;
  } else if (flight.in_grid.collided) {
    collision = {end, scene.grids[medium.grid].phase, flight.in_grid.local.albedo, {}, flight.way_end};
  } else if (flight.scattered) {
    ratio *= medium.scattering * (1.0f / medium.scattering[channel]);
    collision = {end, medium.phase, grey(1.0f), {}, flight.way_end};
  }
  ratio *= grid_ratio;
  if (!is_black(medium.scattering) && end < infinity)
    ratio *= homogeneous_ratio(medium.scattering, channel, end - begin);
  path.throughput *= spectral_weight(ratio, flight.shares);
  const bool collided = flight.scattered || met.collided || flight.in_grid.collided;
  if (collided) path.throughput *= absorption_transmittance(medium.absorption, end - begin);
  return collided;
}

/// Share of light that gets along a ray's stretch up to `t` (which may be infinite) within one state of the media.
EMBRUN_LOCAL_FN Rgb stretch_transmittance(const PathScene& scene, const MediaState& media, const Ray& ray, float t,
                                          RandomStream& random, PathCounters& counters) {
  const Medium& medium = scene.media[media.current()];
  Rgb through = grey(1.0f);
  if (t < infinity) through = absorption_transmittance(medium.absorption + medium.scattering, t - ray.t_min);
  const std::uint32_t fluids = fluids_within(scene, media);
  if (fluids != 0)
    through *= transmittance(scene.density, {ray.origin, ray.direction, ray.t_min, t, fluids},
                             scene.settings.transmittance, random, counters.majorants);
  if (medium.grid >= 0)
    through *= track_grid_transmittance(scene.grids[medium.grid], {ray.origin, ray.direction, ray.t_min, t, 0}, random,
                                        counters.majorants);
  return through;
}

}  // namespace embrun

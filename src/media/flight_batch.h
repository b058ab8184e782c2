#pragma once

#include "base/prefetch.h"
#include "media/particle_flight.h"

// Many flights through the particles, as next_collision answers them one by one. What each costs is mostly waiting for
// memory, four reads deep; so a dozen are under way at a time and take every step together: their reads overlap. What
// becomes of a flight does not depend on the others.
//
// `Flights` is where they come from and their answers go to:
//   int count() const;
//   FlightQuery query(int i) const;                 // i in [0, count), once each, in order
//   void settle(int i, const Flight& flight);       // once each, in any order

namespace embrun {

/// The arguments of next_collision.
struct FlightQuery {
  DensityRay ray;
  int channel = 0;
  float u = 0;
  RandomStream random;
};

inline constexpr int flights_under_way = 12;

/// A flight under way.
struct FlightLane {
  const DensityCell* cell = nullptr;
  FlightQuery query;
  TentativeCollisions tentative;
  int number = 0;
  TentativeCollision at;
  Flight flight;
};

/// The next flight that has a tentative collision; those that have none are settled. False: there are no more.
template <class Flights>
EMBRUN_FN bool start_flight(const ParticleDensityView& view, Flights& flights, int& started, FlightLane& lane) {
  while (started < flights.count()) {
    lane.number = started++;
    lane.query = flights.query(lane.number);
    lane.flight = {};
    if ((lane.query.ray.fluids & view.present) != 0) {
      lane.tentative = {view, lane.query.ray, lane.query.channel, flight_depth(lane.query.u)};
      if (lane.tentative.next(view, lane.query.ray, lane.query.random, lane.at)) return true;
      lane.flight.ratio *= lane.tentative.rest;
    }
    flights.settle(lane.number, lane.flight);
  }
  return false;
}

/// Takes a flight that did not collide to its next tentative collision, or another one to its first.
template <class Flights>
EMBRUN_FN bool go_on(const ParticleDensityView& view, Flights& flights, int& started, FlightLane& lane) {
  if (!lane.flight.collided) {
    if (lane.tentative.next(view, lane.query.ray, lane.query.random, lane.at)) return true;
    lane.flight.ratio *= lane.tentative.rest;
  }
  flights.settle(lane.number, lane.flight);
  return start_flight(view, flights, started, lane);
}

/// All the flights, by delta tracking.
template <class Flights>
EMBRUN_LOCAL_FN void track_flights(const ParticleDensityView& view, Flights& flights, std::uint64_t& exceeded) {
  FlightLane lanes[flights_under_way];
  int started = 0, under_way = 0;
  while (under_way < flights_under_way && start_flight(view, flights, started, lanes[under_way])) ++under_way;
  while (under_way > 0) {
    for (int i = 0; i < under_way; ++i) prefetch(&view.bricks[view.brick_index[lanes[i].at.brick]]);
    for (int i = 0; i < under_way; ++i) {
      FlightLane& lane = lanes[i];
      lane.cell = cell_of(view, view.bricks[view.brick_index[lane.at.brick]], lane.at.point);
      if (lane.cell != nullptr) prefetch(lane.cell);
    }
    for (int i = 0; i < under_way; ++i) {
      FlightLane& lane = lanes[i];
      if (lane.cell == nullptr) continue;
      if (lane.cell->block_count == 0)
        lane.cell = nullptr;
      else
        prefetch_range(&view.blocks[lane.cell->first_block], sizeof(DensityBlock));
    }
    for (int i = 0; i < under_way; ++i)
      collides(view, lanes[i].query.ray, lanes[i].query.channel, lanes[i].at, lanes[i].cell, lanes[i].flight, exceeded);
    for (int i = 0; i < under_way; ++i)
      while (i < under_way && !go_on(view, flights, started, lanes[i])) {
        --under_way;
        if (i < under_way) lanes[i] = lanes[under_way];
      }
  }
}

/// The next collision of each flight.
template <class Flights>
EMBRUN_LOCAL_FN void next_collisions(const ParticleDensityView& view, FlightSampler sampler, Flights& flights,
                                     std::uint64_t& exceeded) {
  if (sampler == FlightSampler::tracking || !view.piecewise) {
    track_flights(view, flights, exceeded);
    return;
  }
  for (int i = 0; i < flights.count(); ++i) {
    FlightQuery query = flights.query(i);
    flights.settle(i, next_collision(view, query.ray, sampler, query.channel, query.u, query.random, exceeded));
  }
}

}  // namespace embrun

#pragma once

#include <time.h>

#include "backend/cpu/kernel_table.h"
#include "image/film.h"
#include "integrators/medium_scatter.h"
#include "integrators/path_stages.h"

namespace embrun {

/// Paths under way together, and what the stages hand each other. Indices are slots of the arrays.
template <int Size>
struct BasicPathBatch {
  PathState paths[Size];
  SceneHit hits[Size];
  bool found[Size];
  Ray rest[Size];  ///< see CpuIntersector::intersect_all
  int nearest[Size];
  MediaState behind[Size];
  ShadowRay shadows[Size];
  PathFlight flights[Size];
  MediumCollision collisions[Size];
  SurfaceEvent events[Size];    ///< of integrators that go back to them
  bool collided[Size];          ///< with a medium, before what the ray met
  std::uint16_t active[Size];   ///< slots of the paths that go on
  std::uint16_t ordered[Size];  ///< the same, those in air first
  std::uint16_t lit[Size];      ///< slots whose shadow ray is to be traced
  std::uint16_t flying[Size];   ///< slots whose path may collide with a medium
  std::uint16_t met[Size];      ///< slots whose event waits for the lights
};

struct PathBatch : BasicPathBatch<batch_size> {};

/// Processor time of this thread: what others do on the machine does not count.
EMBRUN_FN std::uint64_t thread_ns() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1000000000u + static_cast<std::uint64_t>(now.tv_nsec);
}

/// Times what is done to some rays, if asked to: reading the clock costs as much as a few rays.
class RayTimer {
 public:
  EMBRUN_FN explicit RayTimer(bool timed) : timed_(timed), start_(timed ? thread_ns() : 0) {}
  EMBRUN_FN void stop(RayCounter& counter, std::uint64_t rays) const {
    if (!timed_ || rays == 0) return;
    counter.timed_ns += thread_ns() - start_;
    counter.timed_rays += rays;
  }

 private:
  bool timed_;
  std::uint64_t start_;
};

/// What a path brought to its pixel.
EMBRUN_FN FilmSample film_sample(const PathState& path) {
  FilmSample sample;
  sample.radiance = path.radiance;
  sample.albedo = path.albedo;
  sample.normal = path.first_normal;
  sample.depth = path.first_distance;
  sample.valid = !path.failed;
  return sample;
}

/// The listed paths' rays, as CpuIntersector::intersect_all wants them.
template <class Batch>
struct PathQueries {
  Batch& batch;
  const std::uint16_t* slots;
  int number;

  EMBRUN_FN int count() const { return number; }
  EMBRUN_FN const Ray& ray(int i) const { return batch.paths[slots[i]].ray; }
  EMBRUN_FN const MediaState& media(int i) const { return batch.paths[slots[i]].media; }
  EMBRUN_FN SceneHit& hit(int i) { return batch.hits[slots[i]]; }
  EMBRUN_FN bool& found(int i) { return batch.found[slots[i]]; }
  EMBRUN_FN Ray& rest(int i) const { return batch.rest[slots[i]]; }
  EMBRUN_FN int& nearest(int i) { return batch.nearest[slots[i]]; }
};

/// Stage: the nearest crossing of each listed path.
template <class Intersector, class Batch>
EMBRUN_LOCAL_FN void intersect_stage(const Intersector& intersector, Batch& batch, const std::uint16_t* slots,
                                     int count, bool timed, RayCounter& counter) {
  if (count == 0) return;
  const RayTimer timer(timed);
  PathQueries<Batch> queries{batch, slots, count};
  intersector.intersect_all(queries);
  counter.rays += static_cast<std::uint64_t>(count);
  timer.stop(counter, static_cast<std::uint64_t>(count));
}

/// Puts the active paths that are in air before those that are not; returns how many are.
template <class Batch>
EMBRUN_LOCAL_FN int order_by_side(Batch& batch, int count) {
  int outside = 0, inside = count;
  for (int i = 0; i < count; ++i) {
    const std::uint16_t slot = batch.active[i];
    if (batch.paths[slot].media.counts == 0)
      batch.ordered[outside++] = slot;
    else
      batch.ordered[--inside] = slot;
  }
  return outside;
}

/// Stage: the shadow rays.
template <class Intersector, class Batch>
EMBRUN_LOCAL_FN void shadow_stage(const PathScene& scene, const Intersector& intersector, Batch& batch, int count,
                                  bool timed, PathCounters& counters) {
  if (count == 0) return;
  const RayTimer timer(timed);
  const std::uint64_t before = counters.shadow.rays;
  for (int i = 0; i < count; ++i) {
    const int slot = batch.lit[i];
    add_scattered_light(scene, batch.paths[slot], trace_shadow_ray(scene, intersector, batch.shadows[slot], counters));
  }
  timer.stop(counters.shadow, counters.shadow.rays - before);
}

/// The listed paths' flights, as next_collisions wants them.
template <class Batch>
struct PathFlights {
  const PathScene& scene;
  Batch& batch;
  int number;

  EMBRUN_FN int count() const { return number; }
  EMBRUN_FN const FlightQuery& query(int i) const { return batch.flights[batch.flying[i]].query; }
  EMBRUN_FN void settle(int i, const Flight& met) {
    const std::uint16_t slot = batch.flying[i];
    batch.collided[slot] = end_flight(scene, batch.paths[slot], batch.flights[slot], met, batch.collisions[slot]);
  }
};

/// Stage: the flights through media to what the rays met, and what lamps light on their way.
template <class Intersector, class Batch>
EMBRUN_LOCAL_FN void flight_stage(const PathScene& scene, const Intersector& intersector, Batch& batch, int count,
                                  bool timed, PathCounters& counters) {
  PathFlights<Batch> flights{scene, batch, 0};
  int lit = 0;
  for (int i = 0; i < count; ++i) {
    const std::uint16_t slot = batch.active[i];
    batch.collided[slot] = false;
    PathFlight& flight = batch.flights[slot];
    if (!begin_flight_to_boundary(scene, batch.paths[slot], batch.found[slot], batch.hits[slot], flight, counters))
      continue;
    batch.flying[flights.number++] = slot;
    if (sample_on_the_way(scene, batch.paths[slot], flight, batch.shadows[slot], counters)) batch.lit[lit++] = slot;
  }
  shadow_stage(scene, intersector, batch, lit, timed, counters);
  next_collisions(scene.density, scene.settings.flights, flights, counters.majorants);
}

/// The path tracer's own way to scatter, for shade_stage.
struct ScatterPath {
  EMBRUN_FN static bool scatter(const PathScene& scene, PathState& path, const SceneHit& hit, const MediaState& behind,
                                ShadowRay& shadow, PathCounters& counters) {
    return scatter_path(scene, path, hit, behind, shadow, counters);
  }
};

/// Stages: advance and scatter, by ScatterPath or another integrator's way. Lists the shadow rays to trace; returns how many.
template <class Scatter, class Intersector, class Batch>
EMBRUN_LOCAL_FN int shade_stage(const PathScene& scene, const Intersector& intersector, Batch& batch, int count,
                                PathCounters& counters) {
  int lit = 0;
  for (int i = 0; i < count; ++i) {
    const std::uint16_t slot = batch.active[i];
    PathState& path = batch.paths[slot];
    const SceneHit& hit = batch.hits[slot];
    MediaState& behind = batch.behind[slot];
    if (batch.collided[slot]) {
      if (scatter_in_medium(scene, path, batch.collisions[slot], batch.shadows[slot], counters))
        batch.lit[lit++] = slot;
      continue;
    }
    if (advance_path(scene, intersector, path, batch.found[slot], hit, behind, counters) != Advance::scatters) continue;
    if (Scatter::scatter(scene, path, hit, behind, batch.shadows[slot], counters)) batch.lit[lit++] = slot;
  }
  return lit;
}

/// The stages between two crossings of the path tracer, or of an integrator that differs from it in how surfaces scatter.
template <class Scatter>
struct ScatteringStages {
  template <class Intersector, class Batch>
  EMBRUN_FN static void take(const PathScene& scene, const Intersector& intersector, Batch& batch, int count,
                             bool timed, PathCounters& counters) {
    flight_stage(scene, intersector, batch, count, timed, counters);
    const int lit = shade_stage<Scatter>(scene, intersector, batch, count, counters);
    shadow_stage(scene, intersector, batch, lit, timed, counters);
  }
};

using PathStages = ScatteringStages<ScatterPath>;

/// What trace_batch tells of its paths: nothing.
struct NoListener {
  template <class Batch>
  EMBRUN_FN void after_events(const Batch&, const std::uint16_t*, int) {}
};

/// Takes the paths in slots 0 to count - 1 to their ends, all of them a stage at a time. The listener hears of every
/// round of events, once their light samples are in the paths' radiance. Stages: PathStages, or another integrator's.
template <class Stages, class Intersector, class Batch, class Listener>
EMBRUN_LOCAL_FN void trace_batch(const PathScene& scene, const Intersector& intersector, Batch& batch, int count,
                                 bool timed, Listener& listener, PathCounters& counters) {
  for (int i = 0; i < count; ++i) batch.active[i] = static_cast<std::uint16_t>(i);
  counters.paths += static_cast<std::uint64_t>(count);
  intersect_stage(intersector, batch, batch.active, count, timed, counters.camera);
  while (count > 0) {
    Stages::take(scene, intersector, batch, count, timed, counters);
    listener.after_events(batch, batch.active, count);

    int alive = 0;
    for (int i = 0; i < count; ++i)
      if (batch.paths[batch.active[i]].alive) batch.active[alive++] = batch.active[i];
    count = alive;

    const int outside = order_by_side(batch, count);
    intersect_stage(intersector, batch, batch.ordered, outside, timed, counters.outside);
    intersect_stage(intersector, batch, batch.ordered + outside, count - outside, timed, counters.inside);
  }
}

/// KernelTable::trace_samples by the integrator whose stages are given.
template <class Stages, class Intersector>
EMBRUN_LOCAL_FN void trace_samples(const PathScene& scene, const Intersector& intersector, const PixelSample* samples,
                                   int count, FilmSample* results, bool timed, PathBatch& batch,
                                   PathCounters& counters) {
  for (int i = 0; i < count; ++i) batch.paths[i] = generate_path(scene, samples[i].x, samples[i].y, samples[i].sample);
  NoListener nobody;
  trace_batch<Stages>(scene, intersector, batch, count, timed, nobody, counters);
  for (int i = 0; i < count; ++i) results[i] = film_sample(batch.paths[i]);
}

}  // namespace embrun

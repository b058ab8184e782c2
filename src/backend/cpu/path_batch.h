#pragma once

#include <time.h>

#include "image/film.h"
#include "integrators/path_stages.h"

namespace embrun {

/// Paths under way together, and what the stages hand each other. Indices are slots of the arrays.
template <int Size>
struct BasicPathBatch {
  PathState paths[Size];
  SceneHit hits[Size];
  bool found[Size];
  MediaState behind[Size];
  ShadowRay shadows[Size];
  std::uint16_t active[Size];  ///< slots of the paths that go on
  std::uint16_t ordered[Size]; ///< the same, those in air first
  std::uint16_t lit[Size];     ///< slots whose shadow ray is to be traced
};

EMBRUN_FN std::uint64_t clock_ns() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1000000000u + static_cast<std::uint64_t>(now.tv_nsec);
}

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

/// Stage: the nearest crossing of each listed path. Returns the time it took.
template <class Intersector, class Batch>
EMBRUN_LOCAL_FN std::uint64_t intersect_stage(const Intersector& intersector, Batch& batch, const std::uint16_t* slots,
                                              int count) {
  if (count == 0) return 0;
  const std::uint64_t start = clock_ns();
  for (int i = 0; i < count; ++i) {
    const int slot = slots[i];
    batch.found[slot] = intersector.intersect(batch.paths[slot].ray, batch.paths[slot].media, batch.hits[slot]);
  }
  return clock_ns() - start;
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

/// Stages: advance and scatter. Lists the shadow rays to trace; returns how many.
template <class Intersector, class Batch>
EMBRUN_LOCAL_FN int shade_stage(const PathScene& scene, const Intersector& intersector, Batch& batch, int count,
                                PathCounters& counters) {
  int lit = 0;
  for (int i = 0; i < count; ++i) {
    const std::uint16_t slot = batch.active[i];
    PathState& path = batch.paths[slot];
    const SceneHit& hit = batch.hits[slot];
    MediaState& behind = batch.behind[slot];
    if (advance_path(scene, intersector, path, batch.found[slot], hit, behind, counters) != Advance::scatters) continue;
    if (scatter_path(scene, path, hit, behind, batch.shadows[slot], counters)) batch.lit[lit++] = slot;
  }
  return lit;
}

/// Stage: the shadow rays.
template <class Intersector, class Batch>
EMBRUN_LOCAL_FN void shadow_stage(const PathScene& scene, const Intersector& intersector, Batch& batch, int count,
                                  PathCounters& counters) {
  if (count == 0) return;
  const std::uint64_t start = clock_ns();
  for (int i = 0; i < count; ++i) {
    const int slot = batch.lit[i];
    batch.paths[slot].radiance += trace_shadow_ray(scene, intersector, batch.shadows[slot], counters);
  }
  counters.shadow_ns += clock_ns() - start;
}

/// Takes the paths in slots 0 to count - 1 to their ends, all of them a stage at a time.
template <class Intersector, class Batch>
EMBRUN_LOCAL_FN void trace_batch(const PathScene& scene, const Intersector& intersector, Batch& batch, int count,
                                 PathCounters& counters) {
  for (int i = 0; i < count; ++i) batch.active[i] = static_cast<std::uint16_t>(i);
  counters.paths += static_cast<std::uint64_t>(count);
  counters.camera_rays += static_cast<std::uint64_t>(count);
  counters.camera_ns += intersect_stage(intersector, batch, batch.active, count);
  while (count > 0) {
    const int lit = shade_stage(scene, intersector, batch, count, counters);
    shadow_stage(scene, intersector, batch, lit, counters);

    int alive = 0;
    for (int i = 0; i < count; ++i)
      if (batch.paths[batch.active[i]].alive) batch.active[alive++] = batch.active[i];
    count = alive;

    const int outside = order_by_side(batch, count);
    counters.outside_rays += static_cast<std::uint64_t>(outside);
    counters.inside_rays += static_cast<std::uint64_t>(count - outside);
    counters.outside_ns += intersect_stage(intersector, batch, batch.ordered, outside);
    counters.inside_ns += intersect_stage(intersector, batch, batch.ordered + outside, count - outside);
  }
}

}  // namespace embrun

// The per-ray code, compiled once per instruction set: EMBRUN_ISA_NAMESPACE says for which. Nothing in here may have
// linkage outside that namespace, or the linker could give one set's code to another: functions of the shared headers
// are EMBRUN_FN or EMBRUN_LOCAL_FN, and the standard library's are not used.

#include "backend/cpu/integrator_kernels.h"
#include "backend/cpu/kernel_table.h"
#include "backend/cpu/path_batch.h"
#include "backend/cpu/scene_intersector.h"
#include "backend/cpu/splat_kernels.h"

namespace embrun {

namespace EMBRUN_ISA_NAMESPACE {
namespace {

void trace_paths(const PathScene& scene, const CpuSceneView& view, const PixelSample* samples, int count,
                 FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters) {
  trace_samples<PathStages>(scene, CpuIntersector{view}, samples, count, results, timed, batch, counters);
}

/// Notes the direction in which each path leaves its first diffuse surface.
struct FirstDirections {
  GuideLesson* lessons;
  float throughput[batch_size] = {}, radiance_before[batch_size] = {};

  EMBRUN_FN void after_events(const PathBatch& batch, const std::uint16_t* slots, int count) {
    for (int i = 0; i < count; ++i) {
      const std::uint16_t slot = slots[i];
      const PathState& path = batch.paths[slot];
      if (!path.alive || path.scatter_pdf == 0.0f || path.left_medium || throughput[slot] != 0.0f) continue;
      lessons[slot].direction = path.ray.direction;
      lessons[slot].in_body = path.media.counts != 0;
      throughput[slot] = luminance(path.throughput);
      radiance_before[slot] = luminance(path.radiance);
    }
  }
};

void learn_directions(const PathScene& scene, const CpuSceneView& view, const PixelSample* samples, int count,
                      GuideLesson* lessons, PathBatch& batch) {
  const CpuIntersector intersector{view};
  for (int i = 0; i < count; ++i) batch.paths[i] = generate_path(scene, samples[i].x, samples[i].y, samples[i].sample);
  FirstDirections first{lessons};
  PathCounters counters;
  trace_batch<PathStages>(scene, intersector, batch, count, false, first, counters);
  for (int i = 0; i < count; ++i) {
    const float gained = luminance(batch.paths[i].radiance) - first.radiance_before[i];
    lessons[i].light = first.throughput[i] > 0.0f ? gained / first.throughput[i] : -1.0f;
  }
}

MediaState media_at(const CpuSceneView& view, Vec3 point, float detail) {
  return CpuIntersector{view}.media_at(point, detail);
}

void intersect(const CpuSceneView& view, const Ray* rays, const MediaState* media, int count, bool* found,
               SceneHit* hits) {
  const CpuIntersector intersector{view};
  for (int i = 0; i < count; ++i) found[i] = intersector.intersect(rays[i], media[i], hits[i]);
}

struct RaySpan {
  const SidedRay* rays;
  int number;
  SurfaceHit* hits;
  bool* found;

  EMBRUN_FN int count() const { return number; }
  EMBRUN_FN const Ray& ray(int i) const { return rays[i].ray; }
  EMBRUN_FN Side side(int i) const { return rays[i].side; }
  EMBRUN_FN SurfaceHit& hit(int i) { return hits[i]; }
  EMBRUN_FN void settle(int i, bool any) { found[i] = any; }
};

void trace_surface(const ImplicitSurfaceView& view, const SidedRay* rays, int count, SurfaceHit* hits, bool* found) {
  RaySpan span{rays, count, hits, found};
  intersect_implicit_surface_batch(view, span);
}

struct FlightSpan {
  const FlightQuery* queries;
  int number;
  float* distances;

  EMBRUN_FN int count() const { return number; }
  EMBRUN_FN FlightQuery query(int i) const { return queries[i]; }
  EMBRUN_FN void settle(int i, const Flight& flight) { distances[i] = flight.collided ? flight.t : infinity; }
};

void fly(const ParticleDensityView& view, const FlightQuery* queries, int count, float* distances) {
  FlightSpan span{queries, count, distances};
  std::uint64_t exceeded = 0;
  next_collisions(view, FlightSampler::tracking, span, exceeded);
}

void fly_grid(const GridMedium& medium, const FlightQuery* queries, int count, float* distances) {
  std::uint64_t exceeded = 0;
  for (int i = 0; i < count; ++i) {
    RandomStream random = queries[i].random;
    const Flight flight =
        track_grid_flight(medium, queries[i].ray, queries[i].channel, flight_depth(queries[i].u), random, exceeded);
    distances[i] = flight.collided ? flight.t : infinity;
  }
}

}  // namespace

#define EMBRUN_STRING_OF(x) #x
#define EMBRUN_STRING(x) EMBRUN_STRING_OF(x)

extern const KernelTable kernel_table;
const KernelTable kernel_table = {EMBRUN_STRING(EMBRUN_ISA_NAMESPACE),
                                  sizeof(PathBatch),
                                  {trace_paths, trace_whitted, trace_occlusion, trace_gauss},
                                  learn_directions,
                                  media_at,
                                  intersect,
                                  trace_surface,
                                  trace_splats,
                                  fly,
                                  fly_grid,
                                  meet_block};

}  // namespace EMBRUN_ISA_NAMESPACE
}  // namespace embrun

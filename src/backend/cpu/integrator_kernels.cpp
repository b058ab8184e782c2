#include "backend/cpu/integrator_kernels.h"

#include "backend/cpu/path_batch.h"
#include "backend/cpu/scene_intersector.h"
#include "integrators/ambient_occlusion.h"
#include "integrators/gauss.h"
#include "integrators/whitted.h"

namespace embrun::EMBRUN_ISA_NAMESPACE {
namespace {

/// Whitted's stages between two crossings: the events, for each light the shadow rays, and the way on.
struct WhittedStages {
  EMBRUN_FN static void take(const PathScene& scene, const CpuIntersector& intersector, PathBatch& batch, int count,
                             bool timed, PathCounters& counters) {
    flight_stage(scene, intersector, batch, count, timed, counters);
    const int met = meet_stage(scene, intersector, batch, count, counters);
    for (int light = 0; light < scene.lights.count; ++light)
      shadow_stage(scene, intersector, batch, light_stage(scene, batch, met, light), timed, counters);
    for (int i = 0; i < met; ++i) {
      const std::uint16_t slot = batch.met[i];
      PathState& path = batch.paths[slot];
      if (batch.collided[slot])
        path.alive = false;
      else
        follow_mirror(scene, path, batch.hits[slot], batch.events[slot], batch.behind[slot], counters);
    }
  }

 private:
  /// Lists the paths that come to an event; returns how many.
  EMBRUN_FN static int meet_stage(const PathScene& scene, const CpuIntersector& intersector, PathBatch& batch,
                                  int count, PathCounters& counters) {
    int met = 0;
    for (int i = 0; i < count; ++i) {
      const std::uint16_t slot = batch.active[i];
      PathState& path = batch.paths[slot];
      const SceneHit& hit = batch.hits[slot];
      MediaState& behind = batch.behind[slot];
      if (batch.collided[slot]) {
        if (meet_collision(scene, path, batch.collisions[slot], counters)) batch.met[met++] = slot;
      } else if (advance_path(scene, intersector, path, batch.found[slot], hit, behind, counters) ==
                 Advance::scatters) {
        batch.events[slot] = meet_surface(scene, path, hit, behind);
        batch.met[met++] = slot;
      }
    }
    return met;
  }

  /// Lists the shadow rays of the events to one light; returns how many.
  EMBRUN_FN static int light_stage(const PathScene& scene, PathBatch& batch, int met, int light) {
    int lit = 0;
    for (int i = 0; i < met; ++i) {
      const std::uint16_t slot = batch.met[i];
      const PathState& path = batch.paths[slot];
      ShadowRay& shadow = batch.shadows[slot];
      if (batch.collided[slot]) {
        const MediumCollision& collision = batch.collisions[slot];
        const LightSample sample = draw_light_of(scene, path, light, path.ray.at(collision.t));
        if (light_collision(scene, path, collision, sample, true, shadow)) batch.lit[lit++] = slot;
      } else if (!batch.events[slot].specular) {
        const SceneHit& hit = batch.hits[slot];
        const SurfaceEvent& event = batch.events[slot];
        const LightSample sample = draw_light_of(scene, path, light, leave_surface(hit, event.wo));
        if (light_surface(scene, path, hit, event, batch.behind[slot], sample, true, shadow)) batch.lit[lit++] = slot;
      }
    }
    return lit;
  }
};

/// The stages of ambient occlusion between two crossings.
struct OcclusionStages {
  EMBRUN_FN static void take(const PathScene& scene, const CpuIntersector& intersector, PathBatch& batch, int count,
                             bool timed, PathCounters& counters) {
    int started = 0;
    for (int i = 0; i < count; ++i) {
      const std::uint16_t slot = batch.active[i];
      PathState& path = batch.paths[slot];
      const SceneHit& hit = batch.hits[slot];
      MediaState& behind = batch.behind[slot];
      if (advance_unlit(scene, intersector, path, batch.found[slot], hit, behind, counters) == Advance::scatters &&
          start_occlusion_ray(scene, path, hit, behind, batch.shadows[slot], counters))
        batch.lit[started++] = slot;
    }
    if (started == 0) return;
    const RayTimer timer(timed);
    const std::uint64_t before = counters.shadow.rays;
    for (int i = 0; i < started; ++i) {
      const int slot = batch.lit[i];
      batch.paths[slot].radiance += trace_occlusion_ray(scene, intersector, batch.shadows[slot], counters);
    }
    timer.stop(counters.shadow, counters.shadow.rays - before);
  }
};

/// Gauss's quadrature scatters by its rule; all its stages are the path tracer's else.
struct ScatterByRule {
  EMBRUN_FN static bool scatter(const PathScene& scene, PathState& path, const SceneHit& hit, const MediaState& behind,
                                ShadowRay& shadow, PathCounters& counters) {
    return scatter_by_rule(scene, path, hit, behind, shadow, counters);
  }
};

}  // namespace

void trace_whitted(const PathScene& scene, const CpuSceneView& view, const PixelSample* samples, int count,
                   FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters) {
  trace_samples<WhittedStages>(scene, CpuIntersector{view}, samples, count, results, timed, batch, counters);
}

void trace_occlusion(const PathScene& scene, const CpuSceneView& view, const PixelSample* samples, int count,
                     FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters) {
  trace_samples<OcclusionStages>(scene, CpuIntersector{view}, samples, count, results, timed, batch, counters);
}

void trace_gauss(const PathScene& scene, const CpuSceneView& view, const PixelSample* samples, int count,
                 FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters) {
  trace_samples<ScatteringStages<ScatterByRule>>(scene, CpuIntersector{view}, samples, count, results, timed, batch,
                                                 counters);
}

}  // namespace embrun::EMBRUN_ISA_NAMESPACE

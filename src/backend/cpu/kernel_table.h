#pragma once

#include <cstdint>

#include "backend/cpu/cpu_scene.h"
#include "backend/cpu/splat_trial.h"
#include "base/instruction_set.h"
#include "geometry/implicit_surface.h"
#include "geometry/sided_ray.h"
#include "image/film.h"
#include "integrators/path_scene.h"
#include "integrators/path_state.h"
#include "integrators/scene_hit.h"
#include "media/flight_batch.h"
#include "media/grid_medium.h"

struct RTCIntersectFunctionNArguments;

namespace embrun {

/// Names one sample of a picture.
struct PixelSample {
  int x = 0, y = 0;  ///< of the full frame
  std::uint32_t sample = 0;
};

/// What a path found of light at the first diffuse surface it came to.
struct GuideLesson {
  Vec3 direction;  ///< unit, the one it went on in
  /// Luminance that came from there, as far as no light sample had found it; negative: there was no such surface.
  float light = -1;
  bool in_body = false;
};

/// Paths that a task follows at a time.
inline constexpr int batch_size = 128;

/// Working memory of one task: allocated once per thread, see make_path_batch().
struct PathBatch;

/// The per-ray code, compiled for one instruction set.
struct KernelTable {
  const char* name;
  std::size_t batch_bytes;  ///< size of a PathBatch

  /// Follows `count` (at most batch_size) samples to their ends; `timed`: measures how long their rays take.
  /// One for each IntegratorKind, in its order.
  void (*trace_samples[integrator_kinds])(const PathScene&, const CpuSceneView&, const PixelSample* samples, int count,
                                          FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters);
  /// Follows paths likewise, for what they find: one lesson each.
  void (*learn_directions)(const PathScene&, const CpuSceneView&, const PixelSample* samples, int count,
                           GuideLesson* lessons, PathBatch& batch);
  /// Which bodies hold a point, for rays of that Ray::detail.
  MediaState (*media_at)(const CpuSceneView&, Vec3 point, float detail);
  /// The path tracer's intersections alone, one ray after the other; media[i] is what ray i starts in.
  void (*intersect)(const CpuSceneView&, const Ray* rays, const MediaState* media, int count, bool* found,
                    SceneHit* hits);
  /// One surface alone, many rays at once: what it costs, without a scene round it.
  void (*trace_surface)(const ImplicitSurfaceView&, const SidedRay* rays, int count, SurfaceHit* hits, bool* found);
  /// One cloud of splats alone, by any search.
  void (*trace_splats)(const SplatTrial&, SplatSearchChoice, const Ray* rays, int count, SurfaceHit* hits, bool* found);
  /// Flights alone, drawn as in a render: how far each goes, infinite where it does not collide. Through particles, and
  /// through a grid.
  void (*fly)(const ParticleDensityView&, const FlightQuery* queries, int count, float* distances);
  void (*fly_grid)(const GridMedium&, const FlightQuery* queries, int count, float* distances);
  /// Embree's call for a block of balls.
  void (*meet_balls)(const RTCIntersectFunctionNArguments* arguments);
};

/// The kernels for base/instruction_set.h's choice. A build with EMBRUN_NATIVE has one version only.
const KernelTable& select_kernels();

/// The kernels of one instruction set, which this machine must have.
const KernelTable& kernels_of(InstructionSet set);

}  // namespace embrun

#pragma once

#include <cstdint>

#include "backend/cpu/cpu_scene.h"
#include "image/film.h"
#include "integrators/path_scene.h"
#include "integrators/path_state.h"
#include "integrators/scene_hit.h"

namespace embrun {

/// Names one sample of a picture.
struct PixelSample {
  int x = 0, y = 0;  ///< of the full frame
  std::uint32_t sample = 0;
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
  void (*trace_samples)(const PathScene&, const CpuSceneView&, const PixelSample* samples, int count,
                        FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters);
  /// Which bodies hold a point.
  MediaState (*media_at)(const CpuSceneView&, Vec3 point);
  /// The path tracer's intersections alone, one ray after the other; media[i] is what ray i starts in.
  void (*intersect)(const CpuSceneView&, const Ray* rays, const MediaState* media, int count, bool* found,
                    SceneHit* hits);
};

/// The instruction sets there are kernels for, weakest first.
enum class Isa : std::uint8_t { sse4, avx2, avx512 };

/// The name that EMBRUN_ISA takes: "sse4" (x86-64-v2), "avx2" (v3), "avx512" (v4); with EMBRUN_NATIVE "native".
const char* name_of(Isa isa);

/// Whether this build has kernels for the set and this processor runs them.
bool is_available(Isa isa);

/// The kernels of the instruction set that the environment variable EMBRUN_ISA names, or else of the best that this
/// processor has. Throws Error for a name that is unknown or a set that is not available.
const KernelTable& select_kernels();

/// The kernels of one instruction set, which must be available.
const KernelTable& kernels_of(Isa isa);

}  // namespace embrun

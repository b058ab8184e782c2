// The per-ray code, compiled once per instruction set: EMBRUN_ISA_NAMESPACE says for which. Nothing in here may have
// linkage outside that namespace, or the linker could give one set's code to another: functions of the shared headers
// are EMBRUN_FN or EMBRUN_LOCAL_FN, and the standard library's are not used.

#include "backend/cpu/kernel_table.h"
#include "backend/cpu/path_batch.h"
#include "backend/cpu/scene_intersector.h"

namespace embrun {

struct PathBatch : BasicPathBatch<batch_size> {};

namespace EMBRUN_ISA_NAMESPACE {
namespace {

void trace_samples(const PathScene& scene, const CpuSceneView& view, const PixelSample* samples, int count,
                   FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters) {
  const CpuIntersector intersector{view};
  for (int i = 0; i < count; ++i) batch.paths[i] = generate_path(scene, samples[i].x, samples[i].y, samples[i].sample);
  trace_batch(scene, intersector, batch, count, timed, counters);
  for (int i = 0; i < count; ++i) results[i] = film_sample(batch.paths[i]);
}

MediaState media_at(const CpuSceneView& view, Vec3 point) { return CpuIntersector{view}.media_at(point); }

void intersect(const CpuSceneView& view, const Ray* rays, const MediaState* media, int count, bool* found,
               SceneHit* hits) {
  const CpuIntersector intersector{view};
  for (int i = 0; i < count; ++i) found[i] = intersector.intersect(rays[i], media[i], hits[i]);
}

}  // namespace

#define EMBRUN_STRING_OF(x) #x
#define EMBRUN_STRING(x) EMBRUN_STRING_OF(x)

extern const KernelTable kernel_table;
const KernelTable kernel_table = {EMBRUN_STRING(EMBRUN_ISA_NAMESPACE), sizeof(PathBatch), trace_samples, media_at,
                                  intersect};

}  // namespace EMBRUN_ISA_NAMESPACE
}  // namespace embrun

// The fast tracer for one instruction set: compiled once for each, with EMBRUN_TRACE_FUNCTION its name and
// EMBRUN_TRACE_BATCH_FUNCTION that of its batch form.

#include "geometry/implicit_surface_batch.h"
#include "geometry/sided_ray.h"

namespace embrun::test {

using TestRay = SidedRay;

namespace {

struct RaySpan {
  const TestRay* rays;
  int number;
  SurfaceHit* hits;
  bool* found;

  int count() const { return number; }
  const Ray& ray(int i) const { return rays[i].ray; }
  Side side(int i) const { return rays[i].side; }
  SurfaceHit& hit(int i) { return hits[i]; }
  void settle(int i, bool any) { found[i] = any; }
};

}  // namespace

bool EMBRUN_TRACE_FUNCTION(const ImplicitSurfaceView& view, const Ray& ray, Side side, SurfaceHit& hit);
bool EMBRUN_TRACE_FUNCTION(const ImplicitSurfaceView& view, const Ray& ray, Side side, SurfaceHit& hit) {
  return intersect_implicit_surface(view, ray, side, hit);
}

void EMBRUN_TRACE_BATCH_FUNCTION(const ImplicitSurfaceView& view, const TestRay* rays, int count, SurfaceHit* hits,
                                 bool* found);
void EMBRUN_TRACE_BATCH_FUNCTION(const ImplicitSurfaceView& view, const TestRay* rays, int count, SurfaceHit* hits,
                                 bool* found) {
  RaySpan span{rays, count, hits, found};
  intersect_implicit_surface_batch(view, span);
}

}  // namespace embrun::test

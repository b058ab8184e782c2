// The fast tracer for one instruction set: compiled once for each, with EMBRUN_TRACE_FUNCTION its name.

#include "geometry/implicit_surface_trace.h"

namespace embrun::test {

bool EMBRUN_TRACE_FUNCTION(const ImplicitSurfaceView& view, const Ray& ray, Side side, SurfaceHit& hit);
bool EMBRUN_TRACE_FUNCTION(const ImplicitSurfaceView& view, const Ray& ray, Side side, SurfaceHit& hit) {
  return intersect_implicit_surface(view, ray, side, hit);
}

}  // namespace embrun::test

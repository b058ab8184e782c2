#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "geometry/implicit_surface.h"
#include "geometry/surface_hit.h"
#include "measure/ray_recorder.h"

namespace embrun::test {

using namespace measure;  // the oracle and the recorder

/// A surface tracer and what it owns.
struct Tracer {
  std::shared_ptr<const void> owned;
  Intersector intersect;
};

/// `method`: "fast" or "thesis"; `isa`: of the fast one, "baseline", "avx2", "avx512", or empty for the best there is.
/// Throws Error for what this machine lacks.
Tracer make_tracer(const std::string& method, const std::string& isa, std::span<const Vec3> positions,
                   std::span<const float> radii, const SurfaceSettings& settings);

/// The fast tracer on every instruction set that this machine has, worst first, over one surface.
std::vector<Tracer> make_fast_tracers(std::span<const Vec3> positions, std::span<const float> radii,
                                      const SurfaceSettings& settings);

/// The instruction sets up to the one that base/instruction_set.h chooses, worst first.
std::vector<std::string> available_isas();

using TraceFunction = bool (*)(const ImplicitSurfaceView&, const Ray&, Side, SurfaceHit&);
/// The fast tracer compiled for that instruction set.
TraceFunction trace_function(const std::string& isa);

using TraceBatchFunction = void (*)(const ImplicitSurfaceView&, const TestRay* rays, int count, SurfaceHit* hits,
                                    bool* found);
/// The same for many rays at once.
TraceBatchFunction trace_batch_function(const std::string& isa);

}  // namespace embrun::test

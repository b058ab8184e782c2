#include "geometry/tracers.h"

#include "base/error.h"
#include "base/instruction_set.h"
#include "geometry/thesis_tracer.h"

namespace embrun::test {

bool trace_baseline(const ImplicitSurfaceView&, const Ray&, Side, SurfaceHit&);
bool trace_avx2(const ImplicitSurfaceView&, const Ray&, Side, SurfaceHit&);
bool trace_avx512(const ImplicitSurfaceView&, const Ray&, Side, SurfaceHit&);

void trace_batch_baseline(const ImplicitSurfaceView&, const TestRay*, int, SurfaceHit*, bool*);
void trace_batch_avx2(const ImplicitSurfaceView&, const TestRay*, int, SurfaceHit*, bool*);
void trace_batch_avx512(const ImplicitSurfaceView&, const TestRay*, int, SurfaceHit*, bool*);

std::vector<std::string> available_isas() {
  std::vector<std::string> isas;
  for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (set <= instruction_set()) isas.emplace_back(name_of(set));
  }
  return isas;
}

namespace {

void require(const std::string& isa) {
  for (const std::string& available : available_isas()) {
    if (available == isa) return;
  }
  throw Error("instruction set " + isa + " is not there");
}

}  // namespace

TraceFunction trace_function(const std::string& isa) {
  require(isa);
  return isa == "baseline" ? trace_baseline : isa == "avx2" ? trace_avx2 : trace_avx512;
}

TraceBatchFunction trace_batch_function(const std::string& isa) {
  require(isa);
  return isa == "baseline" ? trace_batch_baseline : isa == "avx2" ? trace_batch_avx2 : trace_batch_avx512;
}

namespace {

Tracer fast_tracer(const std::shared_ptr<ImplicitSurface>& surface, const std::string& isa) {
  const TraceFunction trace = trace_function(isa);
  const ImplicitSurfaceView& view = surface->view();
  return {surface, [&view, trace](const Ray& ray, Side side, SurfaceHit& hit) { return trace(view, ray, side, hit); }};
}

}  // namespace

Tracer make_tracer(const std::string& method, const std::string& isa, std::span<const Vec3> positions,
                   std::span<const float> radii, const SurfaceSettings& settings) {
  if (method == "thesis") {
    auto surface = std::make_shared<ThesisSurface>(positions, radii, settings);
    const ThesisSurface& s = *surface;
    return {surface, [&s](const Ray& ray, Side side, SurfaceHit& hit) { return s.intersect(ray, side, hit); }};
  }
  if (method != "fast") throw Error("method " + method + " is not fast or thesis");
  auto surface = std::make_shared<ImplicitSurface>(build_implicit_surface(positions, radii, settings));
  return fast_tracer(surface, isa.empty() ? available_isas().back() : isa);
}

std::vector<Tracer> make_fast_tracers(std::span<const Vec3> positions, std::span<const float> radii,
                                      const SurfaceSettings& settings) {
  auto surface = std::make_shared<ImplicitSurface>(build_implicit_surface(positions, radii, settings));
  std::vector<Tracer> tracers;
  for (const std::string& isa : available_isas()) tracers.push_back(fast_tracer(surface, isa));
  return tracers;
}

}  // namespace embrun::test

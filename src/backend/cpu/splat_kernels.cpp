#include "backend/cpu/splat_kernels.h"

#include "backend/cpu/embree_ray.h"

namespace embrun::EMBRUN_ISA_NAMESPACE {
namespace {

/// Embree's oriented discs as a search for intersect_splats(). Embree does not let a query end earlier than it was told to
/// at first, so a query for the nearest disc may come before the one that gathers.
template <bool nearest_first>
struct EmbreeDiscSearch {
  const PackedSplats& packed;
  RTCSceneTy* scene;

  template <class Query>
  struct Context {
    RTCIntersectContext embree;
    Query* query;
    const PackedSplats* packed;
  };

  template <class Query>
  void operator()(Query& query) const {
    Context<Query> context;
    rtcInitIntersectContext(&context.embree);
    context.query = &query;
    context.packed = &packed;
    const float near = max_of(query.near(), 0.0f);
    if constexpr (nearest_first) {
      RTCRayHit first = embree_ray(query.ray(), near, query.limit());
      rtcIntersect1(scene, &context.embree, &first);
      if (first.hit.geomID == RTC_INVALID_GEOMETRY_ID) return;
      query.consider(packed.splats[first.hit.primID], packed.numbers[first.hit.primID]);
    }
    context.embree.filter = [](const RTCFilterFunctionNArguments* arguments) {
      const auto& own = *reinterpret_cast<const Context<Query>*>(arguments->context);
      const std::uint32_t disc = reinterpret_cast<const RTCHit*>(arguments->hit)->primID;
      own.query->consider(own.packed->splats[disc], own.packed->numbers[disc]);
      arguments->valid[0] = 0;
    };
    RTCRayHit all = embree_ray(query.ray(), near, query.limit());
    rtcIntersect1(scene, &context.embree, &all);
  }
};

template <class Search>
void trace_by(const SplatTrial& trial, const Search& search, const Ray* rays, int count, SurfaceHit* hits,
              bool* found) {
  for (int i = 0; i < count; ++i)
    found[i] = intersect_splats(trial.set, search, rays[i], false, {}, hits[i], trial.rules);
}

template <bool spheres, bool early_outs>
void trace_by_scan(const SplatTrial& trial, bool grid, const Ray* rays, int count, SurfaceHit* hits, bool* found) {
  using Scan = SplatScan<spheres, early_outs>;
  if (grid)
    trace_by(trial, SplatGridWalk<Scan>{*trial.grid, *trial.packed}, rays, count, hits, found);
  else
    trace_by(trial, SplatLoop<Scan>{*trial.packed}, rays, count, hits, found);
}

}  // namespace

void trace_splats(const SplatTrial& trial, SplatSearchChoice choice, const Ray* rays, int count, SurfaceHit* hits,
                  bool* found) {
  switch (choice.kind) {
    case SplatSearchKind::tree: trace_by(trial, trial.tree, rays, count, hits, found); return;
    case SplatSearchKind::blocks: trace_by(trial, SplatBlockLoop{*trial.packed}, rays, count, hits, found); return;
    case SplatSearchKind::embree:
      trace_by(trial, EmbreeDiscSearch<false>{*trial.packed, trial.discs}, rays, count, hits, found);
      return;
    case SplatSearchKind::embree_nearest:
      trace_by(trial, EmbreeDiscSearch<true>{*trial.packed, trial.discs}, rays, count, hits, found);
      return;
    case SplatSearchKind::thesis: break;
  }
  if (choice.spheres && choice.early_outs) trace_by_scan<true, true>(trial, choice.grid, rays, count, hits, found);
  if (choice.spheres && !choice.early_outs) trace_by_scan<true, false>(trial, choice.grid, rays, count, hits, found);
  if (!choice.spheres && choice.early_outs) trace_by_scan<false, true>(trial, choice.grid, rays, count, hits, found);
  if (!choice.spheres && !choice.early_outs) trace_by_scan<false, false>(trial, choice.grid, rays, count, hits, found);
}

}  // namespace embrun::EMBRUN_ISA_NAMESPACE

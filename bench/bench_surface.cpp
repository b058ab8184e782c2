// Rays against the surface of a dam break: the direct tracer beside Embree on a mesh of the same surface, and beside
// the thesis's method. One thread, one process, interleaved repetitions, medians of CPU time. See README.md.

#include <benchmark/benchmark.h>
#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "backend/cpu/embree_mesh.h"
#include "base/error.h"
#include "geometry/implicit_surface.h"
#include "geometry/surface_model.h"
#include "geometry/thesis_tracer.h"
#include "geometry/tracers.h"
#include "io/read_particles.h"
#include "measure.h"
#include "measure/ray_recorder.h"
#include "meshing/isosurface.h"

namespace {

using namespace embrun;
using namespace embrun::measure;
using namespace embrun::test;
using bench::Collector;
using bench::run_rays;
using bench::verdict;

constexpr float radius = 0.025f;  // the solver's
constexpr double spacing = 0.0465;

/// What is measured of each neighbourhood order.
struct Subject {
  int order = 3;
  std::vector<Vec3> positions;
  SurfaceSettings settings;
  SurfaceModel model;
  ImplicitSurface surface;
  std::unique_ptr<EmbreeMesh> mesh;
  std::unique_ptr<ThesisSurface> thesis;

  struct RaySet {
    std::string name;
    std::vector<TestRay> rays;
    double bar = 0;    ///< least ratio to Embree
    double share = 0;  ///< of all rays of the render
    double direct_hits = 0, embree_hits = 0;
  };
  std::vector<RaySet> sets;
};

/// Rays start on the exact surface; the mesh departs from it by up to some hundredths of R0, so that its rays skip
/// this much of their way instead of meeting what they have just left.
constexpr float embree_start = 0.05f * radius;

IsosurfaceSettings mesh_settings() {
  // As such pipelines do it: vertices by linear interpolation.
  return {.cell = 0.5f * radius, .exact_vertices = false};
}

void shuffle(std::vector<TestRay>& rays) {
  Dice dice(5);
  for (std::size_t i = rays.size(); i > 1; --i) {
    std::swap(rays[i - 1], rays[static_cast<std::size_t>(dice.next() * static_cast<double>(i))]);
  }
}

Subject make_subject(const std::vector<Vec3>& positions, int order, std::size_t ray_count, TraceFunction trace) {
  Subject s;
  s.order = order;
  s.positions = positions;
  s.settings.radius = radius;
  s.settings.spacing = spacing;
  s.settings.order = order;
  s.model = resolve_surface_model(positions, {}, s.settings);
  s.surface = build_implicit_surface(positions, {}, s.settings);
  s.mesh = std::make_unique<EmbreeMesh>(extract_isosurface(positions, {}, s.model, mesh_settings()));
  if (order == 3) s.thesis = std::make_unique<ThesisSurface>(positions, std::span<const float>(), s.settings);

  Box3 box;
  for (const Vec3 p : positions) box.include(p);
  const ImplicitSurfaceView& view = s.surface.view();
  RecordedRays recorded = record_render(
      [&](const Ray& ray, Side side, SurfaceHit& hit) { return trace(view, ray, side, hit); }, box, ray_count, 1);
  const auto traced = [&](RayClass c) { return static_cast<double>(recorded.traced[static_cast<std::size_t>(c)]); };
  const double all = traced(RayClass::camera) + traced(RayClass::outside) + traced(RayClass::inside);
  s.sets.push_back({"camera", recorded.of(RayClass::camera), 0.5, traced(RayClass::camera) / all});
  s.sets.push_back({"outside", recorded.of(RayClass::outside), 0.6, traced(RayClass::outside) / all});
  s.sets.push_back({"inside", recorded.of(RayClass::inside), 0.85, traced(RayClass::inside) / all});
  shuffle(recorded.of(RayClass::inside));
  s.sets.push_back({"inside, random order", recorded.of(RayClass::inside), 0.85, 0});
  return s;
}

/// Rays that the renderer has under way together.
constexpr std::size_t batch_size = 256;

/// Traces the rays by the batch, as the renderer does, once an iteration; tells the share of hits.
void run_batches(benchmark::State& state, const std::vector<TestRay>& rays, double& hit_share,
                 const ImplicitSurfaceView& view, TraceBatchFunction trace) {
  std::array<SurfaceHit, batch_size> batch_hits;
  std::array<bool, batch_size> found;
  for (auto _ : state) {
    std::size_t hits = 0;
    float sum = 0;
    for (std::size_t first = 0; first < rays.size(); first += batch_size) {
      const std::size_t count = std::min(batch_size, rays.size() - first);
      trace(view, &rays[first], static_cast<int>(count), batch_hits.data(), found.data());
      for (std::size_t i = 0; i < count; ++i) {
        if (!found[i]) continue;
        ++hits;
        sum += batch_hits[i].t + batch_hits[i].shading_normal.x;
      }
    }
    benchmark::DoNotOptimize(sum);
    hit_share = static_cast<double>(hits) / static_cast<double>(rays.size());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays.size()));
}

std::string key(const char* what, const Subject& s, const std::string& set) {
  return fmt::format("{} n={} {}", what, s.order, set);
}

void register_benchmarks(std::vector<Subject>& subjects, TraceFunction trace, TraceBatchFunction trace_batch) {
  const auto add = [](const std::string& name, auto&& body) {
    return benchmark::RegisterBenchmark(name.c_str(), body)->Unit(benchmark::kMillisecond);
  };
  for (Subject& s : subjects) {
    for (Subject::RaySet& set : s.sets) {
      add(key("direct", s, set.name), [&s, &set, trace_batch](benchmark::State& state) {
        run_batches(state, set.rays, set.direct_hits, s.surface.view(), trace_batch);
      });
      add(key("single", s, set.name), [&s, &set, trace](benchmark::State& state) {
        const ImplicitSurfaceView& view = s.surface.view();
        double hits = 0;
        run_rays(state, set.rays, set.rays.size(), hits,
                 [&](const TestRay& r, SurfaceHit& hit) { return trace(view, r.ray, r.side, hit); });
      });
      add(key("embree", s, set.name), [&s, &set](benchmark::State& state) {
        run_rays(state, set.rays, set.rays.size(), set.embree_hits, [&](const TestRay& r, SurfaceHit& hit) {
          return s.mesh->intersect(r.ray, r.side == Side::unknown ? 0.0f : embree_start, hit);
        });
      });
      if (s.thesis) {
        add(key("thesis", s, set.name), [&s, &set](benchmark::State& state) {
          double hits = 0;
          run_rays(state, set.rays, 1000, hits,
                   [&](const TestRay& r, SurfaceHit& hit) { return s.thesis->intersect(r.ray, r.side, hit); });
        })->Iterations(1);
      }
    }
    add(key("direct", s, "build"), [&s](benchmark::State& state) {
      for (auto _ : state) benchmark::DoNotOptimize(build_implicit_surface(s.positions, {}, s.settings));
    })->Iterations(1);
    add(key("embree", s, "build"), [&s](benchmark::State& state) {
      for (auto _ : state) {
        const SurfaceModel model = resolve_surface_model(s.positions, {}, s.settings);
        const EmbreeMesh mesh(extract_isosurface(s.positions, {}, model, mesh_settings()));
        benchmark::DoNotOptimize(mesh.bytes());
      }
    })->Iterations(1);
  }
}

/// All rays of the render in their proportions.
void print_whole_render(const Subject& s, const Collector& c) {
  double seconds[4] = {};  // a ray, on average
  const char* whats[4] = {"direct", "single", "embree", "thesis"};
  for (int i = 0; i < 4; ++i) {
    for (const Subject::RaySet& set : s.sets) {
      if (set.share > 0) seconds[i] += set.share / c.rate(key(whats[i], s, set.name));
    }
  }
  fmt::print("  {:<22}{:>9.3f}{:>9.3f}{:>9.3f}{:>16}{:>8.2f}{:>14}{:>8.2f}", "the whole render", 1e-6 / seconds[0],
             1e-6 / seconds[1], 1e-6 / seconds[2], "", seconds[2] / seconds[0], "", seconds[2] / seconds[1]);
  if (s.thesis) fmt::print("{:>11.0f} {}", seconds[3] / seconds[0], verdict(seconds[3] / seconds[0] >= 100));
  fmt::print("\n");
}

void print_report(const std::vector<Subject>& subjects, const Collector& c) {
  for (const Subject& s : subjects) {
    fmt::print("\nn = {}: {} particles, {} triangles at R0/2\n", s.order, s.positions.size(),
               s.mesh->mesh().triangles.size());
    fmt::print("  {:<22}{:>9}{:>9}{:>9}{:>8}{:>8}{:>8}{:>7}{:>7}{:>8}", "rays", "direct", "single", "Embree", "hits",
               "hits", "ratio", "bar", "", "single");
    fmt::print("{}\n", s.thesis ? "   x thesis (bar 100)" : "");
    for (const Subject::RaySet& set : s.sets) {
      const double direct = c.rate(key("direct", s, set.name)), single = c.rate(key("single", s, set.name));
      const double embree = c.rate(key("embree", s, set.name));
      const double ratio = direct / embree;
      fmt::print("  {:<22}{:>9.3f}{:>9.3f}{:>9.3f}{:>8.3f}{:>8.3f}{:>8.2f}{:>7.2f}{:>7}{:>8.2f}", set.name,
                 direct * 1e-6, single * 1e-6, embree * 1e-6, set.direct_hits, set.embree_hits, ratio, set.bar,
                 verdict(ratio >= set.bar), single / embree);
      if (s.thesis) {
        const double times = direct / c.rate(key("thesis", s, set.name));
        fmt::print("{:>11.0f} {}", times, verdict(times >= 100));
      }
      fmt::print("\n");
    }
    print_whole_render(s, c);
    const double direct = c.seconds(key("direct", s, "build")), mesh = c.seconds(key("embree", s, "build"));
    fmt::print(
        "  build: direct {:.3f} s (bar 0.25: {}); sampling, extraction and BVH {:.3f} s, {:.1f} times it (bar 5: "
        "{})\n",
        direct, verdict(direct <= 0.25), mesh, mesh / direct, verdict(mesh / direct >= 5));
    const double particles = static_cast<double>(s.positions.size());
    const double bytes = static_cast<double>(s.surface.stats().bytes) / particles;
    fmt::print("  memory beyond the input: direct {:.0f} bytes a particle (bar 300: {}); mesh and BVH {:.0f}\n", bytes,
               verdict(bytes <= 300), static_cast<double>(s.mesh->bytes()) / particles);
  }
  fmt::print(
      "\nRates in millions of rays a second, t and shading normal returned. Direct: in batches of {}, as the renderer "
      "traces them;\nsingle: one by one; Embree: rtcIntersect1, one by one. Ratios are to Embree.\n",
      batch_size);
}

int run(std::vector<char*> arguments) {
  const std::string data = bench::take_option(arguments, "--data");
  const std::string rays = bench::take_option(arguments, "--rays");
  const std::string orders = bench::take_option(arguments, "--orders");
  if (!bench::initialize(arguments)) return 1;

  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<Vec3> positions;
  for (const Vec3d& p : read_particles(data.empty() ? EMBRUN_DATA_DIR "/dam_break.bgeo" : data).positions) {
    positions.push_back(to_float(p));
  }
  const std::string isa = available_isas().back();
  fmt::print("instruction set {}\n", isa);
  std::vector<Subject> subjects;
  for (const int order : {2, 3}) {
    if (!orders.empty() && orders.find(std::to_string(order)) == std::string::npos) continue;
    subjects.push_back(make_subject(positions, order, rays.empty() ? 100000 : std::stoul(rays), trace_function(isa)));
  }
  register_benchmarks(subjects, trace_function(isa), trace_batch_function(isa));
  Collector collector;
  benchmark::RunSpecifiedBenchmarks(&collector);
  print_report(subjects, collector);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv, argv + argc});
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_surface: {}\n", error.what());
    return 1;
  }
}

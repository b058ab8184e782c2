// What radii that differ cost: rays against fluids of particles of one radius, and against comparable ones whose radii
// differ by orders of magnitude. One thread, one process, interleaved repetitions, medians of CPU time. See README.md.

#include <benchmark/benchmark.h>
#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "geometry/implicit_surface.h"
#include "geometry/surface_settings.h"
#include "geometry/tracers.h"
#include "io/read_particles.h"
#include "measure.h"
#include "measure/ray_recorder.h"

namespace {

using namespace embrun;
using namespace embrun::measure;
using namespace embrun::test;
using bench::Collector;
using bench::run_rays;

/// A fluid, and the one of equal radii that it is compared with.
struct Subject {
  std::string name;
  int compared_with = -1;  ///< index of the other, or -1: it is such a one
  std::vector<Vec3> positions;
  std::vector<float> radii;
  SurfaceSettings settings;
  ImplicitSurface surface;
  RecordedRays recorded;
  double hits[ray_class_count] = {};
};

constexpr float equal_block_radius = 1.0f / 56.0f;  // 28 layers: as many particles as the mixed block has

SurfaceSettings settings_of(float radius, double spacing) {
  SurfaceSettings settings;
  settings.radius = radius;
  settings.spacing = spacing;
  return settings;
}

/// The bundled dam break, made smaller so that its radius is 2e-3.
Subject dam_break() {
  constexpr float scale = 2e-3f / 0.025f;
  Subject s;
  s.name = "dam break";
  for (const Vec3d& p : read_particles(EMBRUN_DATA_DIR "/dam_break.bgeo").positions) {
    s.positions.push_back(to_float(p) * scale);
  }
  s.settings = settings_of(2e-3f, 0.0465 * 0.08);
  return s;
}

/// The same surface, found by the code for radii that differ.
Subject nearly_equal(const Subject& equal) {
  Subject s;
  s.name = "dam break, radii +- 1e-5";
  s.positions = equal.positions;
  s.settings = equal.settings;
  Dice dice(1);
  for (std::size_t i = 0; i < s.positions.size(); ++i)
    s.radii.push_back(equal.settings.radius * (1.0f + dice.uniform(-1e-5f, 1e-5f)));
  return s;
}

/// A quarter more particles, of radius 1e-8, all over it.
Subject with_dust(const Subject& equal) {
  Subject s;
  s.name = "dam break in dust of 1e-8";
  s.positions = equal.positions;
  s.settings = equal.settings;
  s.radii.assign(s.positions.size(), equal.settings.radius);
  Box3 box;
  for (const Vec3 p : s.positions) box.include(p);
  Dice dice(2);
  for (std::size_t i = equal.positions.size() / 4; i > 0; --i) {
    s.positions.push_back({dice.uniform(box.low.x, box.high.x), dice.uniform(box.low.y, box.high.y),
                           dice.uniform(box.low.z, box.high.z)});
    s.radii.push_back(1e-8f);
  }
  return s;
}

/// Layers of particles from top to bottom of each slab of the mixed block: whole numbers, so that all slabs end at the
/// same height and the block has the shape of the even one; in nearly equal steps of the logarithm, neighbours far apart.
constexpr int slab_layers[] = {50, 17, 7, 32, 11, 43, 15, 6, 27, 9, 37, 13, 5, 23, 8, 20};

/// A block of water of 4 x 1 x 1 m. Mixed: sixteen slabs across it, each sampled as finely as its own radius has it, from
/// 0.01 to 0.1.
Subject block(bool mixed) {
  Subject s;
  s.name = mixed ? "block, radii log-uniform" : "block";
  Dice dice(3);
  const auto fill = [&](float low, float high, float radius) {
    const float step = 2.0f * radius;
    for (float x = low + radius; x < high; x += step) {
      for (float y = radius; y < 1.0f; y += step) {
        for (float z = radius; z < 1.0f; z += step) {
          const float j = 0.2f * step;
          s.positions.push_back({x + dice.uniform(-j, j), y + dice.uniform(-j, j), z + dice.uniform(-j, j)});
          if (mixed) s.radii.push_back(radius);
        }
      }
    }
  };
  if (!mixed) {
    fill(0, 4, equal_block_radius);
    s.settings = settings_of(equal_block_radius, 0);
    return s;
  }
  float low = 0;
  for (const int layers : slab_layers) {
    // About 0.25 wide, and a whole number of layers again: no gaps between the slabs.
    const float step = 1.0f / static_cast<float>(layers);
    const float width = std::round(0.25f / step) * step;
    fill(low, low + width, 0.5f * step);
    low += width;
  }
  s.settings = settings_of(0.0316f, 0);
  return s;
}

/// Spray: 20,000 balls scattered in a cube. Mixed: radii log-uniform from 1e-4 to 1e-1; else their root mean square,
/// which gives the same area.
Subject spray(bool mixed) {
  Subject s;
  s.name = mixed ? "spray, radii log-uniform" : "spray";
  Dice dice(4);
  double area = 0;
  constexpr int count = 20000;
  for (int i = 0; i < count; ++i) {
    s.positions.push_back({dice.uniform(0, 4), dice.uniform(0, 4), dice.uniform(0, 4)});
    const double radius = std::pow(10.0, -4 + 3 * dice.next());
    area += radius * radius;
    if (mixed) s.radii.push_back(static_cast<float>(radius));
  }
  s.settings = settings_of(mixed ? 3.2e-3f : static_cast<float>(std::sqrt(area / count)), 0);
  return s;
}

void add(std::vector<Subject>& subjects, Subject subject, int compared_with = -1) {
  subject.compared_with = compared_with;
  subjects.push_back(std::move(subject));
}

/// Builds the surface and records the rays of a render of it.
void prepare(Subject& s, int order, std::size_t ray_count, TraceFunction trace) {
  s.settings.order = order;
  s.surface = build_implicit_surface(s.positions, s.radii, s.settings);
  Box3 box;
  for (const Vec3 p : s.positions) box.include(p);
  const ImplicitSurfaceView& view = s.surface.view();
  s.recorded = record_render([&](const Ray& ray, Side side, SurfaceHit& hit) { return trace(view, ray, side, hit); },
                             box, ray_count, 1);
}

std::string key(const Subject& s, const std::string& what) { return s.name + " " + what; }

void register_benchmarks(std::vector<Subject>& subjects, TraceFunction trace) {
  for (Subject& s : subjects) {
    for (int c = 0; c < ray_class_count; ++c) {
      const std::vector<TestRay>& rays = s.recorded.rays[static_cast<std::size_t>(c)];
      if (rays.empty()) continue;
      const std::string name = key(s, std::string(name_of(static_cast<RayClass>(c))));
      benchmark::RegisterBenchmark(name.c_str(), [&s, &rays, c, trace](benchmark::State& state) {
        const ImplicitSurfaceView& view = s.surface.view();
        run_rays(state, rays, rays.size(), s.hits[c],
                 [&](const TestRay& r, SurfaceHit& hit) { return trace(view, r.ray, r.side, hit); });
      });
    }
    benchmark::RegisterBenchmark(key(s, "build").c_str(), [&s](benchmark::State& state) {
      for (auto _ : state) benchmark::DoNotOptimize(build_implicit_surface(s.positions, s.radii, s.settings));
    })->Iterations(1);
  }
}

/// Seconds a ray, all rays of the render in their proportions.
double seconds_a_ray(const Subject& s, const Collector& c) {
  double seconds = 0, rays = 0;
  for (int i = 0; i < ray_class_count; ++i) {
    const double rate = c.rate(key(s, std::string(name_of(static_cast<RayClass>(i)))));
    const auto traced = static_cast<double>(s.recorded.traced[static_cast<std::size_t>(i)]);
    if (rate > 0) seconds += traced / rate, rays += traced;
  }
  return seconds / rays;
}

void print_report(const std::vector<Subject>& subjects, const Collector& c, int order) {
  fmt::print("\nn = {}: Mrays/s, hits; last the time of a render's rays over the equal radii's (bar 2)\n", order);
  fmt::print("  {:<28}{:>10}{:>16}{:>16}{:>16}{:>9}{:>8}{:>9}{:>7}\n", "", "particles", "camera", "outside", "inside",
             "build s", "bytes", "render", "times");
  for (const Subject& s : subjects) {
    fmt::print("  {:<28}{:>10}", s.name, s.positions.size());
    for (int i = 0; i < ray_class_count; ++i) {
      const double rate = c.rate(key(s, std::string(name_of(static_cast<RayClass>(i)))));
      fmt::print("{:>9.3f}{:>7.3f}", rate * 1e-6, s.hits[i]);
    }
    const double bytes = static_cast<double>(s.surface.stats().bytes) / static_cast<double>(s.positions.size());
    fmt::print("{:>9.3f}{:>8.0f}{:>9.3f}", c.seconds(key(s, "build")), bytes, 1e-6 / seconds_a_ray(s, c));
    if (s.compared_with >= 0) {
      const Subject& equal = subjects[static_cast<std::size_t>(s.compared_with)];
      fmt::print("{:>7.2f}", seconds_a_ray(s, c) / seconds_a_ray(equal, c));
    }
    fmt::print("\n");
  }
}

int run(std::vector<char*> arguments) {
  const std::string rays = bench::take_option(arguments, "--rays");
  const std::string orders = bench::take_option(arguments, "--order");
  if (!bench::initialize(arguments)) return 1;
  const int order = orders.empty() ? 3 : std::stoi(orders);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const std::string isa = available_isas().back();

  std::vector<Subject> subjects;
  add(subjects, dam_break());
  add(subjects, nearly_equal(subjects[0]), 0);
  add(subjects, with_dust(subjects[0]), 0);
  add(subjects, block(false));
  add(subjects, block(true), 3);
  add(subjects, spray(false));
  add(subjects, spray(true), 5);
  for (Subject& s : subjects) prepare(s, order, rays.empty() ? 30000 : std::stoul(rays), trace_function(isa));
  fmt::print("instruction set {}\n", isa);
  register_benchmarks(subjects, trace_function(isa));
  Collector collector;
  benchmark::RunSpecifiedBenchmarks(&collector);
  print_report(subjects, collector, order);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv, argv + argc});
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_radii: {}\n", error.what());
    return 1;
  }
}

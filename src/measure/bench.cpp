#include "embrun/bench.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <random>

#include "backend/cpu/embree_mesh.h"
#include "backend/cpu/kernel_table.h"
#include "base/error.h"
#include "geometry/implicit_surface.h"
#include "io/read_particles.h"
#include "measure/oracle_scene.h"
#include "measure/ray_recorder.h"
#include "media/particle_density_build.h"
#include "meshing/isosurface.h"
#include "particles/radius.h"
#include "render/fluid_meshes.h"
#include "render/render_loop.h"
#include "render/stopwatch.h"
#include "scene/compile_media.h"

namespace embrun {
namespace {

constexpr int ray_batch = 256;  // that a render has under way together

double cpu_now() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Contenders that do the same work, timed turn by turn, so that a busy machine troubles all alike.
class Race {
 public:
  explicit Race(int repetitions) : repetitions_(repetitions) {}
  void add(std::function<void()> work) { runs_.push_back({std::move(work), {}}); }
  void run() {
    for (int i = 0; i < repetitions_; ++i) {
      for (Run& run : runs_) {
        const double start = cpu_now();
        run.work();
        run.seconds.push_back(cpu_now() - start);
      }
    }
  }
  double seconds(std::size_t contender) const { return std::max(median(runs_[contender].seconds), 1e-9); }

 private:
  struct Run {
    std::function<void()> work;
    std::vector<double> seconds;
  };
  int repetitions_;
  std::vector<Run> runs_;
};

/// Calls work(first, count) for a list by batches.
void by_batches(std::size_t all, const std::function<void(std::size_t first, int count)>& work) {
  for (std::size_t first = 0; first < all; first += ray_batch)
    work(first, static_cast<int>(std::min<std::size_t>(ray_batch, all - first)));
}

/// A measurement under way.
class Bench {
 public:
  Bench(const BenchOptions& options, const RenderHooks& hooks) : options_(options), hooks_(hooks) {}
  BenchReport go(const std::string& file);

 private:
  void read(const std::string& file);
  void measure_builds();
  void measure_rays();
  BenchRates race_rays(const std::vector<SidedRay>& rays);
  void judge();
  BenchRates race_flights(double free_path);
  std::vector<FlightQuery> make_flights() const;

  const BenchOptions& options_;
  const RenderHooks& hooks_;
  const KernelTable& kernels_ = select_kernels();
  BenchReport report_;
  SizedParticles sized_;
  measure::OracleScene scene_;  // the particles, about the middle of their bounds
  ImplicitSurface surface_;
  SurfaceModel model_;
  std::unique_ptr<EmbreeMesh> mesh_;
};

void Bench::read(const std::string& file) {
  report_.version = version();
  report_.instruction_set = kernels_.name;
  report_.input = file;
  sized_ = size_particles(read_particles(file), options_.radius, file);
  const std::vector<Vec3d>& positions = sized_.particles.positions;
  Box3 box;
  for (const Vec3d& p : positions) box.include(to_float(p));
  const Vec3d middle = 0.5 * (to_double(box.low) + to_double(box.high));
  for (const Vec3d& p : positions) scene_.positions.push_back(to_float(p - middle));
  scene_.name = file;
  scene_.radii = sized_.radius.radii;
  scene_.settings.order = options_.order;
  scene_.settings.radius = static_cast<float>(sized_.radius.radius);
  scene_.settings.spacing = sized_.spacing.spacing;
  // A thousandth of the radius, or what single precision can tell.
  scene_.tolerance = std::max(1e-3 * sized_.radius.radius, 2.4e-7 * static_cast<double>(length(box.high - box.low)));
  report_.particles = positions.size();
  report_.radius = sized_.radius.radius;
  report_.spacing = sized_.spacing.spacing;
}

void Bench::measure_builds() {
  Race race(std::min(options_.repetitions, 3));
  race.add([&] { surface_ = build_implicit_surface(scene_.positions, scene_.radii, scene_.settings); });
  race.add([&] {
    mesh_.reset();
    const SurfaceModel model = resolve_surface_model(scene_.positions, scene_.radii, scene_.settings);
    IsosurfaceSettings settings;
    settings.exact_vertices = false;  // by linear interpolation, as such pipelines do it
    mesh_ = std::make_unique<EmbreeMesh>(extract_isosurface(scene_.positions, scene_.radii, model, settings));
  });
  race.run();
  if (mesh_->mesh().triangles.empty()) throw Error(report_.input + ": its particles have no surface to measure");
  model_ = resolve_surface_model(scene_.positions, scene_.radii, scene_.settings);
  const auto count = static_cast<double>(scene_.positions.size());
  report_.build_direct = race.seconds(0);
  report_.build_mesh = race.seconds(1);
  report_.triangles = mesh_->mesh().triangles.size();
  report_.bytes_per_particle = static_cast<double>(surface_.stats().bytes) / count;
  report_.mesh_bytes_per_particle = static_cast<double>(mesh_->bytes()) / count;
}

BenchRates Bench::race_rays(const std::vector<SidedRay>& rays) {
  if (rays.empty()) {
    report_.notes.push_back("there are no rays of one kind: its figures are 0");
    report_.embree_ways.emplace_back("none");
    return {};
  }
  // Rays start on the exact surface; the mesh departs from it by up to some hundredths of R0, so that its rays skip this
  // much of their way instead of meeting what they have just left.
  const float start = 0.05f * scene_.settings.radius;
  std::array<SurfaceHit, ray_batch> hits;
  std::array<bool, ray_batch> found{};
  Race race(options_.repetitions);
  race.add([&] {
    by_batches(rays.size(), [&](std::size_t first, int count) {
      kernels_.trace_surface(surface_.view(), &rays[first], count, hits.data(), found.data());
    });
  });
  for (const EmbreeMode mode : embree_modes) {
    race.add([&, mode] {
      by_batches(rays.size(), [&](std::size_t first, int count) {
        mesh_->intersect(mode, &rays[first], count, start, hits.data(), found.data());
      });
    });
  }
  race.run();
  std::size_t best = 1;
  for (std::size_t i = 2; i <= std::size(embree_modes); ++i)
    if (race.seconds(i) < race.seconds(best)) best = i;
  report_.embree_ways.emplace_back(name_of(embree_modes[best - 1]));
  const double millions = 1e-6 * static_cast<double>(rays.size());
  return {millions / race.seconds(0), millions / race.seconds(best)};
}

void Bench::measure_rays() {
  using measure::RayClass;
  const measure::Intersector intersect = [&](const Ray& ray, Side side, SurfaceHit& hit) {
    const SidedRay one{ray, side};
    bool found = false;
    kernels_.trace_surface(surface_.view(), &one, 1, &hit, &found);
    return found;
  };
  measure::RecordedRays recorded =
      measure::record_render(intersect, scene_.bounds(), static_cast<std::size_t>(options_.rays), 1);
  report_.camera = race_rays(recorded.of(RayClass::camera));
  report_.outside = race_rays(recorded.of(RayClass::outside));
  report_.inside = race_rays(recorded.of(RayClass::inside));
  std::shuffle(recorded.of(RayClass::inside).begin(), recorded.of(RayClass::inside).end(), std::mt19937(5));
  report_.shuffled = race_rays(recorded.of(RayClass::inside));
}

void Bench::judge() {
  if (options_.oracle_rays == 0) return;
  const oracle::Surface surface = measure::oracle_surface(scene_, model_);
  const measure::Intersector intersect = [&](const Ray& ray, Side side, SurfaceHit& hit) {
    const SidedRay one{ray, side};
    bool found = false;
    kernels_.trace_surface(surface_.view(), &one, 1, &hit, &found);
    return found;
  };
  for (const measure::RayClass kind :
       {measure::RayClass::camera, measure::RayClass::outside, measure::RayClass::inside}) {
    const auto count = static_cast<std::size_t>(options_.oracle_rays / measure::ray_class_count);
    const measure::OracleReport verdicts =
        measure::judge_rays(scene_, surface, intersect, measure::make_rays(scene_, surface, intersect, kind, count, 1));
    report_.oracle_rays += verdicts.rays;
    report_.oracle_wrong += verdicts.wrong_count();
    if (verdicts.wrong_count() > 0)
      report_.notes.push_back(fmt::format("{} rays: {}", measure::name_of(kind), verdicts.summary()));
  }
}

/// From beside particles, as the vertices of paths are, in all directions.
std::vector<FlightQuery> Bench::make_flights() const {
  std::mt19937 random(2);
  std::uniform_int_distribution<std::size_t> pick(0, scene_.positions.size() - 1);
  std::normal_distribution<float> normal;
  const auto triple = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
  std::vector<FlightQuery> flights(static_cast<std::size_t>(options_.rays));
  for (std::size_t i = 0; i < flights.size(); ++i) {
    FlightQuery& flight = flights[i];
    flight.ray.origin = scene_.positions[pick(random)] + 0.5f * scene_.settings.radius * triple();
    flight.ray.direction = normalize(triple());
    flight.random = {SampleKey{1, 2, static_cast<std::uint32_t>(i), 3}, Dimension::free_flight};
    flight.u = flight.random.next_pair().x;
  }
  return flights;
}

/// Particles of 0.5 to 1.5 times the mean extinction, and the grid that renders of a mesh have for them.
BenchRates Bench::race_flights(double free_path) {
  constexpr double coverage = 0.63;  // share of the fluid's volume in its balls
  SceneDescription scene;
  FluidDescription fluid;
  for (const Vec3& p : scene_.positions) fluid.positions.push_back(to_double(p));
  fluid.radii = scene_.radii;
  fluid.surface = scene_.settings;
  fluid.method = SurfaceMethod::mesh;
  fluid.medium.emplace();
  fluid.medium->extinction = grey(static_cast<float>(1 / (coverage * free_path * sized_.radius.radius)));
  std::mt19937 random(1);
  std::uniform_real_distribution<float> factor(0.5f, 1.5f);
  for (std::size_t i = 0; i < fluid.positions.size(); ++i) fluid.medium->densities.push_back(factor(random));
  scene.fluids.push_back(std::move(fluid));
  const PlacedParticles placed = place_particles(scene.fluids.front(), {});
  const ParticleDensity density(std::span(&placed.particles, 1), MediaOverlap::sum);
  const SceneDescription on_grid = with_grid_media(scene);
  Box3 box = scene_.bounds();
  const GridMediumData grid = compile_grid_medium(on_grid.grid_media.at(0), {}, box);

  const std::vector<FlightQuery> flights = make_flights();
  std::vector<float> lengths(flights.size());
  Race race(options_.repetitions);
  race.add([&] {
    by_batches(flights.size(), [&](std::size_t first, int count) {
      kernels_.fly(density.view(), &flights[first], count, &lengths[first]);
    });
  });
  race.add([&] {
    by_batches(flights.size(), [&](std::size_t first, int count) {
      kernels_.fly_grid(grid.view(), &flights[first], count, &lengths[first]);
    });
  });
  race.run();
  const double millions = 1e-6 * static_cast<double>(flights.size());
  return {millions / race.seconds(0), millions / race.seconds(1)};
}

BenchReport Bench::go(const std::string& file) {
  const Stopwatch watch;
  const auto step = [&](double fraction) {
    if (hooks_.cancel != nullptr && hooks_.cancel->load()) throw Error("interrupted");
    tell(hooks_, "measuring", fraction, watch.seconds());
  };
  // Rays on one thread, as is measured; the oracle, which is slow and is not, on all.
  run_on_threads(1, [&] {
    step(0);
    read(file);
    step(0.05);
    measure_builds();
    step(0.3);
    measure_rays();
    step(0.6);
    report_.flights_10 = race_flights(10);
    step(0.7);
    report_.flights_100 = race_flights(100);
    step(0.8);
  });
  run_on_threads(0, [&] { judge(); });
  step(1);
  return std::move(report_);
}

}  // namespace

void check_options(const BenchOptions& o) {
  if (o.order < 1) throw Error(fmt::format("neighbourhood order {}: it must be at least 1", o.order));
  if (o.radius && !(*o.radius > 0 && *o.radius < 1e30))
    throw Error(fmt::format("radius {}: it must be positive", *o.radius));
  if (o.rays < 256 || o.rays > 10000000) throw Error(fmt::format("{} rays: give 256 to 10,000,000", o.rays));
  if (o.oracle_rays < 0 || o.oracle_rays > 100000000)
    throw Error(fmt::format("{} oracle rays: give 0 to 100,000,000", o.oracle_rays));
  if (o.repetitions < 1 || o.repetitions > 1000)
    throw Error(fmt::format("{} repetitions: give 1 to 1000", o.repetitions));
}

BenchReport bench_file(const std::string& particle_file, const BenchOptions& options, const RenderHooks& hooks) {
  check_options(options);
  return Bench(options, hooks).go(particle_file);
}

}  // namespace embrun

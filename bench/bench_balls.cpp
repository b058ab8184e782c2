// Sets of many balls: how long compiling and building take, the memory they hold, and rays per second, by number of
// balls. The balls fill a cube at random; `cover` is how many lie over a point on average.
//
//   bench_balls [count ...]        default: 100000 1000000 10000000

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "backend/cpu/cpu_backend.h"
#include "scene/compile.h"

namespace {

using namespace embrun;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Memory that the process holds now, MiB.
double resident_memory() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  long total = 0, resident = 0;
  if (std::fscanf(file, "%ld %ld", &total, &resident) != 2) resident = 0;
  std::fclose(file);
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

void measure(std::size_t count, double cover) {
  SceneDescription scene;
  scene.camera.eye = {0, 0, 5};
  scene.integrator.guide = false;
  BallsDescription set;
  set.material = dielectric_material(1.33);
  const double radius = std::cbrt(cover * 8 / (static_cast<double>(count) * 4 / 3 * M_PI));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  set.balls.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    set.balls.push_back({{uniform(random), uniform(random), uniform(random)}, radius});
  scene.balls.push_back(std::move(set));

  const double memory_before = resident_memory();
  auto start = std::chrono::steady_clock::now();
  const FlatScene flat = compile(scene);
  const double compile_time = seconds_since(start);
  start = std::chrono::steady_clock::now();
  const CpuBackend backend(flat);
  const double build_time = seconds_since(start);
  const double memory = resident_memory() - memory_before;

  constexpr int rays_per_kind = 200000;
  std::vector<Ray> rays(rays_per_kind);
  std::vector<MediaState> media(rays_per_kind);
  std::vector<SceneHit> hits(rays_per_kind);
  std::vector<char> found(rays_per_kind);
  const auto rate = [&](bool inside) {
    int kept = 0;
    while (kept < rays_per_kind) {
      Ray& ray = rays[static_cast<std::size_t>(kept)];
      ray.origin = to_float({uniform(random), uniform(random), uniform(random)});
      const Vec3d d{uniform(random), uniform(random), uniform(random)};
      if (length(d) > 1 || length(d) < 0.1) continue;
      ray.direction = normalize(to_float(d));
      media[static_cast<std::size_t>(kept)] = backend.kernels().media_at(backend.view(), ray.origin, 0.0f);
      if (media[static_cast<std::size_t>(kept)].inside_solid(0) == inside) ++kept;
    }
    const auto begin = std::chrono::steady_clock::now();
    backend.kernels().intersect(backend.view(), rays.data(), media.data(), rays_per_kind,
                                reinterpret_cast<bool*>(found.data()), hits.data());
    return rays_per_kind / seconds_since(begin);
  };
  const double outside_rate = rate(false), inside_rate = rate(true);
  fmt::print("{:>10} {:>6} {:>10.2f} {:>10.2f} {:>10.0f} {:>10.1f} {:>14.3f} {:>14.3f}\n", count, cover, compile_time,
             build_time, memory, memory * (1 << 20) / static_cast<double>(count), 1e-6 * outside_rate,
             1e-6 * inside_rate);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::size_t> counts;
  for (int i = 1; i < argc; ++i) counts.push_back(std::strtoull(argv[i], nullptr, 10));
  if (counts.empty()) counts = {100000, 1000000, 10000000};
  fmt::print("{:>10} {:>6} {:>10} {:>10} {:>10} {:>10} {:>14} {:>14}\n", "balls", "cover", "compile s", "build s",
             "MiB", "B/ball", "outside Mray/s", "inside Mray/s");
  for (const std::size_t count : counts)
    for (const double cover : {0.3, 3.0}) measure(count, cover);
  return 0;
}

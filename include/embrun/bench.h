#pragma once

// What the direct way costs beside a mesh, measured on any particles.

#include <embrun/embrun.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace embrun {

struct BenchOptions {
  std::optional<double> radius;  ///< as RenderOptions::radius
  int order = 3;
  int rays = 100000;        ///< of each kind, recorded from a render
  int oracle_rays = 30000;  ///< in all, judged one by one against the surface in double precision; 0: none
  int repetitions = 5;      ///< of each measurement, turn by turn; medians count
};

/// Millions a second on one thread.
struct BenchRates {
  double direct = 0, mesh = 0;
  double ratio() const { return mesh > 0 ? direct / mesh : 0; }
};

struct BenchReport {
  std::string version, instruction_set, input;
  std::uint64_t particles = 0, triangles = 0;
  double radius = 0, spacing = 0;

  /// Rays from the camera, from the surface outwards and inwards, and the last in random order; against Embree in whatever
  /// of its ways is the fastest for them, which `embree_ways` names.
  BenchRates camera, outside, inside, shuffled;
  std::vector<std::string> embree_ways;
  /// Seconds on one thread: of the surface, and of sampling, extraction and Embree's tree.
  double build_direct = 0, build_mesh = 0;
  double bytes_per_particle = 0, mesh_bytes_per_particle = 0;  ///< beyond the input
  std::uint64_t oracle_rays = 0, oracle_wrong = 0;
  /// Free flights through the particles and through a grid of cells of R0/2, for mean free paths of 10 and 100 radii.
  BenchRates flights_10, flights_100;
  std::vector<std::string> notes;
};

/// Throws when an option is out of range.
void check_options(const BenchOptions& options);

/// Measures on one thread, in a minute or so. Throws for files that cannot be rendered.
BenchReport bench_file(const std::string& particle_file, const BenchOptions& options = {},
                       const RenderHooks& hooks = {});

/// The figures by their stable names: rays.camera.direct, ...
std::vector<std::pair<std::string, double>> figures(const BenchReport& report);
/// Several lines for people, ending with a line feed.
std::string to_text(const BenchReport& report);
/// A JSON object, in which the names' parts are objects.
std::string to_json(const BenchReport& report);

}  // namespace embrun

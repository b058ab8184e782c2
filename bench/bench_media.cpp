// Free flights through the particles of a dam break: the renderer's samplers beside delta tracking on density grids.
// One thread, one process, interleaved repetitions, medians of CPU time. See README.md.

#include <fmt/core.h>
#include <time.h>

#include <algorithm>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "io/read_particles.h"
#include "media/flight_batch.h"
#include "media/particle_density_build.h"

namespace {

using namespace embrun;

constexpr float radius = 0.025f;   // the solver's
constexpr float coverage = 0.63f;  // share of the fluid's volume in its balls
constexpr std::size_t ray_count = 200000;
constexpr int repetitions = 9;

/// The medium on a raster: voxels with the mean of the particles' exact extinction in them, looked up at the nearest centre
/// and tracked with the same walk over bricks, whose majorants are those of their voxels.
class RasterDensity {
 public:
  RasterDensity(const ParticleDensityView& exact, const Box3& box, float voxel, int points_a_side)
      : low_(box.low), voxel_(voxel) {
    const int multiple = static_cast<int>(std::lround(largest_brick * radius / voxel));
    const auto cells = [&](float extent) {
      return multiple * static_cast<int>(std::ceil(extent / (voxel * static_cast<float>(multiple))));
    };
    const Vec3 size = box.high - box.low;
    nx_ = cells(size.x);
    ny_ = cells(size.y);
    nz_ = cells(size.z);
    values_.resize(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_) * static_cast<std::size_t>(nz_));
    for (int z = 0; z < nz_; ++z)
      for (int y = 0; y < ny_; ++y)
        for (int x = 0; x < nx_; ++x) values_[index(x, y, z)] = mean(exact, x, y, z, points_a_side);
  }

  /// Divides it into bricks of another size, in radii: a divisor of largest_brick.
  static constexpr int largest_brick = 24;
  void set_bricks(int side_in_radii) {
    const int per_brick = static_cast<int>(std::lround(static_cast<float>(side_in_radii) * radius / voxel_));
    const float side = voxel_ * static_cast<float>(per_brick);
    bricks_ = grid_of_cubes(low_, side, nx_ / per_brick, ny_ / per_brick, nz_ / per_brick);
    majorants_.assign(static_cast<std::size_t>(bricks_.nx * bricks_.ny * bricks_.nz), 0.0f);
    for (int z = 0; z < nz_; ++z)
      for (int y = 0; y < ny_; ++y)
        for (int x = 0; x < nx_; ++x) {
          float& majorant =
              majorants_[static_cast<std::size_t>(bricks_.index(x / per_brick, y / per_brick, z / per_brick))];
          majorant = std::max(majorant, values_[index(x, y, z)]);
        }
  }
  double megabytes() const { return 4e-6 * static_cast<double>(values_.size()); }

  float flight(const DensityRay& ray, float depth, RandomStream& random) const {
    const float inverse = 1 / voxel_;
    for (GridWalk bricks(bricks_, ray.origin, ray.direction, ray.begin, ray.end); !bricks.done; bricks.advance()) {
      const float majorant = majorants_[static_cast<std::size_t>(bricks.index())], end = bricks.end();
      float t = bricks.begin;
      while (true) {
        const float left = (end - t) * majorant;
        if (depth >= left) {
          depth -= left;
          break;
        }
        t += depth / majorant;
        const Vec3 at = (ray.origin + t * ray.direction - low_) * inverse;
        const int x = std::min(static_cast<int>(at.x), nx_ - 1), y = std::min(static_cast<int>(at.y), ny_ - 1),
                  z = std::min(static_cast<int>(at.z), nz_ - 1);
        const Sample2 u = random.next_pair();
        if (u.x * majorant < values_[index(x, y, z)]) return t;
        depth = flight_depth(u.y);
      }
    }
    return infinity;
  }

 private:
  CellGrid bricks_;
  Vec3 low_;
  float voxel_;
  int nx_ = 0, ny_ = 0, nz_ = 0;
  std::vector<float> values_, majorants_;

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(ny_) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(nx_) +
           static_cast<std::size_t>(x);
  }
  float mean(const ParticleDensityView& exact, int x, int y, int z, int points) const {
    double sum = 0;
    for (int i = 0; i < points * points * points; ++i) {
      const auto at = [&](int voxel, int part) {
        return static_cast<float>(voxel) + (static_cast<float>(part) + 0.5f) / static_cast<float>(points);
      };
      const Vec3 p = low_ + voxel_ * Vec3{at(x, i % points), at(y, i / points % points), at(z, i / points / points)};
      const Vec3 cell = (p - exact.grid.low) * exact.grid.cells_per_metre;
      const int bx = static_cast<int>(cell.x), by = static_cast<int>(cell.y), bz = static_cast<int>(cell.z);
      if (cell.x < 0 || cell.y < 0 || cell.z < 0 || bx >= exact.grid.nx || by >= exact.grid.ny || bz >= exact.grid.nz)
        continue;
      const std::uint32_t brick = exact.brick_index[exact.grid.index(bx, by, bz)];
      if (brick == no_brick) continue;
      const DensityCell* list = cell_at(exact, exact.bricks[brick], p);
      if (list != nullptr) sum += static_cast<double>(extinction_in_cell(exact, *list, p, ~0u).g);
    }
    return static_cast<float>(sum / (points * points * points));
  }
};

double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// One way of drawing flights: the distance of flight number i, or infinity.
struct Contender {
  std::string name;
  std::function<void(std::vector<float>&)> run;
  std::vector<double> rates;  ///< million samples a second
  double mean_length = 0, collided = 0;

  double rate() const {
    std::vector<double> sorted = rates;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }
};

void measure(std::vector<Contender>& contenders) {
  std::vector<float> lengths(ray_count);
  for (int repetition = 0; repetition < repetitions; ++repetition)
    for (Contender& c : contenders) {
      const double start = cpu_seconds();
      c.run(lengths);
      c.rates.push_back(1e-6 * static_cast<double>(ray_count) / (cpu_seconds() - start));
      double sum = 0;
      std::size_t count = 0;
      for (const float t : lengths) {
        if (!(t < infinity)) continue;
        sum += static_cast<double>(t);
        ++count;
      }
      c.mean_length = sum / static_cast<double>(count) / static_cast<double>(radius);
      c.collided = static_cast<double>(count) / static_cast<double>(lengths.size());
    }
}

RandomStream stream(std::size_t i) {
  return {SampleKey{1, 2, static_cast<std::uint32_t>(i), 3}, Dimension::free_flight};
}

/// Paths of a batch fly together in the renderer, as these rays do.
struct FlightsOfRays {
  static constexpr std::size_t batch = 256;
  const std::vector<DensityRay>& rays;
  std::vector<float>& lengths;
  std::size_t first = 0;

  int count() const { return static_cast<int>(std::min(batch, rays.size() - first)); }
  FlightQuery query(int i) const {
    const std::size_t number = first + static_cast<std::size_t>(i);
    FlightQuery query{rays[number], 0, 0, stream(number)};
    query.u = query.random.next_pair().x;
    return query;
  }
  void settle(int i, const Flight& flight) {
    lengths[first + static_cast<std::size_t>(i)] = flight.collided ? flight.t : infinity;
  }
};

std::function<void(std::vector<float>&)> flights_on(const RasterDensity& grid, const std::vector<DensityRay>& rays) {
  return [&](std::vector<float>& lengths) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      RandomStream numbers = stream(i);
      lengths[i] = grid.flight(rays[i], flight_depth(numbers.next_pair().x), numbers);
    }
  };
}

/// Gives a raster the bricks that serve it best with these rays; their side in radii.
int choose_bricks(RasterDensity& grid, const std::vector<DensityRay>& rays) {
  std::vector<float> lengths(rays.size());
  const auto run = flights_on(grid, rays);
  int best = 0;
  double least = 1e30;
  for (const int side : {4, 6, 8, 12, 24}) {
    grid.set_bricks(side);
    double seconds = 1e30;
    for (int i = 0; i < 5; ++i) {
      const double start = cpu_seconds();
      run(lengths);
      seconds = std::min(seconds, cpu_seconds() - start);
    }
    if (seconds >= least) continue;
    least = seconds;
    best = side;
  }
  grid.set_bricks(best);
  return best;
}

void bench(const std::vector<Vec3>& positions, const std::vector<DensityRay>& rays, float free_path) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0.5f, 1.5f);
  DensityParticles particles;
  particles.positions = positions;
  particles.radius = radius;
  particles.extinction = grey(1 / (coverage * free_path * radius));
  for (std::size_t i = 0; i < positions.size(); ++i) particles.factors.push_back(uniform(random));
  const ParticleDensity density({&particles, 1}, MediaOverlap::sum);
  const ParticleDensityView view = density.view();
  const ParticleDensityStats stats = density.stats();

  Box3 box;
  for (const Vec3& p : positions) {
    box.include(p - Vec3{radius, radius, radius});
    box.include(p + Vec3{radius, radius, radius});
  }
  RasterDensity coarse(view, box, radius, 4), fine(view, box, 0.5f * radius, 2);
  const int coarse_bricks = choose_bricks(coarse, rays), fine_bricks = choose_bricks(fine, rays);

  std::uint64_t exceeded = 0;
  const auto together = [&](FlightSampler sampler) {
    return [&, sampler](std::vector<float>& lengths) {
      FlightsOfRays flights{rays, lengths};
      for (; flights.first < rays.size(); flights.first += FlightsOfRays::batch)
        next_collisions(view, sampler, flights, exceeded);
    };
  };
  const auto alone = [&](std::vector<float>& lengths) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      RandomStream numbers = stream(i);
      const float u = numbers.next_pair().x;
      const Flight flight = next_collision(view, rays[i], FlightSampler::tracking, 0, u, numbers, exceeded);
      lengths[i] = flight.collided ? flight.t : infinity;
    }
  };
  std::vector<Contender> contenders{{"tracking, exact balls", together(FlightSampler::tracking), {}},
                                    {"the same, one by one", alone, {}},
                                    {"events, exact balls", together(FlightSampler::events), {}},
                                    {"raster of R0", flights_on(coarse, rays), {}},
                                    {"raster of R0/2", flights_on(fine, rays), {}}};
  measure(contenders);
  fmt::print(
      "\nmean free path {} R0; bricks of {:.1f} R0, {:.0f} bytes a particle; rasters of {:.0f} and {:.0f} MB, bricks "
      "of {} and {} R0\n",
      free_path, stats.brick / radius, static_cast<double>(stats.bytes) / static_cast<double>(stats.balls),
      coarse.megabytes(), fine.megabytes(), coarse_bricks, fine_bricks);
  fmt::print("  {:<24}{:>12}{:>16}{:>12}\n", "", "M samples/s", "mean length/R0", "collided");
  for (const Contender& c : contenders)
    fmt::print("  {:<24}{:>12.2f}{:>16.2f}{:>12.4f}\n", c.name, c.rate(), c.mean_length, c.collided);
  const double ours = contenders[0].rate();
  const double coarse_bar = free_path < 50 ? 0.6 : 0.9;
  const auto print_ratio = [&](const Contender& c, double bar) {
    const double ratio = ours / c.rate();
    fmt::print("  to the {}: {:.2f} (bar {:.1f}: {})\n", c.name, ratio, bar, ratio >= bar ? "ok" : "BELOW");
  };
  print_ratio(contenders[4], 1.0);
  print_ratio(contenders[3], coarse_bar);
  if (exceeded != 0) fmt::print("  {} majorants were too small\n", exceeded);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::vector<Vec3> positions;
    for (const Vec3d& p : read_particles(argc > 1 ? argv[1] : EMBRUN_DATA_DIR "/dam_break.bgeo").positions)
      positions.push_back(to_float(p));
    // From random places near particles, as the vertices of paths are, in all directions.
    std::mt19937 random(2);
    std::uniform_int_distribution<std::size_t> pick(0, positions.size() - 1);
    std::normal_distribution<float> normal;
    std::vector<DensityRay> rays(ray_count);
    for (DensityRay& ray : rays) {
      ray.origin = positions[pick(random)] + 0.5f * radius * Vec3{normal(random), normal(random), normal(random)};
      ray.direction = normalize(Vec3{normal(random), normal(random), normal(random)});
    }
    for (const float free_path : {10.0f, 100.0f}) bench(positions, rays, free_path);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_media: {}\n", error.what());
    return 1;
  }
}

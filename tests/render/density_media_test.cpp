// What the grid of a fluid's particles lets through against what the particles do, which the oracle of the media's tests
// knows in double precision.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "media/density_oracle.h"
#include "media/grid_flight.h"
#include "render/fluid_meshes.h"
#include "scene/compile_media.h"

namespace embrun {
namespace {

struct Line {
  Vec3d origin, direction;
  double length;
};

/// Lines through a ball of that radius, all alike: over such the mean depth is what is in it over its section, whatever is
/// moved about inside.
std::vector<Line> random_lines(std::mt19937& random, int count, double radius) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-radius, radius);
  std::vector<Line> lines;
  while (static_cast<int>(lines.size()) < count) {
    const Vec3d direction = normalize(Vec3d{normal(random), normal(random), normal(random)});
    const Vec3d u = normalize(cross(direction, std::abs(direction.x) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    const Vec3d beside = uniform(random) * u + uniform(random) * cross(direction, u);
    if (length(beside) <= radius) lines.push_back({beside - radius * direction, direction, 2 * radius});
  }
  return lines;
}

/// The fluid of the oracle's particles as a mesh, what is in it on a grid of a share of their radius.
GridMediumData grid_of(const test::Particles& particles, double radius, double share) {
  SceneDescription scene;
  FluidDescription fluid;
  for (const test::OracleBall& ball : particles.oracle.fluids[0]) {
    fluid.positions.push_back(ball.center);
    fluid.radii.push_back(static_cast<float>(ball.radius));
  }
  fluid.surface.radius = static_cast<float>(radius);
  fluid.method = SurfaceMethod::mesh;
  fluid.density_cell = share * radius;
  fluid.medium.emplace();
  fluid.medium->extinction = particles.inputs[0].extinction;
  fluid.medium->densities = particles.inputs[0].factors;
  scene.fluids.push_back(fluid);
  const SceneDescription grids = with_grid_media(scene);
  const Vec3 far{10, 10, 10};
  return compile_grid_medium(grids.grid_media.at(0), {}, {-far, far});
}

/// The optical depth of a line through the grid, by fine steps.
double grid_depth(const GridMedium& medium, const Line& line) {
  constexpr int steps = 2000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const Vec3 p =
        medium.to_extinction.point(to_float(line.origin + ((i + 0.5) / steps * line.length) * line.direction));
    if (min_of(min_of(p.x, p.y), p.z) < 0 || max_of(max_of(p.x, p.y), p.z) > 1) continue;
    sum += static_cast<double>(value_at(medium.extinction, p).r);
  }
  return sum * line.length / steps;
}

// A grid knows the particles to about a cell at the edges of each ball, too much or too little alike: the error of a depth
// falls with the cell, and its mean is none. Flights then get through as often as past the particles, but for what the
// mean of exp makes of that error, half its square.
TEST(DensityMedia, LetThroughWhatTheParticlesLetThrough) {
  std::mt19937 random(7);
  constexpr double radius = 0.05;
  test::Particles particles;
  particles.add_fluid(random, 500, 0.6f, static_cast<float>(radius), 1.5f, 6.0f);
  const std::vector<Line> lines = random_lines(random, 1500, 0.7);
  std::vector<double> exact;
  for (const Line& line : lines)
    exact.push_back(test::OracleRay(particles.oracle, line.origin, line.direction, 0, line.length).total[0]);

  double coarser = infinity;
  for (const double share : {1.0, 0.5, 0.25}) {
    const GridMediumData data = grid_of(particles, radius, share);
    const GridMedium& medium = data.view();
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const double error = grid_depth(medium, lines[i]) - exact[i];
      sum += error;
      squares += error * error;
    }
    const auto count = static_cast<double>(lines.size());
    const double mean = sum / count, rms = std::sqrt(squares / count);
    EXPECT_LT(std::abs(mean), 4 * rms / std::sqrt(count)) << share;
    EXPECT_LT(rms, 0.7 * coarser) << share;
    coarser = rms;

    std::uint64_t exceeded = 0;
    double passed = 0, expected = 0, variance = 0;
    constexpr int flights = 100;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const DensityRay ray{to_float(lines[i].origin), to_float(lines[i].direction), 0,
                           static_cast<float>(lines[i].length)};
      const double through = std::exp(-exact[i]);
      for (std::uint32_t flight = 0; flight < flights; ++flight) {
        RandomStream stream({1, static_cast<std::uint32_t>(i), flight, 0}, Dimension::camera_film);
        const float depth = flight_depth(stream.next_pair().x);
        passed += track_grid_flight(medium, ray, 0, depth, stream, exceeded).collided ? 0 : 1;
        expected += through;
        variance += through * (1 - through);
      }
    }
    const double all = count * flights;
    EXPECT_EQ(exceeded, 0u);
    EXPECT_NEAR(passed / all, expected / all,
                4 * std::sqrt(variance) / all + 4 * rms / std::sqrt(count) + 0.5 * rms * rms)
        << share;
  }
}

}  // namespace
}  // namespace embrun

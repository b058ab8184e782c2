// The structure itself: extreme inputs, majorants, and what a collision tells of colours.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "density_oracle.h"
#include "media/particle_flight.h"

namespace embrun {
namespace {

using test::OracleRay;
using test::Particles;

RandomStream stream(std::uint32_t sample) { return {SampleKey{3, 1, sample, 4}, Dimension::free_flight}; }

DensityParticles particles_at(const std::vector<Vec3>& positions, float radius, Rgb extinction) {
  DensityParticles particles;
  particles.positions = positions;
  particles.radius = radius;
  particles.extinction = extinction;
  particles.albedo = grey(0.8f);
  return particles;
}

float depth_along_x(const ParticleDensity& density, float y = 0) {
  return optical_depth(density.view(), {{-10, y, 0}, {1, 0, 0}}).g;
}

TEST(ParticleDensity, OneBallHasItsChord) {
  const std::vector<Vec3> one{{0.5f, 0, 0}};
  const DensityParticles particles = particles_at(one, 0.25f, grey(2));
  const ParticleDensity density({&particles, 1}, MediaOverlap::sum);
  EXPECT_NEAR(depth_along_x(density), 2 * 0.5, 1e-5);
  EXPECT_NEAR(depth_along_x(density, 0.15f), 2 * 0.4, 1e-5);  // 3-4-5
  EXPECT_EQ(depth_along_x(density, 0.2501f), 0);
  // From its middle, half of it.
  EXPECT_NEAR(optical_depth(density.view(), {{0.5f, 0, 0}, {0, 1, 0}}).r, 2 * 0.25, 1e-6);
  // The whole line behind the ray's start does not count.
  EXPECT_EQ(optical_depth(density.view(), {{1, 0, 0}, {1, 0, 0}}).r, 0);
}

TEST(ParticleDensity, NothingIsThereWithoutParticlesOrExtinction) {
  const std::vector<Vec3> none, two{{0, 0, 0}, {0.1f, 0, 0}};
  const DensityParticles empty = particles_at(none, 0.1f, grey(1)), clear = particles_at(two, 0.1f, {}),
                         point = particles_at(two, 0, grey(1));
  for (const DensityParticles& particles : {empty, clear, point}) {
    const ParticleDensity density({&particles, 1}, MediaOverlap::sum);
    EXPECT_EQ(density.view().present, 0u);
    std::uint64_t exceeded = 0;
    RandomStream random = stream(0);
    for (const FlightSampler sampler : {FlightSampler::tracking, FlightSampler::events}) {
      const DensityRay ray{{-1, 0, 0}, {1, 0, 0}};
      EXPECT_FALSE(next_collision(density.view(), ray, sampler, 0, 0.9f, random, exceeded).collided);
      EXPECT_EQ(transmittance(density.view(), ray, sampler, random, exceeded), grey(1));
    }
  }
  const ParticleDensity nothing({}, MediaOverlap::sum);
  EXPECT_EQ(optical_depth(nothing.view(), {{-1, 0, 0}, {1, 0, 0}}).r, 0);
}

// Where balls coincide their mean counts, however many they are.
TEST(ParticleDensity, CoincidentBallsAreAveraged) {
  const std::vector<Vec3> many(1000, Vec3{0.1f, 0.2f, 0});
  DensityParticles particles = particles_at(many, 0.3f, grey(4));
  for (std::size_t i = 0; i < many.size(); ++i) particles.factors.push_back(i < 500 ? 0.5f : 1.0f);
  const ParticleDensity density({&particles, 1}, MediaOverlap::sum);
  EXPECT_NEAR(depth_along_x(density, 0.2f), 4 * 0.75 * 0.6, 1e-4);
}

// 85 balls over one point, as real bubbles and foam have it, and sizes from 1e-4 to 1 side by side.
TEST(ParticleDensity, AgreesWithBruteForceAtExtremeDensities) {
  struct Crowd {
    int count;
    float size, radius, spread;
  };
  for (const Crowd& crowd : {Crowd{85, 0.02f, 0.1f, 1}, Crowd{2000, 1, 1, 1e-4f}, Crowd{3000, 1e-3f, 1e-4f, 1}}) {
    std::mt19937 random(8);
    Particles particles;
    particles.add_fluid(random, crowd.count, crowd.size, crowd.radius, crowd.spread, 2 / crowd.size);
    const ParticleDensity density = particles.build(MediaOverlap::sum);
    std::normal_distribution<float> normal;
    for (int i = 0; i < 50; ++i) {
      const Vec3 through = 0.2f * crowd.size * Vec3{normal(random), normal(random), normal(random)};
      const Vec3 direction = normalize(Vec3{normal(random), normal(random), normal(random)});
      const Vec3 origin = through - 2 * (crowd.size + crowd.radius) * direction;
      const OracleRay oracle(particles.oracle, to_double(origin), normalize(to_double(direction)), 0, 100);
      const double expected = std::exp(-oracle.total[1]);
      EXPECT_NEAR(exp_of(optical_depth(density.view(), {origin, direction}) * -1).g, expected, 1e-5);
    }
  }
}

// A few particles at the other end of the world neither blow up the grid nor cost the others their precision.
TEST(ParticleDensity, StraysDoNoHarm) {
  std::mt19937 random(9);
  Particles particles;
  particles.add_fluid(random, 5000, 1, 0.04f, 1, 5);
  particles.positions[0].push_back({1e6f, -2e6f, 3e5f});
  particles.radii[0].push_back(0.04f);
  particles.inputs[0].factors.push_back(1);
  const ParticleDensity density = particles.build(MediaOverlap::sum);
  EXPECT_LT(density.stats().bytes, 60'000'000u);
  for (int i = 0; i < 20; ++i) {
    const Vec3 direction = normalize(Vec3{1, 0.1f * static_cast<float>(i) - 1, 0.3f});
    const Vec3 origin = -2 * direction;
    const OracleRay oracle(particles.oracle, to_double(origin), normalize(to_double(direction)), 0, 100);
    EXPECT_NEAR(exp_of(optical_depth(density.view(), {origin, direction}) * -1).g, std::exp(-oracle.total[1]), 1e-5);
  }
}

// The result must not depend on how the space is divided: bricks of any size.
TEST(ParticleDensity, BricksOfAnySizeGiveTheSame) {
  for (const float brick : {0.01f, 0.05f, 0.3f, 5.0f}) {
    std::mt19937 random(10);
    Particles particles;
    particles.add_fluid(random, 500, 1, 0.07f, 1, 5);
    const ParticleDensity density = particles.build(MediaOverlap::sum, brick);
    const Vec3 direction = normalize(Vec3{1, 0.3f, -0.2f});
    const OracleRay oracle(particles.oracle, {-1, 0, 0}, normalize(to_double(direction)), 0, 100);
    EXPECT_NEAR(optical_depth(density.view(), {{-1, 0, 0}, direction}).b, oracle.total[2], 2e-5) << brick;
  }
}

// Directions along the axes, on faces of cells.
TEST(ParticleDensity, AxisParallelRaysEnd) {
  std::vector<Vec3> lattice;
  for (int i = 0; i < 1000; ++i)
    lattice.push_back({0.1f * static_cast<float>(i % 10), 0.1f * static_cast<float>(i / 10 % 10),
                       0.1f * static_cast<float>(i / 100)});
  const DensityParticles particles = particles_at(lattice, 0.05f, grey(3));
  const ParticleDensity density({&particles, 1}, MediaOverlap::sum);
  // Along a row of ten balls that touch.
  EXPECT_NEAR(depth_along_x(density), 3 * 1.0, 1e-4);
  const CellGrid& grid = density.view().bricks[0].grid;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 direction, origin = grid.low + grid.cell;
    direction[axis] = 1;
    origin[axis] = -5;
    EXPECT_TRUE(is_finite(optical_depth(density.view(), {origin, direction}).r));
    direction[axis] = -1;
    EXPECT_TRUE(is_finite(optical_depth(density.view(), {origin, direction}).r));
  }
}

// Every point's extinction is below its brick's majorant, and the bound is not idle.
TEST(ParticleDensity, MajorantsHold) {
  for (const DensityModel model : {DensityModel::balls, DensityModel::smooth}) {
    std::mt19937 random(12);
    Particles particles;
    particles.add_fluid(random, 1500, 1, 0.06f, 0.5f, 5);
    particles.add_fluid(random, 1500, 1, 0.06f, 0.5f, 5, true);
    for (DensityParticles& input : particles.inputs) {
      input.model = model;
      input.volume = 0.001f;
    }
    const ParticleDensity density = particles.build(MediaOverlap::sum);
    const ParticleDensityView& view = density.view();
    std::uniform_real_distribution<float> uniform(0, 1);
    float closest = 0;
    for (int i = 0; i < 200000; ++i) {
      const Vec3 at{uniform(random), uniform(random), uniform(random)};
      const Vec3 p =
          view.grid.low + Vec3{at.x * (view.grid.high() - view.grid.low).x, at.y * (view.grid.high() - view.grid.low).y,
                               at.z * (view.grid.high() - view.grid.low).z};
      const GridWalk walk(view.grid, p, {1, 0, 0}, 0, 1e-6f);
      if (walk.done || view.brick_index[walk.index()] == no_brick) continue;
      const DensityBrick& brick = view.bricks[view.brick_index[walk.index()]];
      const DensityCell* cell = cell_at(view, brick, p);
      if (cell == nullptr) continue;
      const Rgb k = extinction_in_cell(view, *cell, p, ~0u);
      const Rgb majorant = view.majorant(walk.index());
      EXPECT_FALSE(exceeds(k, majorant));
      closest = max_of(closest, k.r / majorant.r);
    }
    EXPECT_GT(closest, model == DensityModel::balls ? 0.9f : 0.5f);
  }
}

// A majorant that is too small is noticed in any build.
TEST(ParticleDensity, AMajorantThatIsTooSmallIsCounted) {
  std::mt19937 random(13);
  Particles particles;
  particles.add_fluid(random, 500, 1, 0.08f, 1, 5);
  const ParticleDensity density = particles.build(MediaOverlap::sum);
  const CellGrid& grid = density.view().grid;
  std::vector<float> majorants(density.view().majorants[0], density.view().majorants[0] + grid.nx * grid.ny * grid.nz);
  for (float& majorant : majorants) majorant *= 0.3f;
  ParticleDensityView wrong = density.view();
  for (const float*& channel : wrong.majorants) channel = majorants.data();
  std::uint64_t exceeded = 0;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    RandomStream numbers = stream(i);
    next_collision(wrong, {{-1, 0, 0}, {1, 0, 0}}, FlightSampler::tracking, 0, numbers.next_pair().x, numbers,
                   exceeded);
  }
  EXPECT_GT(exceeded, 100u);
}

// The smooth density is that of the solvers: rest volume times the sum of the normalised kernel. On a lattice at rest
// spacing it is the extinction itself, nearly everywhere the same.
TEST(ParticleDensity, TheSmoothModelFillsTheFluid) {
  std::vector<Vec3> lattice;
  const int side = 24;
  for (int i = 0; i < side * side * side; ++i)
    lattice.push_back({0.1f * static_cast<float>(i % side), 0.1f * static_cast<float>(i / side % side),
                       0.1f * static_cast<float>(i / side / side)});
  DensityParticles particles = particles_at(lattice, 0.05f, grey(3));
  particles.model = DensityModel::smooth;
  particles.volume = 0.001f;
  const ParticleDensity density({&particles, 1}, MediaOverlap::sum);
  std::uint64_t exceeded = 0;
  constexpr int samples = 20000;
  double sum = 0, squares = 0;
  for (std::uint32_t i = 0; i < samples; ++i) {
    RandomStream numbers = stream(i);
    const DensityRay ray{{0.73f, 0.98f, 1.21f}, {1, 0, 0}, 0, 0.6f};
    const double t =
        static_cast<double>(transmittance(density.view(), ray, FlightSampler::tracking, numbers, exceeded).g);
    sum += t;
    squares += t * t;
  }
  const double mean = sum / samples, error = std::sqrt((squares / samples - mean * mean) / samples);
  // The kernel's sum over a lattice of half its reach is 1 to about half a per cent.
  EXPECT_NEAR(mean, std::exp(-3 * 0.6), 4 * error + 0.006 * 1.8 * std::exp(-1.8));
  EXPECT_EQ(exceeded, 0u);
}

// Scattering, absorption and emission are averaged each, not the albedo: a strong dark ball and a weak white one.
TEST(ParticleDensity, ScatteringAndAbsorptionAreAveragedEach) {
  const std::vector<Vec3> two{{0, 0, 0}, {0, 0, 0}};
  DensityParticles particles = particles_at(two, 0.5f, {});
  particles.extinctions = {{8, 8, 8}, {2, 2, 1}};
  particles.albedos = {{0, 0.25f, 0}, {1, 1, 0.5f}};
  particles.emission = {{3, 0, 0}, {7, 7, 7}};
  const ParticleDensity density({&particles, 1}, MediaOverlap::sum);
  std::uint64_t exceeded = 0;
  for (const FlightSampler sampler : {FlightSampler::tracking, FlightSampler::events}) {
    Flight flight;
    for (std::uint32_t i = 0; !flight.collided; ++i) {
      RandomStream numbers = stream(i);
      flight =
          next_collision(density.view(), {{-1, 0, 0}, {1, 0, 0}}, sampler, 1, numbers.next_pair().x, numbers, exceeded);
    }
    EXPECT_NEAR(flight.local.extinction.r, 5, 1e-5);
    EXPECT_NEAR(flight.local.extinction.b, 4.5, 1e-5);
    EXPECT_NEAR(flight.local.albedo.r, (8 * 0.0 + 2 * 1) / 10, 1e-6);
    EXPECT_NEAR(flight.local.albedo.g, (8 * 0.25 + 2 * 1) / 10, 1e-6);
    EXPECT_NEAR(flight.local.albedo.b, (8 * 0.0 + 1 * 0.5) / 9, 1e-6);
    // Absorption times radiance over extinction.
    EXPECT_NEAR(flight.local.emission.r, (8 * 3 + 0) / 10.0, 1e-5);
    EXPECT_NEAR(flight.local.emission.g, 0, 1e-6);
    EXPECT_NEAR(flight.local.emission.b, (0.5 * 7) / 9.0, 1e-5);
  }
}

}  // namespace
}  // namespace embrun

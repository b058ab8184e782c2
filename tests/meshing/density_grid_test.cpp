#include "meshing/density_grid.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "base/error.h"

namespace embrun {
namespace {

struct Particles {
  std::vector<Vec3> positions;
  std::vector<float> radii;
  DensityParticles density;

  const DensityParticles& view() {
    density.positions = positions;
    density.radii = radii;
    return density;
  }
};

std::vector<Vec3> random_points(std::size_t count, float side, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<float> uniform(-0.5f * side, 0.5f * side);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) p = {uniform(generator), uniform(generator), uniform(generator)};
  return points;
}

/// Every cell of a grid by its place: calls visit(index into the arrays / channels, its low corner).
template <class Visit>
void for_cells(const DensityGrid& grid, const Visit& visit) {
  for (std::size_t tile = 0; tile < grid.tiles.size(); ++tile) {
    for (std::size_t cell = 0; cell < DensityGrid::tile_cells; ++cell) {
      const auto place = [&](std::size_t axis, std::size_t in_tile) {
        return static_cast<double>(grid.tiles[tile][axis] * DensityGrid::tile_side + static_cast<int>(in_tile));
      };
      const Vec3d low{place(0, cell % 8), place(1, cell / 8 % 8), place(2, cell / 64)};
      visit(tile * DensityGrid::tile_cells + cell, to_double(grid.origin) + static_cast<double>(grid.cell) * low);
    }
  }
}

double integral(const DensityGrid& grid) {
  double sum = 0;
  for (const float v : grid.extinction) sum += static_cast<double>(v);
  return sum * std::pow(static_cast<double>(grid.cell), 3) / grid.channels;
}

// Apart from each other they fill their volumes; which points of a cell a ball holds is chance, so by two per cent of
// each ball and a third of that over all.
TEST(DensityGrid, OfLoneBallsIsTheirVolume) {
  Particles p;
  for (const Vec3 shift : random_points(60, 0.05f, 1)) {
    const auto i = static_cast<float>(p.positions.size());
    p.positions.push_back(Vec3{0.3f * i, 0.1f * i, 0} + shift);
  }
  p.density.radius = 0.05f;
  p.density.extinction = grey(3);
  const DensityGrid grid = sample_density(p.view(), 0.025f);
  EXPECT_EQ(grid.channels, 1);
  EXPECT_TRUE(grid.albedo.empty());
  EXPECT_NEAR(integral(grid) / (60 * 3 * 4.0 / 3.0 * 3.14159265 * 1.25e-4), 1.0, 0.007);
  for (const float v : grid.extinction) {
    EXPECT_GE(v, 0.0f);
    EXPECT_LE(v, 3.0f * (1 + 1e-6f));
  }
}

// The definition at the points of a cell, in double: what balls hold a point is averaged, cells are the means of 4^3.
TEST(DensityGrid, AveragesBallsThatOverlap) {
  std::mt19937 generator(2);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  Particles p;
  p.positions = random_points(400, 0.6f, 3);
  p.density.radius = 0.05f;
  for (std::size_t i = 0; i < p.positions.size(); ++i) {
    p.radii.push_back(i % 10 == 0 ? 0.0f : 0.03f + 0.05f * uniform(generator));
    p.density.extinctions.push_back({uniform(generator), 2 * uniform(generator), 5 * uniform(generator)});
    p.density.albedos.push_back({uniform(generator), uniform(generator), uniform(generator)});
  }
  const DensityGrid grid = sample_density(p.view(), 0.03f);
  ASSERT_EQ(grid.channels, 3);
  ASSERT_EQ(grid.albedo.size(), grid.extinction.size() / 3);
  std::size_t cells = 0, filled = 0;
  for_cells(grid, [&](std::size_t index, Vec3d low) {
    if (index % 37 != 0) return;
    double k[3] = {}, scattering[3] = {};
    for (int point = 0; point < 64; ++point) {
      const Vec3d x =
          low + 0.25 * static_cast<double>(grid.cell) * Vec3d{point % 4 + 0.5, point / 4 % 4 + 0.5, point / 16 + 0.5};
      double sum[3] = {}, scattered[3] = {};
      int count = 0;
      for (std::size_t i = 0; i < p.positions.size(); ++i) {
        if (!(length(x - to_double(p.positions[i])) < static_cast<double>(p.radii[i]))) continue;
        ++count;
        for (int c = 0; c < 3; ++c) {
          sum[c] += static_cast<double>(p.density.extinctions[i][c]);
          scattered[c] += static_cast<double>(p.density.extinctions[i][c] * p.density.albedos[i][c]);
        }
      }
      for (int c = 0; c < 3 && count > 0; ++c) {
        k[c] += sum[c] / count / 64;
        scattering[c] += scattered[c] / count / 64;
      }
    }
    ++cells;
    filled += k[0] > 0;
    for (int c = 0; c < 3; ++c) {
      // A point within rounding of a ball's edge counts a sixty-fourth.
      EXPECT_NEAR(grid.extinction[3 * index + static_cast<std::size_t>(c)], k[c], 1e-4);
      const double albedo = k[c] > 0 ? scattering[c] / k[c] : 0;
      EXPECT_NEAR(grid.albedo[index][c], albedo, 1e-3);
    }
  });
  EXPECT_GT(filled, 200u);
  EXPECT_GT(cells, filled);
}

// A sum over particles, by the solvers' cubic spline of support 4 R (its norm 8/(pi h^3)): at the cells' middles, and so
// that all of it is the particles' volumes.
TEST(DensityGrid, SumsSmoothParticles) {
  Particles p;
  p.positions = random_points(200, 0.4f, 5);
  p.density.model = DensityModel::smooth;
  p.density.radius = 0.03f;
  p.density.volume = 0.06f * 0.06f * 0.06f;
  p.density.extinction = grey(2);
  const DensityGrid grid = sample_density(p.view(), 0.02f);
  ASSERT_EQ(grid.channels, 1);
  const double h = 4 * 0.03;
  for_cells(grid, [&](std::size_t index, Vec3d low) {
    if (index % 53 != 0) return;
    const Vec3d x = low + 0.5 * static_cast<double>(grid.cell) * Vec3d{1, 1, 1};
    double sum = 0;
    for (const Vec3 center : p.positions) {
      const double u = length(x - to_double(center)) / h;
      const double w = u < 0.5 ? 6 * (u * u * u - u * u) + 1 : u < 1 ? 2 * std::pow(1 - u, 3) : 0;
      sum += static_cast<double>(p.density.volume) * 8 / (3.14159265358979 * h * h * h) * w;
    }
    EXPECT_NEAR(grid.extinction[index], 2 * sum, 1e-4 * (1 + sum));
  });
  EXPECT_NEAR(integral(grid) / (200 * 2 * 0.000216), 1.0, 2e-3);
}

TEST(DensityGrid, LeavesOutWhatIsNotThere) {
  Particles p;
  p.density.radius = 0.1f;
  EXPECT_TRUE(sample_density(p.view(), 0.05f).tiles.empty());
  p.positions = {{0, 0, 0}, {1, 1, 1}};
  p.radii = {0, 0};
  EXPECT_TRUE(sample_density(p.view(), 0.05f).tiles.empty());
  p.radii = {0, 0.1f};
  p.density.extinction = grey(1);
  const DensityGrid grid = sample_density(p.view(), 0.05f);
  EXPECT_LE(grid.tiles.size(), 8u);
  EXPECT_NEAR(integral(grid) / (4.0 / 3.0 * 3.14159265 * 1e-3), 1.0, 0.03);
}

TEST(DensityGrid, DoesNotDependOnTheNumberOfThreads) {
  Particles p;
  p.positions = random_points(3000, 1, 6);
  p.density.radius = 0.03f;
  p.density.extinction = grey(1);
  for (std::size_t i = 0; i < p.positions.size(); ++i)
    p.density.factors.push_back(1 + 0.1f * static_cast<float>(i % 7));
  DensityGrid grids[2];
  for (int i = 0; i < 2; ++i) {
    tbb::task_arena arena(i == 0 ? 1 : 7);
    arena.execute([&] { grids[i] = sample_density(p.view(), 0.015f); });
  }
  EXPECT_EQ(grids[0].tiles, grids[1].tiles);
  EXPECT_EQ(grids[0].extinction, grids[1].extinction);
  // Cells of two grids coincide wherever their particles lie.
  EXPECT_NEAR(std::remainder(grids[0].origin.x, 8 * 0.015f), 0, 1e-6);
}

TEST(DensityGrid, RefusesCellsTooFine) {
  Particles p;
  p.positions = {{0, 0, 0}, {1e6f, 0, 0}};
  p.density.radius = 1;
  EXPECT_THROW(sample_density(p.view(), 1e-3f), Error);
}

}  // namespace
}  // namespace embrun

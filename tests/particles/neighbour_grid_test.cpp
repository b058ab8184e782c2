#include "particles/neighbour_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace embrun {
namespace {

std::vector<Vec3d> random_points(std::size_t count, double extent, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> coordinate(-extent, extent);
  std::vector<Vec3d> points(count);
  for (Vec3d& p : points) {
    p.x = coordinate(random);
    p.y = coordinate(random);
    p.z = coordinate(random);
  }
  return points;
}

std::vector<std::uint32_t> found(const NeighbourGrid& grid, Vec3d p, double radius) {
  std::vector<std::uint32_t> indices;
  grid.for_each_within(p, radius, [&](std::uint32_t i, Vec3d, double distance_squared) {
    EXPECT_LE(distance_squared, radius * radius);
    indices.push_back(i);
  });
  std::sort(indices.begin(), indices.end());
  return indices;
}

std::vector<std::uint32_t> brute_force(const std::vector<Vec3d>& points, Vec3d p, double radius) {
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3d d = points[i] - p;
    if (dot(d, d) <= radius * radius) indices.push_back(static_cast<std::uint32_t>(i));
  }
  return indices;
}

TEST(NeighbourGrid, FindsWhatBruteForceFinds) {
  const std::vector<Vec3d> points = random_points(2000, 1, 1);
  const std::vector<Vec3d> places = random_points(200, 1.3, 2);
  for (const double cell : {0.03, 0.2, 5.0}) {
    const NeighbourGrid grid(points, cell);
    for (const double radius : {0.0, 0.05, 0.2, 0.9}) {
      for (const Vec3d p : places) EXPECT_EQ(found(grid, p, radius), brute_force(points, p, radius));
    }
  }
}

// Cells exist only where points are: two clouds a light year apart cost nothing between them.
TEST(NeighbourGrid, SparseDomainsCostNothing) {
  std::vector<Vec3d> points = random_points(500, 1, 3);
  for (Vec3d p : random_points(500, 1, 4)) points.push_back(p + Vec3d{9e14, -9e14, 9e14});
  const NeighbourGrid grid(points, 0.25);
  EXPECT_LE(grid.cell_count(), 1000u);
  for (const std::size_t i : {3u, 700u}) EXPECT_EQ(found(grid, points[i], 0.5), brute_force(points, points[i], 0.5));
  EXPECT_TRUE(found(grid, {1e200, -1e200, 0}, 1).empty());
  EXPECT_EQ(found(grid, {0, 0, 0}, 1e16).size(), 1000u);
}

TEST(NeighbourGrid, CoincidentPointsAreAllFound) {
  const std::vector<Vec3d> points(1000, Vec3d{1, 2, 3});
  const NeighbourGrid grid(points, 1e-3);
  EXPECT_EQ(grid.cell_count(), 1u);
  EXPECT_EQ(grid.points_in_cell_of({1, 2, 3}), 1000u);
  EXPECT_EQ(found(grid, {1, 2, 3}, 0).size(), 1000u);
}

TEST(NeighbourGrid, AVisitorCanStop) {
  const std::vector<Vec3d> points = random_points(100, 1, 5);
  for (const double cell : {0.1, 10.0}) {
    int visits = 0;
    NeighbourGrid(points, cell).for_each_within({0, 0, 0}, 3, [&](std::uint32_t, Vec3d, double) {
      return ++visits < 7;
    });
    EXPECT_EQ(visits, 7);
  }
}

TEST(NeighbourGrid, NoPoints) {
  const NeighbourGrid grid({}, 1);
  EXPECT_EQ(grid.cell_count(), 0u);
  EXPECT_TRUE(found(grid, {0, 0, 0}, 1).empty());
  EXPECT_EQ(grid.points_in_cell_of({0, 0, 0}), 0u);
}

}  // namespace
}  // namespace embrun

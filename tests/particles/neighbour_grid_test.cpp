#include "particles/neighbour_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
  EXPECT_EQ(grid.cell_points(0), 1000u);
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
}

TEST(GridCells, CountThePointsThatShareACell) {
  // Of a third of a unit, with points in clusters and one far away.
  std::vector<Vec3d> points = random_points(40000, 2, 7);
  for (Vec3d p : random_points(30000, 1, 8)) points.push_back(p * 0.1);
  points.push_back({1e6, 0, 0});
  const std::vector<std::size_t> which{0, 39999, 40000, 69999, 70000, 17, 17};
  const GridCells cells(box_of(points), 1.0 / 3);
  const std::vector<std::size_t> counts = points_sharing_cells(cells, points, which);
  Vec3d low = points[0];
  for (const Vec3d p : points) low = min_of(low, p);
  const auto number = [&](double v) { return static_cast<long>(std::floor(3 * v)); };
  ASSERT_EQ(counts.size(), which.size());
  for (std::size_t w = 0; w < which.size(); ++w) {
    const Vec3d at = points[which[w]] - low;
    std::size_t expected = 0;
    for (const Vec3d p : points) {
      const Vec3d d = p - low;
      expected += number(d.x) == number(at.x) && number(d.y) == number(at.y) && number(d.z) == number(at.z) ? 1 : 0;
    }
    EXPECT_EQ(counts[w], expected) << w;
  }
  EXPECT_EQ(counts[4], 1u);
  EXPECT_TRUE(points_sharing_cells(cells, points, {}).empty());
}

}  // namespace
}  // namespace embrun

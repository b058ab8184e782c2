// Estimation for point clouds against surfaces that are known in closed form, and against brute force.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <numeric>

#include "particles/cloud_cleaning.h"
#include "particles/cloud_normals.h"
#include "particles/cloud_shapes.h"
#include "particles/cloud_splats.h"
#include "particles/covariance.h"
#include "particles/point_tree.h"

namespace embrun {
namespace {

using namespace test;

TEST(PointTree, FindsWhatBruteForceFinds) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const std::size_t count : {1u, 2u, 13u, 100u, 3000u}) {
    std::vector<Vec3d> points;
    for (std::size_t i = 0; i < count; ++i) {
      const double x = unit(random), y = unit(random), z = unit(random);
      // Clusters of very different density, a lattice full of equal distances, and points in one place.
      const double scale = i % 3 == 0 ? 1e-3 : 1;
      points.push_back(i % 5 == 0 ? Vec3d{std::floor(8 * x), std::floor(8 * y), 0} : Vec3d{x, y, z} * scale);
    }
    const PointTree tree(points);
    for (std::size_t q = 0; q < std::min<std::size_t>(count, 300); ++q) {
      const Vec3d p = q % 2 ? points[q] : points[q] + Vec3d{unit(random), -0.3, 0.1};
      const std::uint32_t except = q % 2 ? static_cast<std::uint32_t>(q) : PointTree::none;
      std::vector<PointTree::Neighbour> expected;
      for (std::uint32_t i = 0; i < count; ++i) {
        if (i != except) expected.push_back({dot(points[i] - p, points[i] - p), i});
      }
      std::sort(expected.begin(), expected.end());
      std::vector<PointTree::Neighbour> found(17);
      ASSERT_EQ(tree.nearest(p, found, except), std::min<std::size_t>(17, expected.size()));
      for (std::size_t k = 0; k < std::min<std::size_t>(17, expected.size()); ++k) {
        ASSERT_EQ(found[k].index, expected[k].index) << count << " points, query " << q << ", neighbour " << k;
      }
    }
  }
}

TEST(PrincipalAxes, OfATurnedBrick) {
  // Corners of a brick of half extents 1, 2, 5: variances 1, 4, 25 along its axes.
  const Vec3d a = normalize(Vec3d{1, 2, 3}), b = normalize(cross(a, {0, 1, 0})), c = cross(a, b);
  CovarianceSums sums;
  for (int i = 0; i < 8; ++i) {
    sums.add(Vec3d{7, 8, 9} + a * (i & 1 ? 1 : -1) + b * (i & 2 ? 2 : -2) + c * (i & 4 ? 5 : -5));
  }
  const PrincipalAxes axes = principal_axes(sums);
  EXPECT_NEAR(axes.variance[0], 1, 1e-12);
  EXPECT_NEAR(axes.variance[1], 4, 1e-12);
  EXPECT_NEAR(axes.variance[2], 25, 1e-12);
  EXPECT_NEAR(std::abs(dot(axes.direction[0], a)), 1, 1e-12);
  EXPECT_NEAR(std::abs(dot(axes.direction[1], b)), 1, 1e-12);
  EXPECT_NEAR(std::abs(dot(axes.direction[2], c)), 1, 1e-12);
}

struct NormalErrors {
  double mean_degrees = 0;
  double flipped = 0;  // share
};

template <class Counts>
NormalErrors errors_of(const std::vector<Vec3>& normals, const SampledSurface& surface, const Counts& counts) {
  NormalErrors errors;
  double looked_at = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (!counts(surface.exact[i])) continue;
    const double cosine = dot(normalize(to_double(normals[i])), surface.normals[i]);
    errors.mean_degrees += std::acos(std::min(1.0, std::abs(cosine))) * 180 / 3.14159265358979;
    errors.flipped += cosine < 0;
    ++looked_at;
  }
  errors.mean_degrees /= looked_at;
  errors.flipped /= looked_at;
  return errors;
}

std::vector<Vec3> oriented_normals(const SampledSurface& surface, std::size_t* pieces = nullptr) {
  const PointTree tree(surface.points);
  const CloudShape shape = measure_cloud(tree, surface.points);
  EXPECT_TRUE(shape.is_surface) << shape.variation;
  std::vector<Vec3> normals = estimate_normals(tree, surface.points, shape.neighbours);
  const std::size_t count = orient_consistently(tree, surface.points, normals);
  if (pieces) *pieces = count;
  return normals;
}

const auto everywhere = [](Vec3d) { return true; };
// Where no neighbourhood that is used reaches round an edge.
const auto off_edges = [](Vec3d p) {
  int near = 0;
  for (const double x : {p.x, p.y, p.z}) near += std::abs(x) > 0.7;
  return near == 1;
};

/// A surface with noise of that share of the longest side of its bounds.
SampledSurface with_noise(SampledSurface (*sample)(std::size_t, double, std::uint64_t), std::size_t count,
                          double extent, double share, std::uint64_t seed) {
  return sample(count, share * extent, seed);
}

// The noise is 1 % of the shape's extent, which is a lot: 0.8 times the spacing of the sphere's points, 7 % of the torus's
// minor radius. Normals must be off by 2 degrees at most on average, 0.5 % of them flipped.
TEST(CloudNormals, OfNoisySurfaces) {
  constexpr double share = 0.01;
  struct Case {
    const char* name;
    SampledSurface surface;
    bool edges;
  };
  const Case cases[] = {{"sphere", with_noise(sample_sphere, 20000, 2, share, 1), false},
                        {"torus", with_noise(sample_torus, 20000, 2.8, share, 2), false},
                        {"box", with_noise(sample_box, 20000, 2, share, 3), true}};
  for (const Case& one : cases) {
    SCOPED_TRACE(one.name);
    std::size_t pieces = 0;
    const std::vector<Vec3> normals = oriented_normals(one.surface, &pieces);
    const NormalErrors errors =
        one.edges ? errors_of(normals, one.surface, off_edges) : errors_of(normals, one.surface, everywhere);
    RecordProperty(std::string(one.name) + "_degrees", std::to_string(errors.mean_degrees));
    EXPECT_LT(errors.mean_degrees, 2);
    EXPECT_LT(errors_of(normals, one.surface, everywhere).flipped, 0.005);
    EXPECT_EQ(pieces, 1u);
  }
}

// A box 1/20 as thick as wide: the two sides are near each other and must not be taken for one.
TEST(CloudNormals, ThinWallsFaceOutwards) {
  SampledSurface box = sample_box(20000, 0);
  for (std::size_t i = 0; i < box.points.size(); ++i) box.points[i].z *= 0.05;
  const NormalErrors errors = errors_of(oriented_normals(box), box, off_edges);
  EXPECT_LT(errors.flipped, 0.005);
}

TEST(CloudNormals, TwoPiecesAndASensor) {
  SampledSurface two = sample_sphere(3000, 0);
  const SampledSurface other = sample_torus(3000, 0);
  for (std::size_t i = 0; i < other.points.size(); ++i) {
    two.points.push_back(other.points[i] + Vec3d{10, 0, 0});
    two.normals.push_back(other.normals[i]);
  }
  two.exact = two.points;
  std::size_t pieces = 0;
  std::vector<Vec3> normals = oriented_normals(two, &pieces);
  EXPECT_EQ(pieces, 2u);
  EXPECT_EQ(errors_of(normals, two, everywhere).flipped, 0);
  // From the middle of the sphere all of its normals point inwards.
  orient_towards({0, 0, 0}, two.points, normals);
  EXPECT_EQ(errors_of(normals, two, [](Vec3d p) { return p.x < 5; }).flipped, 1);
}

TEST(CloudShape, MeasuresSpacingNoiseAndCurvature) {
  const SampledSurface sphere = sample_sphere(20000, 0.01);
  const CloudShape shape = measure_cloud(PointTree(sphere.points), sphere.points);
  // 20000 points on 4 pi.
  EXPECT_NEAR(shape.spacing, std::sqrt(4 * 3.14159265 / 20000), 0.1 * shape.spacing);
  EXPECT_NEAR(shape.noise, 0.01, 0.002);
  const SampledSurface clean = sample_sphere(20000, 0);
  const CloudShape exact = measure_cloud(PointTree(clean.points), clean.points);
  EXPECT_LT(exact.noise, 0.0005);
  EXPECT_NEAR(exact.curvature, 1, 0.2);
  EXPECT_EQ(exact.neighbours, 16u);
}

TEST(CloudShape, TellsSurfacesFromVolumesAndLines) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vec3d> volume, line, lattice;
  for (int i = 0; i < 5000; ++i) {
    const double x = unit(random), y = unit(random), z = unit(random);
    volume.push_back({x, y, z});
    line.push_back({x, 0.1 * x * x, 0.001 * y});
    lattice.push_back({static_cast<double>(i % 17), static_cast<double>(i / 17 % 17), static_cast<double>(i / 289)});
  }
  for (const auto* points : {&volume, &line, &lattice}) {
    EXPECT_FALSE(measure_cloud(PointTree(*points), *points).is_surface);
  }
}

/// Share of `places` on the true surface that no splat covers: in no splat's ellipse when projected into its plane.
double uncovered(const SampledSurface& surface, const std::vector<Vec3>& normals, const SplatSizes& sizes,
                 const std::vector<Vec3d>& places, const PointTree& tree) {
  std::size_t holes = 0;
  std::vector<PointTree::Neighbour> found(40);
  for (const Vec3d place : places) {
    bool covered = false;
    const std::size_t count = tree.nearest(place, found);
    for (std::size_t k = 0; k < count && !covered; ++k) {
      const std::uint32_t i = found[k].index;
      const Vec3d offset = place - surface.points[i], n = to_double(normals[i]);
      const Vec3d flat = offset - n * dot(offset, n);
      if (sizes.axes.empty()) {
        covered = length(flat) <= static_cast<double>(sizes.radii[i]);
      } else {
        const Vec3d a = to_double(sizes.axes[i].major), b = to_double(sizes.axes[i].minor);
        covered = std::hypot(dot(flat, a) / dot(a, a), dot(flat, b) / dot(b, b)) <= 1;
      }
    }
    holes += !covered;
  }
  return static_cast<double>(holes) / static_cast<double>(places.size());
}

TEST(CloudSplats, CloseTheSurface) {
  struct Case {
    const char* name;
    SampledSurface surface;
    std::vector<Vec3d> places;
  };
  const Case cases[] = {{"sphere", sample_sphere(6000, 0), sample_sphere(60000, 0, 21).points},
                        {"torus", sample_torus(6000, 0), sample_torus(60000, 0, 22).points},
                        {"noisy sphere", sample_sphere(6000, 0.005), sample_sphere(60000, 0, 23).points}};
  for (const auto& [name, surface, places] : cases) {
    SCOPED_TRACE(name);
    const PointTree tree(surface.points);
    const std::vector<Vec3> normals = oriented_normals(surface);
    const SplatSizes round = estimate_splats(tree, surface.points, normals, false);
    const SplatSizes oval = estimate_splats(tree, surface.points, normals, true);
    EXPECT_EQ(uncovered(surface, normals, round, places, tree), 0);
    EXPECT_EQ(uncovered(surface, normals, oval, places, tree), 0);
    // Nor more than it takes: a tenth less than the cells leaves holes.
    SplatSizes less = round;
    for (float& radius : less.radii) radius *= 0.9f / 1.05f;
    EXPECT_GT(uncovered(surface, normals, less, places, tree), 0);
    double discs = 0, ellipses = 0;
    for (std::size_t i = 0; i < round.radii.size(); ++i) {
      discs += static_cast<double>(round.radii[i]) * static_cast<double>(round.radii[i]);
      ellipses += static_cast<double>(length(oval.axes[i].major) * length(oval.axes[i].minor));
      EXPECT_NEAR(dot(oval.axes[i].major, oval.axes[i].minor), 0, 1e-6);
      EXPECT_NEAR(dot(oval.axes[i].major, normals[i]), 0, 1e-6);
    }
    EXPECT_LT(ellipses, discs);
    RecordProperty(std::string(name) + "_area", std::to_string(discs * 3.14159265 / (4 * 3.14159265)));
  }
}

// The cell of a square lattice of edge 1 is a unit square, its corners at sqrt(1/2); splats are 1.05 times as large.
TEST(CloudSplats, OnALatticeTheRadiusIsHalfTheDiagonal) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 900; ++i) points.push_back({static_cast<double>(i % 30), static_cast<double>(i / 30), 0});
  const std::vector<Vec3> normals(points.size(), Vec3{0, 0, 1});
  const SplatSizes sizes = estimate_splats(PointTree(points), points, normals, false);
  EXPECT_EQ(sizes.at_border, 4u * 29u);
  for (const float radius : sizes.radii) EXPECT_FLOAT_EQ(radius, 1.05f * std::sqrt(0.5f));
}

// On a lattice of 1 by 2 the ellipse is stretched: area pi * 1 against pi * 5/4.
TEST(CloudSplats, EllipsesFollowTheSpacing) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 1600; ++i) points.push_back({static_cast<double>(i % 40), 0, 2.0 * (i / 40)});
  const std::vector<Vec3> normals(points.size(), Vec3{0, 1, 0});
  const SplatSizes sizes = estimate_splats(PointTree(points), points, normals, true);
  const std::size_t middle = 20 * 40 + 20;
  EXPECT_NEAR(sizes.radii[middle], 1.05f * std::sqrt(1.25f), 1e-6f);
  // The cell is a rectangle of half widths 1/2 and 1; the least ellipse through its corners is the circle round a square,
  // stretched.
  EXPECT_NEAR(length(sizes.axes[middle].major), 1.05f * std::sqrt(2.0f), 1e-4f);
  EXPECT_NEAR(length(sizes.axes[middle].minor), 1.05f * std::sqrt(0.5f), 1e-4f);
  EXPECT_NEAR(std::abs(sizes.axes[middle].major.z), 1.05f * std::sqrt(2.0f), 1e-4f);
}

TEST(CloudCleaning, RemovesDuplicatesOutliersAndThins) {
  SampledSurface sphere = sample_sphere(5000, 0);
  // A sparse half: a tenth of the density is no outlier.
  std::vector<Vec3d> points;
  for (std::size_t i = 0; i < sphere.points.size(); ++i) {
    if (sphere.points[i].x < 0 || i % 10 == 0) points.push_back(sphere.points[i]);
  }
  const std::size_t clean = points.size();
  std::mt19937_64 random(4);
  // The mean distance to the k nearest of nu points a square metre is 2/3 sqrt(k / (pi nu)): 0.24 in the sparse half. All of
  // these are 4 times as far from the sphere or more; the last five huddle together.
  points.push_back({0, 0, 0});
  for (int i = 0; i < 19; ++i) points.push_back(random_direction(random) * 2.5);
  for (int i = 0; i < 5; ++i) points.push_back(Vec3d{-2.5, 0, 0} + random_direction(random) * 0.02);
  const PointSelection outliers = without_outliers(PointTree(points), points);
  std::size_t found = 0;
  for (std::size_t i = clean; i < points.size(); ++i) found += outliers.keep[i] == 0;
  EXPECT_EQ(found, 25u);
  EXPECT_LE(outliers.removed - found, clean / 500);

  points.resize(clean);
  for (std::size_t i = 0; i < 40; ++i) points.push_back(points[i % 20]);
  const PointSelection once = without_duplicates(points);
  EXPECT_EQ(once.removed, 40u);
  for (std::size_t i = 0; i < clean; ++i) EXPECT_EQ(once.keep[i], 1);

  // A lattice of spacing 1 under cubes of 2: one of each eight; all points of a row fall into cubes of their own at 0.5.
  std::vector<Vec3d> lattice;
  for (int i = 0; i < 1000; ++i) lattice.push_back({i % 10 + 0.1, i / 10 % 10 + 0.1, i / 100 + 0.1});
  EXPECT_EQ(thinned_by_voxels(lattice, 2).removed, 875u);
  EXPECT_EQ(thinned_by_voxels(lattice, 0.5).removed, 0u);
  EXPECT_EQ(thinned_by_voxels(lattice, 100).removed, 999u);
}

// Numbers of threads, and points that leave a neighbourhood without a plane.
TEST(CloudNormals, SameBitsForAnyNumberOfThreads) {
  const SampledSurface surface = sample_torus(5000, 0.01);
  std::vector<Vec3> normals[2];
  std::vector<float> radii[2];
  for (const std::size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const std::size_t run = threads == 1 ? 0 : 1;
    normals[run] = oriented_normals(surface);
    radii[run] = estimate_splats(PointTree(surface.points), surface.points, normals[run], false).radii;
  }
  EXPECT_EQ(normals[0], normals[1]);
  EXPECT_EQ(radii[0], radii[1]);
}

TEST(CloudNormals, DegenerateCloudsGiveUnitNormalsAndFiniteRadii) {
  const std::vector<Vec3d> clouds[] = {{{1, 2, 3}},
                                       {{1, 2, 3}, {1, 2, 3}},
                                       std::vector<Vec3d>(100, Vec3d{5, 5, 5}),
                                       {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}};
  for (const auto& points : clouds) {
    const PointTree tree(points);
    EXPECT_FALSE(measure_cloud(tree, points).is_surface);
    std::vector<Vec3> normals = estimate_normals(tree, points, 16);
    EXPECT_GE(orient_consistently(tree, points, normals), 1u);
    for (const Vec3 n : normals) EXPECT_NEAR(length(n), 1, 1e-5);
    const SplatSizes sizes = estimate_splats(tree, points, normals, true);
    for (const float radius : sizes.radii) EXPECT_TRUE(is_finite(radius));
    EXPECT_EQ(without_outliers(tree, points).removed, 0u);
  }
}

}  // namespace
}  // namespace embrun

#include "meshing/isosurface.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "base/error.h"
#include "io/read_particles.h"
#include "meshing/cube_cases.h"

namespace embrun {
namespace {

/// Every directed edge once, and its opposite once: closed, oriented, and two triangles at each edge.
void expect_closed(const TriangleMesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) edges.emplace_back(t[i], t[(i + 1) % 3]);
  }
  std::sort(edges.begin(), edges.end());
  EXPECT_TRUE(std::adjacent_find(edges.begin(), edges.end()) == edges.end()) << "an edge has two triangles on one side";
  std::size_t open = 0;
  for (const auto& [a, b] : edges) open += !std::binary_search(edges.begin(), edges.end(), std::pair(b, a));
  EXPECT_EQ(open, 0u);
}

std::vector<Vec3> random_drops(std::size_t count, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) p = {uniform(generator), uniform(generator), uniform(generator)};
  return points;
}

SurfaceSettings settings_of(float radius, int order) {
  SurfaceSettings settings;
  settings.radius = radius;
  settings.order = order;
  return settings;
}

TEST(CubeCases, UseJustTheCrossedEdges) {
  for (unsigned bits = 0; bits < 256; ++bits) {
    std::set<unsigned> crossed, used;
    for (unsigned edge = 0; edge < 12; ++edge) {
      const unsigned a = edge_base_corner(edge), b = a | 1u << (edge >> 2);
      if ((bits >> a & 1u) != (bits >> b & 1u)) crossed.insert(edge);
    }
    for (const auto& triangle : cube_cases().of(bits)) used.insert(triangle.begin(), triangle.end());
    EXPECT_EQ(used, crossed) << bits;
  }
}

TEST(CubeCases, NeverShareAnEdgeOfTheMeshMoreThanTwice) {
  // Two cells side by side with every pair of cases that agree on their common face: edges inside a cell or across the
  // face pair up; those on the outer faces appear once.
  const auto key = [](int cell, unsigned edge) {
    // An edge's place in the lattice of both cells, second one at x + 1.
    const unsigned c = edge_base_corner(edge);
    return std::array<int, 4>{static_cast<int>(edge >> 2), static_cast<int>(c & 1u) + cell,
                              static_cast<int>(c >> 1 & 1u), static_cast<int>(c >> 2)};
  };
  for (unsigned a = 0; a < 256; ++a) {
    for (unsigned b = 0; b < 256; ++b) {
      bool agree = true;
      for (unsigned c = 0; c < 8; c += 2) agree = agree && (a >> (c + 1) & 1u) == (b >> c & 1u);
      if (!agree) continue;
      std::map<std::pair<std::array<int, 4>, std::array<int, 4>>, int> count;
      for (const auto& [cell, bits] : {std::pair{0, a}, std::pair{1, b}}) {
        for (const auto& t : cube_cases().of(bits)) {
          for (std::size_t i = 0; i < 3; ++i) ++count[{key(cell, t[i]), key(cell, t[(i + 1) % 3])}];
        }
      }
      for (const auto& [edge, times] : count) {
        ASSERT_EQ(times, 1);
        const bool paired = count.count({edge.second, edge.first}) > 0;
        // Both ends on the common plane x = 1.
        const auto on_plane = [](const std::array<int, 4>& e) { return e[0] != 0 && e[1] == 1; };
        if (on_plane(edge.first) && on_plane(edge.second)) {
          ASSERT_TRUE(paired) << a << " " << b;
        }
      }
    }
  }
}

TEST(Isosurface, OfALoneParticleIsABall) {
  // Recovered with T' = f(R0): a ball of radius R0 exactly. A mesh of cell c inscribed in it lacks about
  // c^2/R^2/2 of the volume.
  const std::vector<Vec3> one{{1, 2, 3}};
  const SurfaceModel model = resolve_surface_model(one, {}, settings_of(0.1f, 3));
  const TriangleMesh mesh = extract_isosurface(one, {}, model, {.cell = 0.01f});
  expect_closed(mesh);
  EXPECT_NEAR(enclosed_volume(mesh) / (4.0 / 3.0 * 3.14159265 * 1e-3), 1.0, 6e-3);
  EXPECT_NEAR(surface_area(mesh) / (4.0 * 3.14159265 * 1e-2), 1.0, 4e-3);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    EXPECT_NEAR(length(mesh.positions[v] - one[0]), 0.1f, 2e-6f);
    EXPECT_NEAR(dot(mesh.normals[v], normalize(mesh.positions[v] - one[0])), 1.0f, 1e-4f);
  }
  // Euler: one sphere.
  EXPECT_EQ(mesh.positions.size() + mesh.triangles.size() - 3 * mesh.triangles.size() / 2, 2u);
  EXPECT_EQ(component_count(mesh), 1u);
}

TEST(Isosurface, IsClosedAndWeldedForScatteredParticles) {
  // Dense enough that balls merge in every way, on a grid too coarse for them: ambiguous cells abound.
  for (const int order : {1, 2, 3}) {
    const std::vector<Vec3> positions = random_drops(2000, 7);
    const SurfaceModel model = resolve_surface_model(positions, {}, settings_of(0.03f, order));
    const TriangleMesh mesh = extract_isosurface(positions, {}, model, {.cell = 0.025f});
    ASSERT_GT(mesh.triangles.size(), 1000u);
    expect_closed(mesh);
    EXPECT_GT(enclosed_volume(mesh), 0.0);
  }
}

TEST(Isosurface, AgreesWithTheIndependentMeshOfTheSampleDroplets) {
  // The reference pictures of these 2,955 particles were made from a mesh of another program (double precision, cell
  // R0/4): volume, area and recovered particles as its notes state them. Where the grid lies moves the area by
  // some 1e-4 and the number of triangles by a little more.
  std::vector<Vec3> positions;
  for (const Vec3d& p : read_particles(EMBRUN_DATA_DIR "/droplets.ply").positions) positions.push_back(to_float(p));
  ASSERT_EQ(positions.size(), 2955u);
  struct Expected {
    int order;
    float threshold;
    std::size_t recovered;
    double triangles, components, volume, area;
  };
  for (const Expected& expected : {Expected{3, 10.415897f, 448, 341092, 40, 0.986962, 10.78149},
                                   Expected{2, 3.086192f, 212, 308032, 44, 0.992663, 9.84098}}) {
    SurfaceSettings settings = settings_of(0.0375f, expected.order);
    settings.threshold_mode = ThresholdMode::number;
    settings.threshold = expected.threshold;
    settings.recover = RecoverMode::thesis;
    const SurfaceModel model = resolve_surface_model(positions, {}, settings);
    EXPECT_EQ(model.recovered.size(), expected.recovered);
    const TriangleMesh mesh = extract_isosurface(positions, {}, model, {.cell = 0.0375f / 4});
    expect_closed(mesh);
    // Drops that hardly touch are one or two, by where the grid lies.
    EXPECT_NEAR(static_cast<double>(component_count(mesh)), expected.components, 1);
    EXPECT_NEAR(enclosed_volume(mesh), expected.volume, 5e-5);
    EXPECT_NEAR(surface_area(mesh), expected.area, 2e-3);
    EXPECT_NEAR(static_cast<double>(mesh.triangles.size()) / expected.triangles, 1.0, 0.01);
  }
}

TEST(Isosurface, HandlesRadiiOfDifferentSize) {
  std::vector<Vec3> positions = random_drops(300, 8);
  std::vector<float> radii(300);
  for (std::size_t i = 0; i < 300; ++i) radii[i] = i % 3 ? 0.01f : 0.05f;
  // A big one apart from the others: a ball of its own radius.
  positions.push_back({3, 3, 3});
  radii.push_back(0.4f);
  const SurfaceModel model = resolve_surface_model(positions, radii, settings_of(0.02f, 2));
  const TriangleMesh mesh = extract_isosurface(positions, radii, model, {.cell = 0.02f});
  expect_closed(mesh);
  std::size_t on_ball = 0;
  for (const Vec3 p : mesh.positions) {
    if (length(p - positions.back()) > 1.0f) continue;
    EXPECT_NEAR(length(p - positions.back()), 0.4f, 1e-5f);
    ++on_ball;
  }
  EXPECT_GT(on_ball, 1000u);
}

TEST(Isosurface, DoesNotDependOnTheNumberOfThreads) {
  const std::vector<Vec3> positions = random_drops(3000, 9);
  const SurfaceModel model = resolve_surface_model(positions, {}, settings_of(0.03f, 2));
  TriangleMesh meshes[3];
  const std::size_t threads[3] = {1, 2, 7};
  for (std::size_t i = 0; i < 3; ++i) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads[i]);
    tbb::task_arena arena(static_cast<int>(threads[i]));
    arena.execute([&] { meshes[i] = extract_isosurface(positions, {}, model, {.cell = 0.02f}); });
    ASSERT_GT(meshes[i].triangles.size(), 10000u);
  }
  EXPECT_EQ(meshes[0], meshes[1]);
  EXPECT_EQ(meshes[0], meshes[2]);
}

TEST(Isosurface, RefusesAGridTooFineForTheExtent) {
  const std::vector<Vec3> positions{{0, 0, 0}, {1e6f, 1e6f, 1e6f}};
  const SurfaceModel model = resolve_surface_model(positions, {}, settings_of(1.0f, 2));
  EXPECT_THROW(extract_isosurface(positions, {}, model, {1e-3f, true}), Error);
}

}  // namespace
}  // namespace embrun

// Meshes held against an independent model of the surface in double precision (tests/geometry/oracle.h), and against the
// direct tracer.

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "geometry/tracers.h"
#include "measure/oracle_scene.h"
#include "meshing/isosurface.h"
#include "meshing/sign_grid.h"

namespace embrun {
namespace {

using measure::OracleScene;
using measure::to_oracle;

struct Subject {
  OracleScene scene;
  SurfaceModel model;
  oracle::Surface surface;
  float cell;
};

Subject make_subject(const std::string& name, int order, Kernel kernel = Kernel::metaball,
                     RecoverMode recover = RecoverMode::smooth) {
  OracleScene scene = measure::make_scene(name, order, 1);
  scene.settings.kernel = kernel;
  scene.settings.recover = recover;
  SurfaceModel model = resolve_surface_model(scene.positions, scene.radii, scene.settings);
  oracle::Surface surface = oracle_surface(scene, model);
  return {std::move(scene), std::move(model), std::move(surface), 0.5f * model.radius};
}

TriangleMesh mesh_of(const Subject& s, float cell) {
  return extract_isosurface(s.scene.positions, s.scene.radii, s.model, {.cell = cell});
}

/// How far a vertex is from the surface, to first order, in radii of the particles that make it.
double distance_to_surface(const Subject& s, Vec3 x) {
  const oracle::Sample sample = s.surface.sample(to_oracle(x));
  return std::abs(sample.g) / oracle::length(sample.gradient) /
         std::max(sample.radius, static_cast<double>(s.model.radius));
}

TEST(SurfaceMesh, HasItsVerticesOnTheSurface) {
  const struct {
    const char* scene;
    int order;
    Kernel kernel;
    RecoverMode recover;
  } cases[] = {{"droplets", 3, Kernel::metaball, RecoverMode::smooth},
               {"droplets", 2, Kernel::metaball, RecoverMode::thesis},
               {"droplets", 1, Kernel::metaball, RecoverMode::smooth},
               {"sheets", 2, Kernel::zhu_bridson, RecoverMode::smooth},
               {"slab", 3, Kernel::blinn, RecoverMode::off},
               {"spray", 3, Kernel::metaball, RecoverMode::smooth},
               {"log-uniform", 2, Kernel::metaball, RecoverMode::smooth}};
  for (const auto& c : cases) {
    const Subject s = make_subject(c.scene, c.order, c.kernel, c.recover);
    const float cell = s.scene.radii.empty() ? s.cell : 1.5f * s.model.radius;
    const TriangleMesh mesh = mesh_of(s, cell);
    ASSERT_GT(mesh.triangles.size(), 1000u) << c.scene;
    double worst = 0, sum = 0;
    std::size_t count = 0;
    const std::size_t step = std::max<std::size_t>(1, mesh.positions.size() / 4000);
    for (std::size_t v = 0; v < mesh.positions.size(); v += step, ++count) {
      const double distance = distance_to_surface(s, mesh.positions[v]);
      worst = std::max(worst, distance);
      sum += distance;
    }
    EXPECT_LT(worst, 1e-3) << c.scene << " order " << c.order;
    EXPECT_LT(sum / static_cast<double>(count), 5e-5) << c.scene << " order " << c.order;
  }
}

// What was proven without samples has the right sign at each of them.
TEST(SurfaceMesh, SignsAreThoseOfTheFieldAtEverySample) {
  for (const int order : {1, 2, 3}) {
    Subject s = make_subject("droplets", order);
    s.scene.positions.resize(700);
    s.model = resolve_surface_model(s.scene.positions, {}, s.scene.settings);
    s.surface = oracle_surface(s.scene, s.model);
    for (const float share : {0.125f, 0.5f, 1.7f}) {
      const SurfaceField field(s.scene.positions, {}, s.model);
      const SignGrid grid(field, share * s.model.radius, {}, 1);
      // Every so many, so that some thousands are looked at on both sides.
      std::size_t looked_at[2] = {}, wrong = 0, samples = 0;
      const std::size_t stride = share < 0.2f ? 997 : share < 1 ? 61 : 1;
      for (std::size_t tile = 0; tile < grid.tile_count(); ++tile) {
        SignGrid::PaddedWords words{};
        const SignGrid::Neighbours neighbours = grid.neighbours(tile);
        const bool mixed = grid.words_of(neighbours, words);
        for (int brick = 0; brick < 64; ++brick) {
          const auto [x, y, z] = SignGrid::place_in_tile(brick);
          const std::uint64_t word = grid.word(tile, brick);
          if (mixed) {
            ASSERT_EQ(word, words[static_cast<std::size_t>((z * SignGrid::padded + y) * SignGrid::padded + x)]);
          }
          for (int bit = 0; bit < 64; ++bit) {
            if (samples++ % stride != 0) continue;
            const bool inside = (word >> bit & 1u) != 0;
            const Vec3 p = grid.position(tile, 4 * x + bit % 4, 4 * y + bit / 4 % 4, 4 * z + bit / 16);
            const double g = s.surface.sample(to_oracle(p)).g;
            ++looked_at[inside];
            wrong += std::abs(g) > 1e-4 && (g > 0) != inside;
          }
        }
      }
      EXPECT_EQ(wrong, 0u) << order << " " << share;
      EXPECT_GT(looked_at[0], 500u) << order << " " << share;
      EXPECT_GT(looked_at[1], 300u) << order << " " << share;
      // Work goes with the surface where the body is large against the cells.
      if (share < 0.2f) {
        EXPECT_LT(grid.sample_count(), samples / 3) << order;
      }
    }
  }
}

// The volume by counting the points of a fine grid that are in the body, and the mesh's.
TEST(SurfaceMesh, EnclosesTheBody) {
  Subject s = make_subject("droplets", 3);
  s.scene.positions.clear();
  const float spacing = 0.0465f;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 5; ++j)
      for (int k = 0; k < 4; ++k)
        s.scene.positions.push_back(spacing *
                                    Vec3{static_cast<float>(i) + 0.2f * std::sin(7.0f * static_cast<float>(j + k)),
                                         static_cast<float>(j) + 0.2f * std::sin(5.0f * static_cast<float>(i)),
                                         static_cast<float>(k)});
  s.model = resolve_surface_model(s.scene.positions, {}, s.scene.settings);
  s.surface = oracle_surface(s.scene, s.model);
  constexpr int n = 60;
  const oracle::Vec low{-0.08, -0.08, -0.08}, step{0.42 / n, 0.38 / n, 0.32 / n};
  std::size_t inside = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k)
        inside += s.surface.inside(low + oracle::Vec{(i + 0.5) * step.x, (j + 0.5) * step.y, (k + 0.5) * step.z});
  const double counted = static_cast<double>(inside) * step.x * step.y * step.z;
  // Chance puts some 100 of the 90,000 points at the surface on the wrong side; facets cut off 1/1000.
  const TriangleMesh mesh = mesh_of(s, 0.5f * s.cell);
  EXPECT_NEAR(enclosed_volume(mesh) / counted, 1.0, 2e-3);
  EXPECT_EQ(component_count(mesh), 1u);
  EXPECT_EQ(mesh.positions.size() + mesh.triangles.size() - 3 * mesh.triangles.size() / 2, 2u);
}

// A ray that meets the surface at a vertex finds the vertex's normal there.
TEST(SurfaceMesh, HasTheDirectTracersNormals) {
  for (const NormalMode mode : {NormalMode::weighted, NormalMode::gradient}) {
    Subject s = make_subject("droplets", 2);
    s.scene.settings.normal = mode;
    s.model = resolve_surface_model(s.scene.positions, {}, s.scene.settings);
    const TriangleMesh mesh = mesh_of(s, s.cell);
    const test::Tracer tracer = test::make_tracer("fast", "", s.scene.positions, {}, s.scene.settings);
    std::size_t compared = 0, different = 0;
    for (std::size_t v = 0; v < mesh.positions.size(); v += 7) {
      const oracle::Vec slope = s.surface.sample(to_oracle(mesh.positions[v])).gradient;
      const Vec3 outwards =
          -normalize(Vec3{static_cast<float>(slope.x), static_cast<float>(slope.y), static_cast<float>(slope.z)});
      Ray ray;
      ray.origin = mesh.positions[v] + 0.02f * s.model.radius * outwards;
      ray.direction = -outwards;
      SurfaceHit hit;
      if (!tracer.intersect(ray, Side::outside, hit)) continue;
      if (length(hit.position - mesh.positions[v]) > 1e-3f * s.model.radius) continue;
      ++compared;
      different += dot(hit.shading_normal, mesh.normals[v]) < 1 - 1e-5f;
    }
    EXPECT_GT(compared, mesh.positions.size() / 8);
    // Where the two fields make a crease together, either's normal is right.
    EXPECT_LT(static_cast<double>(different), 2e-3 * static_cast<double>(compared));
  }
}

}  // namespace
}  // namespace embrun

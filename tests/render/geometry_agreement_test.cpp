// The same body as different geometry must give the same picture, in light that shows the difference: white from above,
// dark from below.

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <utility>

#include "image/metrics.h"
#include "meshing/isosurface.h"
#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

EnvironmentDescription two_tone() {
  EnvironmentDescription environment;
  environment.kind = EnvironmentDescription::Kind::image;
  environment.image = make_image(64, 32, 3);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x)
      for (int c = 0; c < 3; ++c) environment.image.at(x, y, c) = y < 16 ? 1.0f : 0.1f;
  return environment;
}

/// A ball of unit radius as a subdivided octahedron with smooth normals.
TriangleMesh ball_mesh(int subdivisions) {
  TriangleMesh mesh;
  mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{{0, 2, 4}}, {{2, 1, 4}}, {{1, 3, 4}}, {{3, 0, 4}},
                    {{2, 0, 5}}, {{1, 2, 5}}, {{3, 1, 5}}, {{0, 3, 5}}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
      if (fresh) mesh.positions.push_back(normalize(mesh.positions[a] + mesh.positions[b]));
      return entry->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{{a, ab, ca}}, {{b, bc, ab}}, {{c, ca, bc}}, {{ab, bc, ca}}});
    }
    mesh.triangles = std::move(finer);
  }
  mesh.normals = mesh.positions;
  return mesh;
}

SceneDescription two_tone_view() {
  SceneDescription scene = scene_seen({2.1, 1.3, 3.0}, {0.2, 0.1, 0}, 36, 32, 64);
  scene.environment = two_tone();
  return scene;
}

constexpr float sigma = 0.8f;
const Vec3d center{0.2, 0.1, -0.1};
constexpr double radius = 0.8;

SceneDescription with_ball() {
  SceneDescription scene = two_tone_view();
  scene.balls.push_back(balls({{center, radius}}, dielectric_material(1.33, grey(sigma))));
  return scene;
}

/// Means and 4x4 blocks agree to noise and `tolerance`.
void expect_same_picture(const SceneDescription& a, const SceneDescription& b, double tolerance) {
  const RenderResult ra = render(a), rb = render(b);
  const Measured ma = measure(ra.film), mb = measure(rb.film);
  EXPECT_NEAR(ma.mean, mb.mean, 4 * std::hypot(ma.standard_error, mb.standard_error) + tolerance * ma.mean);
  EXPECT_EQ(rb.counts.paths.contradictions, 0u);
  const auto blocks = compare_blocks(ra.layers.layer("beauty"), rb.layers.layer("beauty"), ra.layers.find("variance"),
                                     rb.layers.find("variance"), 4);
  EXPECT_GE(share_within(blocks, 0.02 + tolerance, 3), 0.97);
}

TEST(Agreement, AMeshOfABall) {
  SceneDescription scene = two_tone_view();
  MeshDescription mesh;
  mesh.mesh = ball_mesh(6);
  mesh.placement = {{radius, 0, 0}, {0, radius, 0}, {0, 0, radius}, center};
  mesh.material = dielectric_material(1.33, grey(sigma));
  scene.meshes.push_back(mesh);
  expect_same_picture(with_ball(), scene, 0.002);
}

TEST(Agreement, ALoneParticle) {
  SceneDescription scene = two_tone_view();
  FluidDescription drop;
  drop.positions = {center};
  drop.surface.radius = static_cast<float>(radius);
  drop.material = dielectric_material(1.33, grey(sigma));
  scene.fluids.push_back(drop);
  expect_same_picture(with_ball(), scene, 0.002);
}

// A body of water with an uneven surface and a few drops, against marching cubes of the same field: cells of a quarter
// radius, vertices on the surface, normals of the field. What the mesh cuts off its edges is the tolerance.
TEST(Agreement, AMeshOfAFluid) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> shift(-0.02, 0.02);
  FluidDescription fluid = lattice_fluid({-0.5, -0.3, -0.4}, {0.5, 0.2, 0.5}, 0.1);
  for (Vec3d& p : fluid.positions) p = p + Vec3d{shift(random), shift(random), shift(random)};
  for (int i = 0; i < 12; ++i) fluid.positions.push_back({0.13 * i - 0.6, 0.45 + 3 * shift(random), 4 * shift(random)});
  fluid.surface.normal = NormalMode::gradient;
  for (const int order : {2, 3}) {
    fluid.surface.order = order;
    SceneDescription direct = two_tone_view(), meshed = two_tone_view();
    direct.fluids.push_back(fluid);
    std::vector<Vec3> positions;
    for (const Vec3d& p : fluid.positions) positions.push_back(to_float(p));
    IsosurfaceSettings cells;
    cells.cell = 0.25f * fluid.surface.radius;
    MeshDescription mesh;
    mesh.mesh = extract_isosurface(positions, {}, resolve_surface_model(positions, {}, fluid.surface), cells);
    mesh.material = fluid.material;
    meshed.meshes.push_back(mesh);
    expect_same_picture(direct, meshed, 0.004);
  }
}

TEST(Agreement, APlacedParticle) {
  SceneDescription scene = two_tone_view();
  FluidDescription drop;
  drop.positions = {{3, 4, 5}};
  drop.surface.radius = 0.2f;
  drop.material = dielectric_material(1.33, grey(sigma));
  // A quarter turn about z, four times as large, to the ball's place: (3,4,5) -> 4 (-4,3,5) + origin.
  drop.placement = {{0, 4, 0}, {-4, 0, 0}, {0, 0, 4}, center - Vec3d{-16, 12, 20}};
  scene.fluids.push_back(drop);
  expect_same_picture(with_ball(), scene, 0.002);
}

// A fluid that goes on far behind the faces of its container is a box of water, with the very same paths but for rounding.
TEST(Agreement, AFluidCutByItsContainerIsABox) {
  const Box3d container{{-0.4, -0.3, -0.5}, {0.5, 0.4, 0.3}};
  SceneDescription boxed = two_tone_view();
  boxed.boxes.push_back({container, dielectric_material(1.33, grey(sigma))});
  SceneDescription clipped = two_tone_view();
  FluidDescription fluid = lattice_fluid({-1.2, -1.1, -1.3}, {1.3, 1.2, 1.1}, 0.2, 2);
  fluid.material = dielectric_material(1.33, grey(sigma));
  fluid.container = container;
  clipped.fluids.push_back(fluid);
  expect_same_picture(boxed, clipped, 0);
  const Film a = render(boxed).film, b = render(clipped).film;
  std::size_t different = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    different += std::abs(a.pixels[i].radiance[0] - b.pixels[i].radiance[0]) > 0.05 * a.pixels[i].radiance[0];
  EXPECT_LT(different, a.pixels.size() / 20);
}

// Particles that stop short of their container's walls, as a solver leaves them, fill it.
TEST(Agreement, AFluidThatStopsShortOfItsContainerFillsIt) {
  const Box3d container{{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}};
  SceneDescription boxed = two_tone_view();
  boxed.boxes.push_back({container, dielectric_material(1.33, grey(sigma))});
  for (const int order : {2, 3}) {
    SceneDescription wetted = two_tone_view();
    // The outer layers are at 1.8 radii from the walls, as a solver may leave them; half a spacing would be right.
    FluidDescription fluid = lattice_fluid({-0.4675, -0.4675, -0.4675}, {0.468, 0.468, 0.468}, 0.071923, order);
    fluid.surface.radius = 0.0375f;
    fluid.material = dielectric_material(1.33, grey(sigma));
    fluid.container = container;
    wetted.fluids.push_back(fluid);
    expect_same_picture(boxed, wetted, 0);
  }
}

// Far from the world's origin everything is as it is near it.
TEST(Agreement, AFarScene) {
  const Vec3d far{1e5, -3e5, 2e5};
  SceneDescription near = two_tone_view(), away = two_tone_view();
  const auto fill = [](SceneDescription& scene, Vec3d o) {
    scene.camera.eye = scene.camera.eye + o;
    scene.camera.target = scene.camera.target + o;
    FluidDescription fluid = lattice_fluid({-0.5, -0.4, -0.5}, {0.5, 0.4, 0.5}, 0.16, 2);
    for (Vec3d& p : fluid.positions) p = p + o;
    scene.fluids.push_back(fluid);
    PatchDescription floor = patch(o + Vec3d{0, -0.4, 0}, {1, 0, 0}, {0, 0, -1}, 3, diffuse_material(grey(0.7f)));
    floor.material.reflectance.kind = TextureKind::checker;
    floor.material.reflectance.cell = 0.3;
    floor.material.reflectance.origin = o;
    scene.patches.push_back(floor);
  };
  fill(near, {0, 0, 0});
  fill(away, far);
  expect_same_picture(near, away, 0);
}

}  // namespace
}  // namespace embrun

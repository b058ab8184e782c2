// Materials in whole paths: furnaces, and the three ways of sampling lights that must agree.

#include <gtest/gtest.h>

#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

MaterialDescription plastic(Rgb base, bool nonlinear = true) {
  MaterialDescription m;
  m.kind = BsdfKind::plastic;
  m.reflectance.first = base;
  m.ior = 1.5;
  m.nonlinear = nonlinear;
  return m;
}

MaterialDescription rough_glass(double alpha) {
  MaterialDescription m = dielectric_material(1.5);
  m.kind = BsdfKind::rough_dielectric;
  m.roughness.first = grey(static_cast<float>(alpha));
  return m;
}

MaterialDescription rough_gold(double alpha) {
  MaterialDescription m = conductor_material({0.14f, 0.37f, 1.44f}, {3.98f, 2.38f, 1.6f});
  m.kind = BsdfKind::rough_conductor;
  m.roughness.first = grey(static_cast<float>(alpha));
  return m;
}

MaterialDescription principled(double spec_trans) {
  MaterialDescription m;
  m.kind = BsdfKind::principled;
  m.ior = 1.5;
  m.reflectance.first = {0.8f, 0.5f, 0.3f};
  m.roughness.first = grey(0.5f);
  m.principled.spec_trans = spec_trans;
  m.principled.clearcoat = 0.5;
  m.principled.sheen = 0.3;
  return m;
}

MaterialDescription thin_glass() {
  MaterialDescription m;
  m.kind = BsdfKind::thin_dielectric;
  m.ior = 1.5;
  return m;
}

Measured ball_in_furnace(const MaterialDescription& material, int samples = 500) {
  SceneDescription scene = scene_seen({0, 0, 3}, {0, 0, 0}, 45, 8, samples);
  scene.balls.push_back(balls({{{0, 0, 0}, 1}}, material));
  return render_and_measure(scene);
}

// What loses nothing is invisible in a furnace: plastic with a white base, sheets of glass, perfect mirrors.
TEST(Materials, WithoutLossesAreInvisibleInAFurnace) {
  for (const MaterialDescription& material : {plastic({1, 1, 1}), thin_glass(), conductor_material()}) {
    const Measured m = ball_in_furnace(material);
    EXPECT_NEAR(m.mean, 1, 4 * m.standard_error + 1e-5);
    EXPECT_EQ(m.counters.contradictions, 0u);
    EXPECT_EQ(m.bad, 0u);
  }
}

// Rough glass loses a little to what its facets hide, and adds nothing.
TEST(Materials, RoughGlassLosesLittleInAFurnace) {
  const Measured m = ball_in_furnace(rough_glass(0.1), 2000);
  EXPECT_LT(m.mean, 1 + 4 * m.standard_error);
  EXPECT_GT(m.mean, 0.96);
  EXPECT_EQ(m.counters.contradictions, 0u);
}

// A sheet seen from either side: its front reflects 0.8 of a furnace's light, its back 0.3.
TEST(Materials, HaveAnotherBack) {
  for (const double side : {1.0, -1.0}) {
    SceneDescription scene = scene_seen({0, side, 0}, {0, 0, 0}, 20, 4, 50);
    MaterialDescription sheet = diffuse_material(grey(0.8f));
    sheet.back.push_back(diffuse_material(grey(0.3f)));
    scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 50, sheet));
    EXPECT_NEAR(render_and_measure(scene, LightStrategy::bsdf_only).mean, side > 0 ? 0.8 : 0.3, 1e-5);
  }
}

/// Four pixels, one colour each: 0.1 0.2 above 0.3 0.4, unfiltered.
TextureDescription four_colours(SceneDescription& scene) {
  PictureDescription picture;
  picture.image = make_image(2, 2, 1);
  picture.image.pixels = {0.1f, 0.2f, 0.3f, 0.4f};
  scene.pictures.push_back(picture);
  TextureDescription texture;
  texture.kind = TextureKind::bitmap;
  texture.picture = 0;
  texture.filter = TextureFilter::nearest;
  return texture;
}

/// Reflectance seen from `eye` in the direction of `target`.
double seen(SceneDescription scene, Vec3d eye, Vec3d target) {
  const SceneDescription view = scene_seen(eye, target, pencil, 1, 4);
  scene.camera = view.camera;
  scene.film = view.film;
  scene.integrator = view.integrator;
  scene.integrator.max_depth = 1;
  return render_and_measure(scene, LightStrategy::bsdf_only).mean;
}

// A diffuse surface that light meets once shows its texture in a furnace.
TEST(Textures, OnARectangle) {
  SceneDescription scene;
  MaterialDescription picture;
  picture.reflectance = four_colours(scene);
  // u along x, v along y: the first row is below.
  scene.patches.push_back(patch({5, 0, 0}, {1, 0, 0}, {0, 1, 0}, 2, picture));
  EXPECT_NEAR(seen(scene, {4, -1, 3}, {4, -1, 0}), 0.1, 1e-6);
  EXPECT_NEAR(seen(scene, {6, -1, 3}, {6, -1, 0}), 0.2, 1e-6);
  EXPECT_NEAR(seen(scene, {4, 1, 3}, {4, 1, 0}), 0.3, 1e-6);
  EXPECT_NEAR(seen(scene, {4, 1, -3}, {4, 1, 0}), 0.3, 1e-6);  // from behind
}

// Longitudes 0 to 180 degrees show the left half, what is nearer to the pole the first row.
TEST(Textures, OnABallThatIsTurned) {
  SceneDescription scene;
  MaterialDescription picture;
  picture.reflectance = four_colours(scene);
  scene.balls.push_back(balls({{{1, 2, 3}, 0.5}}, picture));
  scene.balls[0].pole = {0, 2, 0};
  scene.balls[0].meridian = {0, 0, 3};  // so longitude grows from z to x
  const Vec3d c{1, 2, 3};
  EXPECT_NEAR(seen(scene, c + Vec3d{3, 1, 0}, c), 0.1, 1e-6);
  EXPECT_NEAR(seen(scene, c + Vec3d{-3, 1, 0}, c), 0.2, 1e-6);
  EXPECT_NEAR(seen(scene, c + Vec3d{3, -1, 0.1}, c), 0.3, 1e-6);
  EXPECT_NEAR(seen(scene, c + Vec3d{-3, -1, 0.1}, c), 0.4, 1e-6);
}

TEST(Textures, OnABox) {
  SceneDescription scene;
  MaterialDescription picture;
  picture.reflectance = four_colours(scene);
  scene.boxes.push_back(box({0, 0, 0}, {2, 4, 6}, picture));
  // The face +z has u along y and v along x.
  EXPECT_NEAR(seen(scene, {0.5, 1, 9}, {0.5, 1, 6}), 0.1, 1e-6);
  EXPECT_NEAR(seen(scene, {0.5, 3, 9}, {0.5, 3, 6}), 0.2, 1e-6);
  EXPECT_NEAR(seen(scene, {1.5, 1, 9}, {1.5, 1, 6}), 0.3, 1e-6);
}

// A mesh by its own coordinates, in each of its places; a mesh without any has the weights of its corners.
TEST(Textures, OnAMesh) {
  SceneDescription scene;
  MeshDescription quad;
  quad.material.reflectance = four_colours(scene);
  quad.mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  quad.mesh.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  MeshDescription bare = quad;
  quad.mesh.coordinates = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  Placement moved, turned;
  moved.origin = {10, 0, 0};
  turned.x_axis = {0, 1, 0};  // by a quarter about z: what was at +x is at +y
  turned.y_axis = {-1, 0, 0};
  quad.copies = {moved, turned};
  scene.meshes.push_back(quad);
  EXPECT_NEAR(seen(scene, {9.5, -0.5, 3}, {9.5, -0.5, 0}), 0.1, 1e-6);
  EXPECT_NEAR(seen(scene, {10.5, -0.6, 3}, {10.5, -0.6, 0}), 0.2, 1e-6);
  EXPECT_NEAR(seen(scene, {9.5, 0.6, 3}, {9.5, 0.6, 0}), 0.3, 1e-6);
  EXPECT_NEAR(seen(scene, {0.5, 0.6, 3}, {0.5, 0.6, 0}), 0.2, 1e-6);

  scene.meshes = {bare};
  EXPECT_NEAR(seen(scene, {0.8, -0.8, 3}, {0.8, -0.8, 0}), 0.2, 1e-6);  // next to the first triangle's second corner
}

// A factor on both axes of (u, v) repeats the picture.
TEST(Textures, AreTransformed) {
  SceneDescription scene;
  MaterialDescription picture;
  picture.reflectance = four_colours(scene);
  picture.reflectance.to_uv = {2, 0, 0.5, 0, 2, 0};
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 2, picture));
  EXPECT_NEAR(seen(scene, {-1.9, -1.9, 3}, {-1.9, -1.9, 0}), 0.2, 1e-6);
  EXPECT_NEAR(seen(scene, {-0.9, -1.9, 3}, {-0.9, -1.9, 0}), 0.1, 1e-6);
}

// Brushed metal under a narrow lamp overhead: it is brighter seen along the direction that its facets are spread in, and a
// turned patch turns with it.
TEST(Materials, FollowTheDirectionOfU) {
  const auto brushed = [](Vec3d u, Vec3d v) {
    SceneDescription scene = scene_seen({4, 4, 0}, {0, 0, 0}, pencil, 1, 2000);
    MaterialDescription metal = rough_gold(0.5);
    metal.roughness_v = 0.05;
    scene.patches.push_back(patch({0, 0, 0}, u, v, 5, metal));
    scene.environment.kind = EnvironmentDescription::Kind::none;
    LightDescription sun;
    sun.kind = LightDescription::Kind::distant;
    sun.normal = {0, 1, 0};
    scene.lights.push_back(sun);
    return render_and_measure(scene).mean;
  };
  EXPECT_GT(brushed({1, 0, 0}, {0, 0, -1}), 20 * brushed({0, 0, 1}, {1, 0, 0}));
}

// A lamp over a floor and a ball, under a weak sky.
SceneDescription lit_ball(const MaterialDescription& ball, const MaterialDescription& floor) {
  SceneDescription scene = scene_seen({0.2, 1.2, 2.6}, {0, 0.4, 0}, 40, 8, 1500);
  scene.environment.constant = grey(0.2f);
  scene.patches.push_back(patch({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 1.5, floor));
  scene.balls.push_back(balls({{{0, 0.5, 0}, 0.45}}, ball));
  LightDescription lamp;
  lamp.position = {-0.4, 1.9, -0.4};
  lamp.edge_u = {0.8, 0, 0};
  lamp.edge_v = {0, 0, 0.8};
  lamp.radiance = grey(4);
  scene.lights.push_back(lamp);
  return scene;
}

struct NamedMaterial {
  const char* name;
  MaterialDescription material;
};
void PrintTo(const NamedMaterial& m, std::ostream* os) { *os << m.name; }

class MaterialStrategies : public ::testing::TestWithParam<NamedMaterial> {};

// All that scatters round about is lit from wherever lights are, through its surface as well: drawing directions,
// drawing lights, or both, give one picture. What plastic's coat mirrors is met by direction in all three.
TEST_P(MaterialStrategies, Agree) {
  const SceneDescription scene = lit_ball(GetParam().material, diffuse_material(grey(0.6f)));
  const Measured mis = render_and_measure(scene);
  const Measured bsdf = render_and_measure(scene, LightStrategy::bsdf_only);
  const Measured lights = render_and_measure(scene, LightStrategy::lights_only);
  EXPECT_NEAR(mis.mean, bsdf.mean, 4 * std::hypot(mis.standard_error, bsdf.standard_error));
  EXPECT_NEAR(mis.mean, lights.mean, 4 * std::hypot(mis.standard_error, lights.standard_error));
  EXPECT_LT(mis.standard_error, bsdf.standard_error);
  EXPECT_LT(mis.standard_error, 0.02 * mis.mean);
  EXPECT_EQ(mis.bad, 0u);
}

// Shadow rays that go straight through smooth interfaces count nothing twice, and lose nothing, where there are others: a
// sheet of glass and rough glass let light through in their own ways.
TEST(Materials, StraightShadowRaysKeepToSmoothInterfaces) {
  SceneDescription sheet = lit_ball(diffuse_material(grey(0.5f)), diffuse_material(grey(0.6f)));
  sheet.patches.push_back(patch({0, 1.4, 0}, {1, 0, 0}, {0, 0, -1}, 1.5, thin_glass()));
  const SceneDescription rough = lit_ball(rough_glass(0.3), diffuse_material(grey(0.6f)));
  for (SceneDescription scene : {sheet, rough}) {
    const Measured refracted = render_and_measure(scene);
    scene.integrator.straight_shadows = true;
    const Measured straight = render_and_measure(scene);
    EXPECT_NEAR(refracted.mean, straight.mean, 4 * std::hypot(refracted.standard_error, straight.standard_error));
    EXPECT_LT(straight.standard_error, 0.02 * straight.mean);
  }
}

INSTANTIATE_TEST_SUITE_P(All, MaterialStrategies,
                         ::testing::Values(NamedMaterial{"plastic", plastic({0.7f, 0.4f, 0.2f})},
                                           NamedMaterial{"rough_glass", rough_glass(0.3)},
                                           NamedMaterial{"rough_gold", rough_gold(0.3)},
                                           NamedMaterial{"principled", principled(0)},
                                           NamedMaterial{"principled_glass", principled(0.7)}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace embrun

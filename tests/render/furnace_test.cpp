// White furnace: in an environment of radiance 1 clear water is invisible, whatever its shape, and no path can bring
// more than 1 at any depth, since every weight of a dielectric is 1 but for the radiance factors, which cancel.

#include <gtest/gtest.h>

#include "io/read_particles.h"
#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

SceneDescription view_of_unit_ball(int size, int samples) {
  return scene_seen({1.7, 1.1, 2.6}, {0, 0, 0}, 38, size, samples);
}

SceneDescription water_balls() {
  SceneDescription scene = view_of_unit_ball(24, 16);
  scene.balls.push_back(
      balls({{{0, 0, 0}, 0.6}, {{0.5, 0.2, 0.1}, 0.4}, {{-0.6, -0.4, 0.3}, 0.2}}, dielectric_material(1.33)));
  return scene;
}

SceneDescription water_box_with_bubbles() {
  SceneDescription scene = view_of_unit_ball(24, 16);
  scene.boxes.push_back(box({-0.7, -0.6, -0.5}, {0.7, 0.4, 0.6}, dielectric_material(1.33)));
  // One bubble inside, one through a face, two that overlap.
  scene.balls.push_back(
      balls({{{0, 0, 0}, 0.2}, {{0.7, 0.1, 0.2}, 0.15}, {{-0.3, 0, 0.2}, 0.15}, {{-0.4, 0.1, 0.2}, 0.12}},
            dielectric_material(1, {}, 2)));
  return scene;
}

SceneDescription fluid_block(bool in_container, NormalMode normal) {
  SceneDescription scene = view_of_unit_ball(24, 16);
  FluidDescription fluid = lattice_fluid({-0.6, -0.6, -0.6}, {0.6, 0.6, 0.6}, 0.12);
  fluid.positions.push_back({0.9, 0.5, 0.1});  // a drop
  fluid.surface.normal = normal;
  if (in_container) fluid.container = Box3d{{-0.5, -0.45, -2}, {0.3, 2, 2}};
  scene.fluids.push_back(fluid);
  return scene;
}

struct Furnace {
  const char* name;
  SceneDescription (*scene)();
};
void PrintTo(const Furnace& f, std::ostream* os) { *os << f.name; }

class WhiteFurnace : public ::testing::TestWithParam<Furnace> {};

TEST_P(WhiteFurnace, WaterIsInvisibleAtUnlimitedDepth) {
  const Measured m = render_and_measure(GetParam().scene());
  EXPECT_NEAR(m.least, 1, 1e-4);
  EXPECT_NEAR(m.greatest, 1, 1e-4);
  EXPECT_GT(m.counters.inside.rays, 1000u);  // there was some
  EXPECT_EQ(m.counters.contradictions, 0u);
  EXPECT_EQ(m.bad, 0u);
}

TEST_P(WhiteFurnace, NothingIsAboveOneAtAnyDepth) {
  for (const int depth : {1, 2, 3, 5, 9}) {
    SceneDescription scene = GetParam().scene();
    scene.integrator.max_depth = depth;
    const Measured m = render_and_measure(scene);
    EXPECT_LE(m.greatest, 1 + 1e-4) << "depth " << depth;
    EXPECT_LT(m.least, 0.9) << "depth " << depth << " cuts nothing off: the water is not there";
  }
}

TEST_P(WhiteFurnace, StaysWhiteWhenRefractionsAreLimited) {
  for (const int refractions : {0, 1, 2}) {
    SceneDescription scene = GetParam().scene();
    scene.integrator.max_refractions = refractions;
    const Measured m = render_and_measure(scene);
    EXPECT_NEAR(m.least, 1, 1e-4) << refractions;
    EXPECT_NEAR(m.greatest, 1, 1e-4) << refractions;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Bodies, WhiteFurnace,
    ::testing::Values(Furnace{"balls", water_balls}, Furnace{"box_with_bubbles", water_box_with_bubbles},
                      Furnace{"fluid", [] { return fluid_block(false, NormalMode::weighted); }},
                      Furnace{"fluid_with_gradient_normals", [] { return fluid_block(false, NormalMode::gradient); }},
                      Furnace{"fluid_in_container", [] { return fluid_block(true, NormalMode::weighted); }}),
    [](const auto& test) { return test.param.name; });

// A diffuse convex body in the furnace shows its reflectance: every direction ends in the environment.
TEST(DiffuseFurnace, AConvexBodyShowsItsReflectance) {
  SceneDescription scene = scene_seen({0, 0, 3}, {0, 0, 0}, pencil, 2, 4000);
  scene.balls.push_back(balls({{{0, 0, 0}, 1}}, diffuse_material({0.3f, 0.5f, 0.9f})));
  for (int channel = 0; channel < 3; ++channel) {
    const Measured m = render_and_measure(scene, LightStrategy::mis, channel);
    EXPECT_NEAR(m.mean, channel == 0 ? 0.3 : channel == 1 ? 0.5 : 0.9, 4 * m.standard_error + 1e-5);
    EXPECT_LT(m.standard_error, 0.01);
  }
}

/// A cube seen from within, whose walls reflect `reflectance` and emit `radiance`.
SceneDescription glowing_room(float reflectance, float radiance) {
  SceneDescription scene = scene_seen({0.1, 0.2, 0.3}, {-0.3, -0.1, -1}, 60, 4, 4000);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  MeshDescription room;
  for (int i = 0; i < 8; ++i)
    room.mesh.positions.push_back({i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 1.0f : -1.0f});
  // Inwards.
  room.mesh.triangles = {{{0, 6, 4}}, {{0, 2, 6}}, {{1, 7, 3}}, {{1, 5, 7}}, {{0, 5, 1}}, {{0, 4, 5}},
                         {{2, 7, 6}}, {{2, 3, 7}}, {{0, 3, 2}}, {{0, 1, 3}}, {{4, 7, 5}}, {{4, 6, 7}}};
  room.material = diffuse_material(grey(reflectance));
  room.radiance = grey(radiance);
  scene.meshes.push_back(room);
  return scene;
}

// Closed in by walls that all emit E and reflect rho, light after N bounces is E (1 + rho + ... + rho^N).
TEST(DiffuseFurnace, AGlowingRoomShowsTheAlbedoSeries) {
  const double rho = 0.6;
  double expected = 0, power = 1;
  for (int depth = 0; depth <= 3; ++depth, power *= rho) {
    expected += power;
    SceneDescription scene = glowing_room(0.6f, 1);
    scene.integrator.max_depth = depth;
    scene.integrator.roulette_depth = 1;
    const Measured m = render_and_measure(scene);
    EXPECT_NEAR(m.mean, expected, 4 * m.standard_error + 1e-5) << "depth " << depth;
    EXPECT_LT(m.standard_error, 0.01);
  }
  const Measured m = render_and_measure(glowing_room(0.6f, 1));
  EXPECT_NEAR(m.mean, 1 / (1 - rho), 4 * m.standard_error);
}

TEST(DiffuseFurnace, TheRoomIsTheSameHoweverLightIsSampled) {
  for (const LightStrategy strategy : {LightStrategy::bsdf_only, LightStrategy::lights_only}) {
    SceneDescription scene = glowing_room(0.6f, 1);
    scene.integrator.samples = 1000;
    const Measured m = render_and_measure(scene, strategy);
    EXPECT_NEAR(m.mean, 2.5, 4 * m.standard_error);
    EXPECT_LT(m.standard_error, 0.05);
  }
}

// Splashes, where the weighted normal is far from the true one and may face the other way: drops there kept light inside by
// one total reflection after the other, up to any depth, and the picture had black specks.
TEST(WhiteFurnace, SplashesKeepNoLight) {
  SceneDescription scene = scene_seen({0, 1.42, 6.68}, {0, 1.42, 0}, 35, 0, 16);
  scene.film.width = 1280;
  scene.film.height = 720;
  scene.film.crop = PixelWindow{340, 392, 16, 16};
  scene.integrator.max_depth = 256;
  FluidDescription water;
  water.positions = read_particles(EMBRUN_DATA_DIR "/dam_break.bgeo").positions;
  water.surface.radius = 0.0232f;
  water.material = dielectric_material(1.33);
  scene.fluids.push_back(water);
  const Measured m = render_and_measure(scene);
  EXPECT_GT(m.mean, 0.999);
  EXPECT_GT(m.least, 0.9);
  // The gradient's normals take 9 a path.
  EXPECT_LT(static_cast<double>(m.counters.scatterings), 12.0 * static_cast<double>(m.counters.paths));
  EXPECT_EQ(m.counters.contradictions, 0u);
}

}  // namespace
}  // namespace embrun

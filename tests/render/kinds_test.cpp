// Kinds of particle in a picture: what is known of it by derivation.

#include <gtest/gtest.h>

#include <cmath>

#include "render/color_by.h"
#include "render/transport.h"
#include "scene/kind_scene.h"
#include "scene/tank.h"

namespace embrun {
namespace {

using namespace testing_support;

constexpr double n_water = 1.33, n_glass = 1.5;

// A bubble in air is nothing: the picture is the same to the bit.
TEST(Kinds, ABubbleInAirIsNothing) {
  SceneDescription scene = scene_seen({0, 1, 3}, {0, 0, 0}, 40, 24, 8);
  scene.patches.push_back(patch({0, -0.5, 0}, {1, 0, 0}, {0, 0, -1}, 2, diffuse_material(grey(0.7f))));
  scene.patches[0].material.reflectance.kind = TextureKind::checker;
  scene.patches[0].material.reflectance.cell = 0.2;
  scene.integrator.guide = false;
  const Film without = render(scene).film;
  KindLook look = default_look(ParticleKind::bubble, 0.3);
  add_particles(scene, ParticleKind::bubble, {{0, 0, 0}, {0.2, 0, 0.1}, {0.2, 0, 0.1}}, look, {});
  const RenderResult with = render(scene);
  EXPECT_EQ(with.counts.paths.contradictions, 0u);
  ASSERT_EQ(without.pixels.size(), with.film.pixels.size());
  for (std::size_t i = 0; i < without.pixels.size(); ++i)
    EXPECT_EQ(without.pixels[i].radiance[1], with.film.pixels[i].radiance[1]);
}

/// Reflectance and transmittance of a stack of interfaces and absorbing layers at normal incidence, all internal
/// reflections included, each way.
struct Stack {
  double r_front = 0, r_back = 0, t = 1;

  void interface(double from, double to) {
    const double r = (from - to) * (from - to) / ((from + to) * (from + to));
    add(r, 1 - r);
  }
  void layer(double absorption, double thickness) { add(0, std::exp(-absorption * thickness)); }

 private:
  /// Puts a symmetric element behind the stack.
  void add(double r, double transmittance) {
    const double loop = 1 / (1 - r_back * r);
    const double front = r_front + t * t * r * loop, back = r + transmittance * transmittance * r_back * loop;
    t = t * transmittance * loop;
    r_front = front;
    r_back = back;
  }
};

// Through a bubble that reaches out of the water, straight down its axis: there is one interface, at its lower end.
TEST(Kinds, ABubbleAtTheSurfaceOpensTheWater) {
  SceneDescription scene = scene_seen({0, 3, 0}, {0, 0, 0}, pencil, 4, 20000);
  constexpr float absorption = 0.8f;
  scene.boxes.push_back(box({-1, -1, -1}, {1, 0, 1}, dielectric_material(n_water, grey(absorption))));
  add_particles(scene, ParticleKind::bubble, {{0, -0.1, 0}}, default_look(ParticleKind::bubble, 0.3), {});
  Stack stack;
  stack.interface(1, n_water);
  stack.layer(static_cast<double>(absorption), 0.6);
  stack.interface(n_water, 1);
  const Measured m = render_and_measure(scene);
  EXPECT_EQ(m.counters.contradictions, 0u);
  EXPECT_LT(m.standard_error, 2e-3);
  EXPECT_NEAR(m.mean, stack.r_front + stack.t, 4 * m.standard_error);
}

/// A tank of glass with water of particles in it.
SceneDescription filled_tank(Vec3d from, Vec3d to, double fov, int size, int samples, double s = 0.1) {
  SceneDescription scene = scene_seen(from, to, fov, size, samples);
  const Box3d inside{{-0.5, 0, -0.5}, {0.5, 0.9, 0.5}};
  // Solvers keep particles off the walls.
  const double gap = 0.3 * s;
  FluidDescription water = lattice_fluid({-0.5 + gap, gap, -0.5 + gap}, {0.5 - gap, 0.6, 0.5 - gap}, s, 3);
  water.container = inside;
  water.material = dielectric_material(n_water);
  press_into_walls(water, 0.05);
  scene.fluids.push_back(water);
  scene.meshes.push_back(make_tank(inside, 0.05, UpAxis::y, dielectric_material(n_glass, {}, glass_priority)));
  return scene;
}

// Glass, water, glass without a film of air between, which would add four interfaces: level through the tank.
TEST(Kinds, WaterTouchesTheTanksGlass) {
  SceneDescription scene = filled_tank({0.013, 0.27, 3}, {0.013, 0.27, 0}, pencil, 4, 20000);
  constexpr float absorption = 0.8f;
  scene.fluids[0].material.absorption = grey(absorption);
  Stack stack;
  stack.interface(1, n_glass);
  stack.interface(n_glass, n_water);
  stack.layer(static_cast<double>(absorption), 1);
  stack.interface(n_water, n_glass);
  stack.interface(n_glass, 1);
  const Measured m = render_and_measure(scene);
  EXPECT_EQ(m.counters.contradictions, 0u);
  EXPECT_LT(m.standard_error, 2e-3);
  EXPECT_NEAR(m.mean, stack.r_front + stack.t, 4 * m.standard_error);
}

/// The tank with bubbles and white sand, both across the water line and against the glass, and spray.
SceneDescription furnace(Vec3d from, Vec3d to, int samples) {
  SceneDescription scene = filled_tank(from, to, 50, 16, samples);
  std::vector<Vec3d> bubbles, sand, spray;
  for (int i = 0; i < 60; ++i) {
    const double a = 2.4 * i, h = 0.62 * (i + 0.5) / 60;
    bubbles.push_back({0.47 * std::cos(a), h, 0.47 * std::sin(a)});
    bubbles.push_back({0.2 * std::cos(a), 0.3 + 0.05 * std::sin(3 * a), 0.2 * std::sin(a)});
    sand.push_back({0.3 * std::cos(a), i % 2 == 0 ? 0.58 : 0.03, 0.3 * std::sin(a)});
    spray.push_back({0.4 * std::cos(a), 0.4 + 0.4 * h, 0.4 * std::sin(a)});
  }
  KindLook white = default_look(ParticleKind::sand, 0.05);
  white.color = grey(1);
  add_particles(scene, ParticleKind::bubble, bubbles, default_look(ParticleKind::bubble, 0.06), {});
  add_particles(scene, ParticleKind::sand, sand, white, {});
  add_particles(scene, ParticleKind::spray, spray, default_look(ParticleKind::spray, 0.03), scene.fluids[0].material);
  return scene;
}

// Nothing absorbs, and light of radiance 1 comes from everywhere: a camera sees the square of the index it is in,
// whatever there is.
TEST(Kinds, AFurnaceWithEverything) {
  struct View {
    const char* name;
    Vec3d from, to;
    double index;
  };
  const View views[] = {{"in air", {0.9, 1.1, 1.6}, {0, 0.35, 0}, 1},
                        {"under water", {0.02, 0.2, 0.03}, {0.3, 0.5, 0.3}, n_water},
                        {"in a bubble", {0.2, 0.3, 0.0}, {0, 0.4, 0.1}, 1},
                        {"in the glass", {0.525, 0.3, 0.1}, {0, 0.4, 0.1}, n_glass}};
  for (const View& view : views) {
    const Measured m = render_and_measure(furnace(view.from, view.to, 48));
    EXPECT_EQ(m.counters.contradictions, 0u) << view.name;
    EXPECT_EQ(m.bad, 0u) << view.name;
    const double expected = view.index * view.index;
    EXPECT_NEAR(m.mean, expected, 4 * m.standard_error + 1e-5) << view.name;
    EXPECT_LT(m.standard_error, 0.02 * expected) << view.name;
  }
}

TEST(ColorBy, TakesTheLengthOfVectors) {
  ParticleSet set;
  Attribute velocity;
  velocity.name = "velocity";
  velocity.components = 3;
  for (int i = 0; i <= 100; ++i) {
    set.positions.push_back({0, 0, 0});
    const auto v = static_cast<float>(i);
    for (const float c : {0.6f * v, 0.0f, -0.8f * v}) velocity.floats.push_back(c);
  }
  set.attributes.push_back(velocity);
  const ColorsByAttribute by = color_by_attribute(set, "velocity", "grey", "f");
  EXPECT_NEAR(by.least, 0, 1e-6);
  EXPECT_NEAR(by.most, 100, 1e-4);
  EXPECT_NEAR(by.low, 1, 1e-5);
  EXPECT_NEAR(by.high, 99, 1e-4);
  EXPECT_EQ(by.colors[0], by.colors[1]);
  EXPECT_NEAR(by.colors[50].g, 0.5f, 1e-5);
  EXPECT_LT(by.colors[30].g, by.colors[31].g);
  for (const char* map : {"spectrum", "heat", "grey"})
    for (const Rgb& c : color_by_attribute(set, "velocity", map, "f").colors)
      for (int k = 0; k < 3; ++k) EXPECT_TRUE(c[k] >= 0 && c[k] <= 1);
}

// All the same value: the middle of the map, not a division by zero.
TEST(ColorBy, ManagesWithoutARange) {
  ParticleSet set;
  set.positions.assign(3, {0, 0, 0});
  Attribute id;
  id.name = "id";
  id.type = AttributeType::int32;
  id.ints = {5, 5, 5};
  set.attributes.push_back(id);
  EXPECT_NEAR(color_by_attribute(set, "id", "grey", "f").colors[2].r, 0.5f, 1e-6);
}

}  // namespace
}  // namespace embrun

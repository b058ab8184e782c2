// Slabs, balls and bubbles whose picture can be written down.
//
// At an interface of Fresnel reflectance R, with A the share of light that one way through the body leaves, the light
// that a slab sends back from an environment of radiance 1 on the camera's side is
//   R + (1-R)^2 R A^2 (1 + R^2 A^2 + ...) = R + (1-R)^2 R A^2 / (1 - R^2 A^2)
// and what comes through from the other side (1-R)^2 A / (1 - R^2 A^2): the two radiance factors (n1/n2)^2 cancel.
// In a ball every inner hit of a path has the same angle, so with the same R and A the whole is
//   R + (1-R)^2 A (1 + R A + R^2 A^2 + ...) = R + (1-R)^2 A / (1 - R A).

#include <gtest/gtest.h>

#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

/// Fresnel's equations for unpolarised light, in double precision, from the angle of incidence.
double fresnel(double cos_i, double n) {
  const double sin_t = std::sqrt(1 - cos_i * cos_i) / n;
  if (sin_t >= 1) return 1;
  const double cos_t = std::sqrt(1 - sin_t * sin_t);
  const double s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
  const double p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
  return 0.5 * (s * s + p * p);
}

/// Within four standard errors (once in 16,000 by chance), and the error itself small enough to mean something.
void expect_value(const Measured& m, double expected, double largest_error) {
  EXPECT_NEAR(m.mean, expected, 4 * m.standard_error + 2e-5);
  EXPECT_LT(m.standard_error, largest_error);
  EXPECT_EQ(m.counters.contradictions, 0u);
  EXPECT_EQ(m.bad, 0u);
}

const MaterialDescription black = diffuse_material({0, 0, 0});
constexpr double n_glass = 2.5;
constexpr double absorption = 0.4;

/// A plate 0.5 m thick, seen under an angle; under it nothing, or a black floor.
SceneDescription slab(double degrees, bool dark_below, int samples = 40000) {
  const double a = degrees * M_PI / 180;
  SceneDescription scene = scene_seen({5 * std::sin(a), 5 * std::cos(a), 0}, {0, 0, 0}, pencil, 2, samples);
  scene.boxes.push_back(
      box({-1000, -0.5, -1000}, {1000, 0, 1000}, dielectric_material(n_glass, grey(static_cast<float>(absorption)))));
  if (dark_below) scene.patches.push_back(patch({0, -1, 0}, {1, 0, 0}, {0, 0, -1}, 5000, black));
  return scene;
}

class Slab : public ::testing::TestWithParam<double> {
 protected:
  const double cos_i = std::cos(GetParam() * M_PI / 180);
  const double cos_t = std::sqrt(1 - (1 - cos_i * cos_i) / (n_glass * n_glass));
  const double r = fresnel(cos_i, n_glass);
  const double a = std::exp(-absorption * 0.5 / cos_t);
};

TEST_P(Slab, ReflectsWhatItShould) {
  const double expected = r + (1 - r) * (1 - r) * r * a * a / (1 - r * r * a * a);
  expect_value(render_and_measure(slab(GetParam(), true)), expected, 0.003);
}

TEST_P(Slab, TransmitsWhatItShould) {
  const double reflected = r + (1 - r) * (1 - r) * r * a * a / (1 - r * r * a * a);
  const double transmitted = (1 - r) * (1 - r) * a / (1 - r * r * a * a);
  expect_value(render_and_measure(slab(GetParam(), false)), reflected + transmitted, 0.003);
}

// Depth N: N events at most, and the light met after the last one counts.
TEST_P(Slab, CountsEventsAsDepth) {
  const double t = 1 - r;
  const double events[] = {0, r, t * t * a, t * t * r * a * a, t * t * r * r * a * a * a};
  double expected = 0;
  for (int depth = 0; depth <= 4; ++depth) {
    SceneDescription scene = slab(GetParam(), false);
    scene.integrator.max_depth = depth;
    expected += events[depth];
    expect_value(render_and_measure(scene), expected, 0.003);
  }
}

INSTANTIATE_TEST_SUITE_P(Angles, Slab, ::testing::Values(0.5, 35.0, 60.0, 80.0));

class BallOfWater : public ::testing::TestWithParam<double> {};

// The ray passes the centre at a distance of GetParam() radii.
TEST_P(BallOfWater, ShowsTheSeries) {
  const double n = 1.33, radius = 0.3, sigma = 2, b = GetParam();
  SceneDescription scene = scene_seen({b * radius, 0, 4}, {b * radius, 0, 0}, pencil, 2, 40000);
  scene.balls.push_back(balls({{{0, 0, 0}, radius}}, dielectric_material(n, grey(static_cast<float>(sigma)))));
  const double cos_t = std::sqrt(1 - b * b / (n * n));
  const double r = fresnel(std::sqrt(1 - b * b), n), a = std::exp(-sigma * 2 * radius * cos_t);
  expect_value(render_and_measure(scene), r + (1 - r) * (1 - r) * a / (1 - r * a), 0.002);
}

// One refraction allowed: what gets in goes straight on, along the refracted direction, and out without reflection.
TEST_P(BallOfWater, StopsBendingAfterTheRefractionsAllowed) {
  const double n = 1.33, radius = 0.3, sigma = 2, b = GetParam();
  SceneDescription scene = scene_seen({b * radius, 0, 4}, {b * radius, 0, 0}, pencil, 2, 40000);
  scene.balls.push_back(balls({{{0, 0, 0}, radius}}, dielectric_material(n, grey(static_cast<float>(sigma)))));
  scene.integrator.max_refractions = 1;
  const double cos_t = std::sqrt(1 - b * b / (n * n));
  const double r = fresnel(std::sqrt(1 - b * b), n), a = std::exp(-sigma * 2 * radius * cos_t);
  expect_value(render_and_measure(scene), r + (1 - r) * a, 0.002);
}

INSTANTIATE_TEST_SUITE_P(Offsets, BallOfWater, ::testing::Values(0.0, 0.4, 0.7, 0.95));

// A lone particle is a ball of radius R0, so its picture is the ball's.
TEST(LoneParticle, ShowsTheSeriesOfABall) {
  const double n = 1.33, radius = 0.3, sigma = 2, b = 0.7;
  SceneDescription scene = scene_seen({b * radius, 0, 4}, {b * radius, 0, 0}, pencil, 2, 40000);
  FluidDescription drop;
  drop.positions = {{0, 0, 0}};
  drop.surface.radius = static_cast<float>(radius);
  drop.material = dielectric_material(n, grey(static_cast<float>(sigma)));
  scene.fluids.push_back(drop);
  const double cos_t = std::sqrt(1 - b * b / (n * n));
  const double r = fresnel(std::sqrt(1 - b * b), n), a = std::exp(-sigma * 2 * radius * cos_t);
  const Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, r + (1 - r) * (1 - r) * a / (1 - r * a), 4 * m.standard_error + 1e-3 * a);
}

// ---- media -------------------------------------------------------------------------------------------------------

// Balls of one dielectric that overlap are one solid: along the line of their centres the path is as long as the union,
// and there is no interface within.
TEST(Media, OverlappingBodiesOfOneKindAreOneSolid) {
  const double sigma = 1.5, n = 1.33;
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, pencil, 2, 40000);
  scene.balls.push_back(balls({{{0, 0, 0}, 0.5}, {{0, 0, 0.4}, 0.3}, {{0, 0, -0.6}, 0.3}, {{0, 0, 0.05}, 0.1}},
                              dielectric_material(n, grey(static_cast<float>(sigma)))));
  const double r = fresnel(1, n), a = std::exp(-sigma * 1.6);  // from z = -0.9 to 0.7
  expect_value(render_and_measure(scene), r + (1 - r) * (1 - r) * a / (1 - r * a), 0.002);
}

// An air bubble, of higher priority than the water it is in, takes away what it covers; where it sticks out of the
// water it is air in air, which is nothing. With indices of 1 the light comes straight through: exp(-sigma * water).
TEST(Media, ABubbleIsAHoleInWaterAndNothingInAir) {
  const float sigma = 1.5f;
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, pencil, 2, 16);
  scene.boxes.push_back(box({-1, -1, -1}, {1, 1, 1}, dielectric_material(1, grey(sigma), 1)));
  scene.balls.push_back(
      balls({{{0, 0, 0}, 0.25}, {{0, 0, 1}, 0.5}, {{0, 0, 2.5}, 0.2}}, dielectric_material(1, {}, 2)));
  const Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, std::exp(-1.5 * (2 - 0.5 - 0.5)), 1e-5);
  EXPECT_EQ(m.counters.scatterings, 0u);
  EXPECT_EQ(m.counters.contradictions, 0u);
}

// The lower priority leaves no trace inside the higher, whichever is entered first.
TEST(Media, TheHighestPriorityCounts) {
  SceneDescription scene = scene_seen({0, 0, 6}, {0, 0, 0}, pencil, 2, 16);
  scene.boxes.push_back(box({-1, -1, -1}, {1, 1, 0}, dielectric_material(1, grey(0.5f), 1)));
  scene.boxes.push_back(box({-1, -1, -0.5}, {1, 1, 1}, dielectric_material(1, grey(2), 3)));
  scene.boxes.push_back(box({-1, -1, -0.75}, {1, 1, -0.25}, dielectric_material(1, grey(1), 2)));
  const Measured m = render_and_measure(scene);
  // z: 1 .. -0.5 in the third class, .. -0.75 in the second, .. -1 in the first.
  EXPECT_NEAR(m.mean, std::exp(-2 * 1.5 - 1 * 0.25 - 0.5 * 0.25), 1e-5);
}

// A camera in the water starts there: at the wall of its tank it sees what a ray from inside sees, and radiance in water
// is n^2 times that of the air outside.
TEST(Media, TheCameraMayBeInTheWater) {
  const double n = 1.33;
  SceneDescription scene = scene_seen({0, 0, 0}, {0, 0, -1}, pencil, 2, 40000);
  scene.boxes.push_back(box({-1, -1, -1}, {1, 1, 1}, dielectric_material(n, grey(0.7f))));
  const double r = fresnel(1, n), near = std::exp(-0.7), whole = std::exp(-1.4);
  expect_value(render_and_measure(scene), n * n * (1 - r) * near / (1 - r * whole), 0.005);
}

// A mesh has an inside too, and its containment is known where a path starts.
TEST(Media, TheCameraMayBeInAMesh) {
  SceneDescription scene = scene_seen({0.1, 0.2, 0}, {0.1, 0.2, -1}, pencil, 2, 16);
  MeshDescription cube;
  for (int i = 0; i < 8; ++i)
    cube.mesh.positions.push_back({i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 1.0f : -1.0f});
  cube.mesh.triangles = {{{0, 4, 6}}, {{0, 6, 2}}, {{1, 3, 7}}, {{1, 7, 5}}, {{0, 1, 5}}, {{0, 5, 4}},
                         {{2, 6, 7}}, {{2, 7, 3}}, {{0, 2, 3}}, {{0, 3, 1}}, {{4, 5, 7}}, {{4, 7, 6}}};
  cube.material = dielectric_material(1, grey(0.7f));
  scene.meshes.push_back(cube);
  const Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, std::exp(-0.7), 1e-5);
  EXPECT_EQ(m.counters.contradictions, 0u);
}

}  // namespace
}  // namespace embrun

// What is chosen when the user chooses nothing.

#include "render/default_scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "backend/cpu/cpu_backend.h"
#include "base/error.h"
#include "io/read_particles.h"
#include "scene/compile.h"

namespace embrun {
namespace {

ParticleSet block_of_water(double s = 0.1) {
  ParticleSet set;
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 8; ++j)
      for (int k = 0; k < 10; ++k) set.positions.push_back({s * (i + 0.5), s * (j + 0.5), s * (k + 0.5)});
  return set;
}

MeasuredParticles measured(ParticleSet set, const RenderOptions& options = {}) {
  return measure(std::move(set), options, "test");
}

SceneDescription scene_of(const ParticleSet& set, const RenderOptions& options = {}) {
  std::vector<std::string> notes;
  return make_scene(measured(set, options), options, notes);
}

/// Place in the picture, -1 to 1 each way across the whole of it.
struct Place {
  double x, y;
};
Place place_in_picture(const SceneDescription& scene, Vec3d p) {
  const CameraSettings& c = scene.camera;
  const Vec3d forward = normalize(c.target - c.eye), right = normalize(cross(forward, c.up)),
              up = cross(right, forward);
  const Vec3d v = p - c.eye;
  const double half = std::tan(0.5 * c.vertical_fov * M_PI / 180) * dot(v, forward);
  return {dot(v, right) / (half * scene.film.width / scene.film.height), dot(v, up) / half};
}

TEST(DefaultScene, TheCameraSeesAllParticles) {
  const ParticleSet set = block_of_water();
  for (const char* view : {"front", "side", "top", "three-quarter"}) {
    RenderOptions options;
    options.view = view;
    const SceneDescription scene = scene_of(set, options);
    double reach = 0;
    for (const Vec3d& p : set.positions) {
      const Place place = place_in_picture(scene, p);
      EXPECT_LT(std::abs(place.x), 1) << view;
      EXPECT_LT(std::abs(place.y), 1) << view;
      reach = std::max({reach, std::abs(place.x), std::abs(place.y)});
    }
    EXPECT_GT(reach, 0.6) << view;  // and does not stand far off
  }
}

TEST(DefaultScene, StraysDoNotMoveTheCamera) {
  ParticleSet set = block_of_water(0.05);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) set.positions.push_back({0.1 * i, 0.1 * j, -0.03});
  const CameraSettings before = scene_of(set).camera;
  set.positions.push_back({40, 60, 10});
  const CameraSettings after = scene_of(set).camera;
  EXPECT_LT(length(after.eye - before.eye), 0.3);
}

// The floor is within the lowest layer: above its underside, so no air is under it, and not above its centres by much.
TEST(DefaultScene, TheFloorCutsTheLowestLayer) {
  RenderOptions options;
  for (const char* up : {"y", "z"}) {
    options.up = up;
    const SceneDescription scene = scene_of(block_of_water(), options);
    ASSERT_EQ(scene.patches.size(), 1u);
    const Vec3d c = scene.patches[0].center;
    const double height = up[0] == 'y' ? c.y : c.z;
    EXPECT_GT(height, 0.02);
    EXPECT_LT(height, 0.07);
    const Vec3d normal = cross(scene.patches[0].axis_u, scene.patches[0].axis_v);
    EXPECT_NEAR(up[0] == 'y' ? normal.y : normal.z, 1, 1e-6);
  }
}

// On the real frames, whose lowest layer is uneven: everywhere under the water, what is at the floor is water.
TEST(DefaultScene, TheFloorIsUnderWaterInTheRealPool) {
  const RenderOptions options;
  const ParticleSet pool = read_particles(std::string(EMBRUN_DATA_DIR) + "/calm_pool.bgeo");
  const MeasuredParticles particles = measured(pool);
  std::vector<std::string> notes;
  const SceneDescription scene = make_scene(particles, options, notes);
  const FlatScene flat = compile(scene);
  const CpuBackend backend(flat);
  const double height = scene.patches[0].center.y;
  EXPECT_NEAR(height, 0, 0.02);  // the centres of the lowest layer are at about 0
  int dry = 0, places = 0;
  for (double x = -2.1; x <= 2.1; x += 0.03)
    for (double z = -1.35; z <= 1.35; z += 0.03, ++places)
      dry += backend.kernels()
                 .media_at(backend.view(), to_float(Vec3d{x, height + 1e-4, z} - flat.recentring), 0.0f)
                 .counts == 0;
  EXPECT_LE(dry, places / 1000);
}

TEST(DefaultScene, AContainerIsFilledToItsWalls) {
  RenderOptions options;
  options.container = {-2.25, -0.05, -1.5, 2.25, 5.95, 1.5};
  const ParticleSet pool = read_particles(std::string(EMBRUN_DATA_DIR) + "/calm_pool.bgeo");
  std::vector<std::string> notes;
  const SceneDescription scene = make_scene(measured(pool), options, notes);
  EXPECT_EQ(scene.patches[0].center.y, -0.05);
  const FlatScene flat = compile(scene);
  const CpuBackend backend(flat);
  const auto wet = [&](Vec3d p) {
    return backend.kernels().media_at(backend.view(), to_float(p - flat.recentring), 0.0f).counts != 0;
  };
  int dry = 0, places = 0;
  constexpr double near = 1e-3;
  for (double x = -2.2; x <= 2.2; x += 0.05)
    for (double y = 0; y <= 0.7; y += 0.05, ++places) dry += !wet({x, y, 1.5 - near}) + !wet({x, y, near - 1.5});
  for (double x = -2.249; x <= 2.249; x += 0.05)
    for (double z = -1.499; z <= 1.499; z += 0.05, ++places) dry += !wet({x, near - 0.05, z});
  EXPECT_LE(dry, places / 1000);
  EXPECT_FALSE(wet({0, 0.5, 1.5 + near}));
}

TEST(DefaultScene, OptionsReachTheScene) {
  RenderOptions options;
  options.camera_from = Point{1, 2, 3};
  options.camera_to = Point{4, 5, 6};
  options.fov = 50;
  options.order = 2;
  options.kernel = "blinn";
  options.threshold = "1.5";
  options.recover = "off";
  options.normal = "gradient";
  options.method = "thesis";
  options.radius = 0.07;
  options.ior = 1.4;
  options.absorption = Color{1, 2, 3};
  options.environment = "white";
  options.floor = "none";
  options.container = {0, 0, 0, 1, 1, 1};
  options.crop = {1, 2, 3, 4};
  options.seed = 9;
  options.samples = 5;
  options.max_depth = 7;
  options.refractions = 2;
  const SceneDescription scene = scene_of(block_of_water(), options);
  EXPECT_EQ(scene.camera.eye.y, 2);
  EXPECT_EQ(scene.camera.target.z, 6);
  EXPECT_EQ(scene.camera.vertical_fov, 50);
  const FluidDescription& fluid = scene.fluids.at(0);
  EXPECT_EQ(fluid.surface.order, 2);
  EXPECT_EQ(fluid.surface.kernel, Kernel::blinn);
  EXPECT_EQ(fluid.surface.threshold_mode, ThresholdMode::number);
  EXPECT_EQ(fluid.surface.threshold, 1.5f);
  EXPECT_EQ(fluid.surface.recover, RecoverMode::off);
  EXPECT_EQ(fluid.surface.normal, NormalMode::gradient);
  EXPECT_EQ(fluid.surface.radius, 0.07f);
  EXPECT_NEAR(fluid.surface.spacing, 0.1, 0.005);  // measured, whatever the radius
  EXPECT_EQ(fluid.method, SurfaceMethod::thesis);
  EXPECT_EQ(fluid.material.ior, 1.4);
  EXPECT_EQ(fluid.material.absorption.b, 3);
  EXPECT_EQ(fluid.container->high.x, 1);
  EXPECT_EQ(scene.environment.kind, EnvironmentDescription::Kind::constant);
  EXPECT_TRUE(scene.patches.empty());
  EXPECT_EQ(scene.film.crop->height, 4);
  EXPECT_EQ(scene.integrator.seed, 9u);
  EXPECT_EQ(scene.integrator.samples, 5);
  EXPECT_EQ(scene.integrator.max_depth, 7);
  EXPECT_EQ(scene.integrator.max_refractions, 2);
}

// The sun's light is the same whatever its size: on a level floor, the sky's own irradiance and sin(42 degrees) of the
// sun's; towards a disk of the real sun's size the radiance is E / (pi sin^2(radius)).
TEST(DefaultScene, TheSunHasTheSizeThatIsAskedFor) {
  constexpr double degree = 3.14159265358979 / 180;
  const auto compiled = [](std::optional<double> sun) {
    RenderOptions options;
    options.sun = sun;
    return compile(scene_of(block_of_water(), options));
  };
  // Irradiance of a level floor from the scene's lights, by their own sampling, and radiance towards the sun.
  const auto irradiance = [](const FlatScene& scene) {
    const LightSet lights = scene.lights.view();
    constexpr int side = 200;
    double sum = 0;
    for (int i = 0; i < 8 * side * side; ++i) {
      const Sample2 u{(static_cast<float>(i / 8 % side) + 0.5f) / side,
                      (static_cast<float>(i / 8 / side) + 0.5f) / side};
      const double choice = std::fmod(i * 0.6180339887498949, 1.0);  // evenly spread for any share of the lights
      const LightSample light = sample_lights(lights, {}, static_cast<float>(choice), u);
      if (light.valid && light.direction.y > 0)
        sum += static_cast<double>(luminance(light.radiance) * light.direction.y / light.pdf);
    }
    return sum / (8 * side * side);
  };
  const auto towards_sun = [](const FlatScene& scene) {
    const double azimuth = SkySettings{}.sun_azimuth * degree, height = SkySettings{}.sun_elevation * degree;
    // Azimuth 0 is the viewer's side (+z), 90 the right (+x).
    const Vec3d d{std::cos(height) * std::sin(azimuth), std::sin(height), std::cos(height) * std::cos(azimuth)};
    return static_cast<double>(luminance(escaped_light(scene.lights.view(), to_float(d)).radiance));
  };
  const SkySettings sky;
  const double sun_on_floor = sky.sun_irradiance * std::sin(sky.sun_elevation * degree);
  const FlatScene none = compiled(0.0), soft = compiled({}), disk = compiled(0.53);
  EXPECT_NEAR(irradiance(none), sky.sky_irradiance, 0.02);
  EXPECT_NEAR(irradiance(soft), sky.sky_irradiance + sun_on_floor, 0.03);
  EXPECT_NEAR(irradiance(disk), sky.sky_irradiance + sun_on_floor, 0.03);
  const double sine = std::sin(0.265 * degree);
  EXPECT_NEAR(towards_sun(disk), sky.sun_irradiance / (3.14159265358979 * sine * sine), 20);  // of 17,857
  EXPECT_LT(towards_sun(soft), 100);
  EXPECT_LT(towards_sun(none), 5);
}

TEST(DefaultScene, ASingleParticleIsADrop) {
  ParticleSet set;
  set.positions = {{3, 4, 5}};
  RenderOptions options;
  options.radius = 0.1;
  EXPECT_NO_THROW(compile(scene_of(set, options)));
  EXPECT_THROW(measured(set), Error);  // no radius to be had
}

}  // namespace
}  // namespace embrun

// Scene files as they are rendered.

#include <gtest/gtest.h>

#include <filesystem>

#include "embrun/embrun.h"
#include "image/metrics.h"
#include "io/file_bytes.h"
#include "io/image_read.h"
#include "io/read_particles.h"
#include "io/read_scene.h"
#include "render/default_scene.h"
#include "render/scene_file_meshes.h"
#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

// The very file that Mitsuba was given for a picture of bubbles and balls in water, with its meshes made anew, renders to
// that picture: at an eighth of its resolution, where a pixel is a block of the reference.
TEST(SceneFile, OfAnotherRendererGivesItsPicture) {
  const std::string folder = std::string(EMBRUN_TEST_DATA_DIR) + "/nested_spheres/";
  const auto read = [&](const std::string& path) {
    const std::string name = std::filesystem::path(path).filename();
    const std::string made = name == "floor2_light.ply"  ? floor_ply(4, 0.25, true)
                             : name == "floor2_dark.ply" ? floor_ply(4, 0.25, false)
                             : name == "s2_water.ply"    ? box_ply({-1, 0, -1}, {1, 1, 1})
                                                         : "";
    return made.empty() ? read_file_bytes(path) : bytes_of(made);
  };
  SceneFile file = read_scene(folder + "scene.m3.xml", {}, read);
  SceneDescription& scene = file.scene;
  ASSERT_EQ(scene.balls.size(), 2u);
  EXPECT_EQ(scene.balls[0].balls.size(), 24u);
  EXPECT_EQ(scene.balls[0].material.priority, 2);
  EXPECT_EQ(scene.balls[0].material.ior, 1);
  EXPECT_EQ(scene.meshes.size(), 3u);
  EXPECT_EQ(scene.integrator.max_depth, 64);
  EXPECT_EQ(scene.film.width, 512);

  scene.film.width = scene.film.height = 64;
  scene.integrator.samples = 512;
  const RenderResult result = render(scene);
  EXPECT_EQ(result.counts.paths.contradictions, 0u);
  const Image reference = read_image(folder + "reference.pfm");
  const double expected = mean_value(reference);
  EXPECT_NEAR(measure(result.film).mean, expected, 0.001 * expected);
}

// What the command line makes of a particle file, a scene file says as well.
TEST(SceneFile, SaysWhatTheCommandLineSays) {
  const std::string particles = std::string(EMBRUN_DATA_DIR) + "/droplets.ply";
  RenderOptions options;
  options.width = 320;
  options.height = 200;
  options.samples = 7;
  options.seed = 5;
  options.floor = "checker";
  options.camera_from = Point{1, 2, 3};
  options.absorption = Color{0.1f, 0.2f, 0.3f};
  options.filter = "gaussian";
  options.max_depth = 12;
  options.up = "z";
  for (const char* environment : {"sky", "studio", "white"}) {
    options.environment = environment;
    std::vector<std::string> notes;
    const std::string text = describe_scene(particles, options, notes);
    MeasuredParticles measured = measure(read_particles(particles), options, particles);
    measured.file = particles;
    const SceneDescription expected = make_scene(measured, options, notes);
    const SceneFile again = read_scene("/scene.xml", {}, [&](const std::string& path) {
      return path == "/scene.xml" ? bytes_of(text) : read_file_bytes(path);
    });
    EXPECT_TRUE(again.scene == expected) << text;
    EXPECT_TRUE(again.warnings.empty());
  }
}

}  // namespace
}  // namespace embrun

// Scene files as they are rendered.

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "embrun/embrun.h"
#include "image/metrics.h"
#include "io/file_bytes.h"
#include "io/image_read.h"
#include "io/read_particles.h"
#include "io/read_scene.h"
#include "render/default_scene.h"
#include "render/transport.h"

namespace embrun {
namespace {

using namespace testing_support;

/// A mesh as a PLY file.
std::string ply_of(const std::vector<Vec3d>& positions, const std::vector<std::array<int, 3>>& triangles) {
  std::ostringstream out;
  out << "ply\nformat ascii 1.0\nelement vertex " << positions.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << triangles.size()
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3d& p : positions) out << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (const auto& t : triangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  return out.str();
}

/// The light or dark cells of the references' floor, as a mesh that is seen from above.
std::string floor_ply(double extent, double cell, bool light) {
  std::vector<Vec3d> positions;
  std::vector<std::array<int, 3>> triangles;
  const int half = static_cast<int>(extent / cell);
  for (int i = -half; i < half; ++i)
    for (int j = -half; j < half; ++j) {
      if (((i + j) % 2 == 0) != light) continue;
      const int first = static_cast<int>(positions.size());
      for (const auto& [a, b] : {std::pair{0, 0}, {0, 1}, {1, 1}, {1, 0}})
        positions.push_back({(i + a) * cell, -0.05, (j + b) * cell});
      triangles.push_back({first, first + 1, first + 2});
      triangles.push_back({first, first + 2, first + 3});
    }
  return ply_of(positions, triangles);
}

/// [-1, 1] x [0, 1] x [-1, 1]
std::string water_ply() {
  std::vector<Vec3d> positions;
  for (int i = 0; i < 8; ++i) positions.push_back({i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : 0.0, i & 4 ? 1.0 : -1.0});
  return ply_of(positions, {{0, 4, 6},
                            {0, 6, 2},
                            {1, 3, 7},
                            {1, 7, 5},
                            {0, 1, 5},
                            {0, 5, 4},
                            {2, 6, 7},
                            {2, 7, 3},
                            {0, 2, 3},
                            {0, 3, 1},
                            {4, 5, 7},
                            {4, 7, 6}});
}

// The very file that Mitsuba was given for a picture of bubbles and balls in water, with its meshes made anew, renders to
// that picture: at an eighth of its resolution, where a pixel is a block of the reference.
TEST(SceneFile, OfAnotherRendererGivesItsPicture) {
  const std::string folder = std::string(EMBRUN_TEST_DATA_DIR) + "/nested_spheres/";
  const auto read = [&](const std::string& path) {
    const std::string name = std::filesystem::path(path).filename();
    const std::string made = name == "floor2_light.ply"  ? floor_ply(4, 0.25, true)
                             : name == "floor2_dark.ply" ? floor_ply(4, 0.25, false)
                             : name == "s2_water.ply"    ? water_ply()
                                                         : "";
    if (made.empty()) return read_file_bytes(path);
    std::vector<std::byte> bytes(made.size());
    std::memcpy(bytes.data(), made.data(), made.size());
    return bytes;
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
      if (path != "/scene.xml") return read_file_bytes(path);
      std::vector<std::byte> bytes(text.size());
      std::memcpy(bytes.data(), text.data(), text.size());
      return bytes;
    });
    EXPECT_TRUE(again.scene == expected) << text;
    EXPECT_TRUE(again.warnings.empty());
  }
}

}  // namespace
}  // namespace embrun

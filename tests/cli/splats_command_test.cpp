// Files of splats, from the command line.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "cli_fixture.h"
#include "io/image_read.h"

namespace embrun {
namespace {

/// A ball's points along a spiral from its pole, or the first of them, with normals and colours, in binary PLY.
void write_ball(const fs::path& file, int count, int first) {
  std::ofstream out(file, std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\nelement vertex " << first << '\n';
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) out << "property float " << name << '\n';
  for (const char* name : {"red", "green", "blue"}) out << "property uchar " << name << '\n';
  out << "end_header\n";
  for (int i = 0; i < first; ++i) {
    const double y = 1 - (2 * i + 1) / static_cast<double>(count), angle = 2.39996322972865332 * i;
    const double r = std::sqrt(1 - y * y);
    const float p[6] = {
        static_cast<float>(r * std::cos(angle)), static_cast<float>(y), static_cast<float>(r * std::sin(angle)),
        static_cast<float>(r * std::cos(angle)), static_cast<float>(y), static_cast<float>(r * std::sin(angle))};
    out.write(reinterpret_cast<const char*>(p), sizeof p);
    out.write("\xff\x80\x10", 3);
  }
}

void write_ball(const fs::path& file, int count) { write_ball(file, count, count); }

double mean_difference(const Image& a, const Image& b) {
  double difference = 0, sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    difference += std::fabs(static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i]));
    sum += static_cast<double>(b.pixels[i]);
  }
  return difference / sum;
}

TEST_F(Cli, SplatsOfAFileShowWhatItsPointsShow) {
  write_ball(folder / "ball.ply", 30000);
  const Outcome made = run("splats ball.ply -o ball.splats --json r.json");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("closed, with colours"), std::string::npos) << made.out;
  const auto report = nlohmann::json::parse(content_of(folder / "r.json"));
  EXPECT_EQ(report["splats"], 30000);
  EXPECT_FALSE(report["streamed"].get<bool>());
  EXPECT_EQ(report["file_bytes"], fs::file_size(folder / "ball.splats"));
  // Without levels the picture is that of the points: all that differs is the rounding of places.
  const std::string flags = " --layer albedo --floor none --camera-from 0,0,5 --camera-to 0,0,0 --fov 30" + small;
  ASSERT_EQ(run("render ball.ply -o points.pfm" + flags).exit_code, 0);
  ASSERT_EQ(run("render ball.splats -o splats.pfm --lod 0" + flags).exit_code, 0);
  ASSERT_EQ(run("render ball.splats -o levels.pfm --lod 4" + flags).exit_code, 0);
  const Image points = read_image(folder / "points.pfm");
  EXPECT_LT(mean_difference(read_image(folder / "splats.pfm"), points), 1e-3);
  EXPECT_LT(mean_difference(read_image(folder / "levels.pfm"), points), 5e-2);
  // In a scene as well, and that scene written out.
  const std::string rough = "render ball.splats --lod 2 --floor none" + small;
  ASSERT_EQ(run(rough + "--write-scene scene.xml").exit_code, 0);
  ASSERT_EQ(run(rough + "-o direct.pfm").exit_code, 0);
  EXPECT_NE(content_of(folder / "scene.xml").find("<float name=\"detail\" value=\"2\"/>"), std::string::npos);
  ASSERT_EQ(run("render scene.xml -o scene.pfm").exit_code, 0);
  EXPECT_EQ(content_of(folder / "scene.pfm"), content_of(folder / "direct.pfm"));
  const Outcome info = run("info ball.splats");
  EXPECT_NE(info.out.find("30000 splats"), std::string::npos) << info.out << info.err;
}

TEST_F(Cli, PointsThatAreReadInPiecesMakeAFileOfTheirOwn) {
  write_ball(folder / "ball.ply", 20000);
  ASSERT_EQ(run("splats ball.ply -o a.splats --stream --memory 0.001 --json r.json").exit_code, 0);
  ASSERT_EQ(run("splats ball.ply -o b.splats --stream --closed yes --threads 1").exit_code, 0);
  EXPECT_TRUE(content_of(folder / "a.splats") == content_of(folder / "b.splats"));
  const auto report = nlohmann::json::parse(content_of(folder / "r.json"));
  EXPECT_TRUE(report["streamed"].get<bool>());
  EXPECT_EQ(report["radius"]["source"], "spacing");
  EXPECT_TRUE(report["closed"].get<bool>());
  // Without its lower half it is not.
  write_ball(folder / "bowl.ply", 20000, 10000);
  ASSERT_EQ(run("splats bowl.ply -o bowl.splats --stream --json r.json").exit_code, 0);
  EXPECT_FALSE(nlohmann::json::parse(content_of(folder / "r.json"))["closed"].get<bool>());
  EXPECT_EQ(run("render a.splats -o a.pfm" + small).exit_code, 0);
}

TEST_F(Cli, SplatsThatCannotBeMadeSayWhy) {
  write_ball(folder / "ball.ply", 100);
  EXPECT_EQ(run("splats ball.ply -o ball.ply").exit_code, 1);
  EXPECT_EQ(run("splats none.ply -o a.splats").exit_code, 1);
  EXPECT_EQ(run("splats ball.ply -o a.splats --memory 0").exit_code, 2);
  EXPECT_EQ(run("splats ball.ply -o a.splats --splat-shape ellipse").exit_code, 2);
  EXPECT_EQ(run("splats ball.ply -o a.splats --stream --thin 0.1").exit_code, 1);
  EXPECT_EQ(run("splats ball.ply -o a.splats --scratch none").exit_code, 1);
  EXPECT_FALSE(fs::exists(folder / "a.splats"));
  EXPECT_EQ(run("render ball.ply -o a.pfm --lod -1" + small).exit_code, 2);
  std::ofstream(folder / "bad.splats") << "EMBRUNSP and no more";
  const Outcome bad = run("render bad.splats -o a.pfm" + small);
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_NE(bad.err.find("bad.splats: offset"), std::string::npos) << bad.err;
}

}  // namespace
}  // namespace embrun

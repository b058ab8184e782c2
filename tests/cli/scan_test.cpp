// Scans, points of surfaces, from the command line.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "cli_fixture.h"
#include "io/image_read.h"

namespace embrun {
namespace {

/// A sphere's 2,000 points along a spiral, without normals; `extra` ends each line.
void write_ball(const fs::path& file, const std::string& header, const std::string& extra) {
  std::ofstream points(file);
  points << header << '\n';
  for (int i = 0; i < 2000; ++i) {
    const double y = 1 - (2 * i + 1) / 2000.0, angle = 2.39996322972865332 * i, r = std::sqrt(1 - y * y);
    points << r * std::cos(angle) << ' ' << y << ' ' << r * std::sin(angle) << extra << '\n';
  }
}

TEST_F(Cli, AScanIsASurfaceOnTheFloor) {
  write_ball(folder / "ball.xyz", "x y z red green blue", " 255 0 0");
  const Outcome outcome = run("render ball.xyz -o a.pfm --json r.json" + small);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* words : {"taken for a scan: the file has the attribute color", "colours: from the file",
                            "normals: estimated from 16 neighbours, outwards", "closed: yes"})
    EXPECT_NE(outcome.out.find(words), std::string::npos) << words << outcome.out;
  const auto report = nlohmann::json::parse(content_of(folder / "r.json"));
  EXPECT_NEAR(report["floor_height"], -1, 0.01);
  EXPECT_FALSE(report["scan"].empty());
  // The middle of the picture is a red ball.
  ASSERT_EQ(run("render ball.xyz -o albedo.pfm --layer albedo" + small).exit_code, 0);
  const Image albedo = read_image(folder / "albedo.pfm");
  const std::size_t middle = (static_cast<std::size_t>(albedo.height / 2) * static_cast<std::size_t>(albedo.width) +
                              static_cast<std::size_t>(albedo.width / 2)) *
                             3;
  EXPECT_NEAR(albedo.pixels[middle], 1, 1e-3f);
  EXPECT_NEAR(albedo.pixels[middle + 1], 0, 1e-3f);
  // The scene file says the same.
  ASSERT_EQ(run("render ball.xyz -o b.pfm --write-scene ball.xml" + small).exit_code, 0);
  ASSERT_EQ(run("render ball.xml -o b.pfm").exit_code, 0);
  EXPECT_EQ(content_of(folder / "a.pfm"), content_of(folder / "b.pfm"));
}

TEST_F(Cli, WhatPointsAreMayBeSaid) {
  write_ball(folder / "ball.xyz", "x y z", "");
  EXPECT_NE(run("info ball.xyz").out.find("2000 points of a surface"), std::string::npos);
  EXPECT_NE(run("info ball.xyz --points fluid").out.find("2000 particles"), std::string::npos);
  EXPECT_NE(run("info water.xyz --points surface").out.find("taken for a scan: as asked"), std::string::npos);
  const Outcome info = run("info ball.xyz --sensor 0,0,9 --splat-radius 0.2 --closed no");
  EXPECT_NE(info.out.find("towards the sensor at (0, 0, 9)"), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("splat radius: 0.2 m"), std::string::npos);
  EXPECT_NE(info.out.find("closed: no, as asked"), std::string::npos);
  EXPECT_EQ(run("render ball.xyz -o x.pfm --points fluid" + small).exit_code, 0);
  expect_refused("render ball.xyz -o x.pfm --extinction 3" + small, 1, "that is for fluids");
  expect_refused("render ball.xyz -o x.pfm --closed perhaps" + small, 2, "perhaps");
  expect_refused("info ball.xyz --sensor 1,2", 2, "--sensor");
}

TEST_F(Cli, AScanMayBeAnMlsSurface) {
  write_ball(folder / "ball.xyz", "x y z", "");
  ASSERT_EQ(run("render ball.xyz -o splats.pfm" + small).exit_code, 0);
  const Outcome outcome = run("render ball.xyz -o a.pfm --point-surface mls --mls-support 3" + small);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(content_of(folder / "a.pfm"), content_of(folder / "splats.pfm"));
  // The scene file says the same.
  ASSERT_EQ(run("render ball.xyz --point-surface mls --mls-support 3 --write-scene ball.xml" + small).exit_code, 0);
  ASSERT_EQ(run("render ball.xml -o b.pfm").exit_code, 0);
  EXPECT_EQ(content_of(folder / "a.pfm"), content_of(folder / "b.pfm"));

  expect_refused("render ball.xyz -o x.pfm --point-surface mesh" + small, 2, "splats, mls");
  expect_refused("render ball.xyz -o x.pfm --mls-support 3" + small, 2, "for the surface of points");
  expect_refused("render ball.xyz -o x.pfm --point-surface mls --mls-support 0" + small, 2, "[1, 16]");
  expect_refused("render ball.xyz -o x.pfm --point-surface mls --splat-shape ellipse" + small, 2, "ellipses");
  expect_refused("render ball.xyz -o x.pfm --point-surface mls --points fluid" + small, 1, "that is for scans");
}

// The bundled cloud: points and paint, and nothing else.
TEST_F(Cli, APaintedCloudStandsInWater) {
  const std::string data = EMBRUN_DATA_DIR;
  const Outcome outcome =
      run("render " + data + "/duck.ply -o albedo.pfm --layer albedo --floor none --size 64x36 --spp 16");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* words : {"normals: estimated", "outwards", "colours: from the file", "closed: yes", " 0 outliers"})
    EXPECT_NE(outcome.out.find(words), std::string::npos) << words << outcome.out;
  // The paint is sRGB (250, 200, 40) on most of what is seen, and red with white dots on the scarf. What is not the duck is
  // white or black.
  const Image albedo = read_image(folder / "albedo.pfm");
  int yellow = 0, red = 0;
  for (std::size_t i = 0; i < albedo.pixels.size(); i += 3) {
    const float r = albedo.pixels[i], g = albedo.pixels[i + 1], b = albedo.pixels[i + 2];
    yellow += r > 0.9f && std::fabs(g - 0.578f) < 0.1f && b < 0.15f;
    red += r > 0.4f && g < 0.3f && b < 0.3f && std::fabs(g - b) < 0.05f;
  }
  EXPECT_GT(yellow, 64 * 36 / 16);
  EXPECT_GT(red, 4);

  ASSERT_EQ(run("render " + data + "/duck_in_pool.xml -o duck.pfm --size 32x18 --spp 2 --json r.json").exit_code, 0);
  const auto report = nlohmann::json::parse(content_of(folder / "r.json"));
  EXPECT_EQ(report["bad_samples"]["count"], 0);
  EXPECT_GT(report["rays"]["secondary_inside"]["count"], 100);
}

}  // namespace
}  // namespace embrun

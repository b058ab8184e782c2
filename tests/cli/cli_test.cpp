// The program as a shell meets it: exit codes, messages, files.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "cli_fixture.h"
#include "io/image_read.h"
#include "io/read_mesh.h"

namespace embrun {
namespace {

TEST_F(Cli, RendersWithNothingButTheInput) {
  const Outcome outcome = run("render water.xyz -o x.png --size 48x32 --spp 2");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const Image image = read_image(folder / "x.png");
  EXPECT_EQ(image.width, 48);
  EXPECT_EQ(image.height, 32);
  EXPECT_NE(outcome.out.find("pin with   --camera-from "), std::string::npos);
  EXPECT_NE(outcome.out.find("217"), std::string::npos);  // particles
  EXPECT_NE(outcome.err.find("rendering 100 %"), std::string::npos);
  EXPECT_EQ(outcome.err.find('\r'), std::string::npos) << "a bar, and this is no terminal";
  EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos);
}

TEST_F(Cli, TheSameSeedGivesTheSameFileOnAnyThreads) {
  ASSERT_EQ(run("render water.xyz -o a.pfm --threads 1" + small).exit_code, 0);
  ASSERT_EQ(run("render water.xyz -o b.pfm --threads 3" + small).exit_code, 0);
  ASSERT_EQ(run("render water.xyz -o c.pfm --seed 5" + small).exit_code, 0);
  EXPECT_EQ(content_of(folder / "a.pfm"), content_of(folder / "b.pfm"));
  EXPECT_NE(content_of(folder / "a.pfm"), content_of(folder / "c.pfm"));
}

// The flags that the report names make the very same picture when given.
TEST_F(Cli, PinningFlagsPin) {
  ASSERT_EQ(run("render water.xyz -o a.pfm --json r.json" + small).exit_code, 0);
  const auto report = nlohmann::json::parse(content_of(folder / "r.json"));
  const std::string flags = report["pinning_flags"];
  for (const char* flag : {"--camera-from", "--camera-to", "--fov", "--radius", "--threshold", "--floor-height"})
    EXPECT_NE(flags.find(flag), std::string::npos) << flag;
  ASSERT_EQ(run("render water.xyz -o b.pfm --json s.json " + flags + small).exit_code, 0);
  const auto pinned = nlohmann::json::parse(content_of(folder / "s.json"));
  EXPECT_EQ(pinned["pinning_flags"], flags);
  EXPECT_EQ(content_of(folder / "a.pfm"), content_of(folder / "b.pfm"));
}

TEST_F(Cli, WritesAReport) {
  ASSERT_EQ(run("render water.xyz -o x.exr --json report.json -q" + small).exit_code, 0);
  const auto r = nlohmann::json::parse(content_of(folder / "report.json"));
  for (const char* stage : {"read", "build", "render", "write", "total", "cpu", "meshing", "tree"})
    EXPECT_GE(r["seconds"][stage], 0.0) << stage;
  for (const char* kind : {"camera", "secondary_outside", "secondary_inside", "shadow"}) {
    EXPECT_TRUE(r["rays"][kind]["count"].is_number_unsigned()) << kind;
    EXPECT_TRUE(r["rays"][kind]["per_second"].is_number()) << kind;
  }
  EXPECT_EQ(r["rays"]["camera"]["count"], 32 * 24 * 2);
  EXPECT_EQ(r["particles"]["count"], 217);
  EXPECT_EQ(r["bad_samples"]["count"], 0);
  EXPECT_EQ(r["medium_contradictions"], 0);
  EXPECT_EQ(r["picture"]["samples"], 32 * 24 * 2);
  EXPECT_FALSE(r["picture"]["interrupted"]);
  EXPECT_GT(r["machine"]["peak_memory_bytes"], 1e6);
  EXPECT_GT(r["particles"]["threshold"], 0.0);
}

TEST_F(Cli, WritesEveryFormatAndLayer) {
  for (const char* name : {"x.png", "x.exr", "x.pfm", "x.hdr"})
    EXPECT_EQ(run(std::string("render water.xyz -q -o ") + name + small).exit_code, 0) << name;
  const ImageLayers layers = read_exr_layers(folder / "x.exr");
  for (const char* layer : {"beauty", "albedo", "normal", "depth", "samples", "variance"})
    EXPECT_NE(layers.find(layer), nullptr) << layer;
  ASSERT_EQ(run("render water.xyz -q -o d.pfm --layer depth --floor none" + small).exit_code, 0);
  const Image depth = read_image(folder / "d.pfm");
  EXPECT_EQ(depth.channels, 1);
  EXPECT_TRUE(std::isinf(depth.at(0, 0)));  // nothing is hit
  EXPECT_GT(depth.at(16, 12), 0.0f);
  EXPECT_LT(depth.at(16, 12), 100.0f);
}

TEST_F(Cli, ACropIsAPieceOfThePicture) {
  ASSERT_EQ(run("render water.xyz -q -o a.pfm" + small).exit_code, 0);
  ASSERT_EQ(run("render water.xyz -q -o b.pfm --crop 5,6,7,8" + small).exit_code, 0);
  const Image a = read_image(folder / "a.pfm"), b = read_image(folder / "b.pfm");
  ASSERT_EQ(b.width, 7);
  ASSERT_EQ(b.height, 8);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 7; ++x) EXPECT_EQ(a.at(5 + x, 6 + y), b.at(x, y)) << x << "," << y;
}

TEST_F(Cli, EveryOptionIsTaken) {
  const char* options[] = {"--view front",
                           "--view side",
                           "--view top",
                           "--camera-from 1,2,3 --camera-to 0,0,0 --fov 50",
                           "--camera-from -1,-2,3",
                           "--radius 0.06",
                           "--order 1",
                           "--order 3",
                           "--kernel zhu-bridson",
                           "--kernel blinn",
                           "--threshold thesis",
                           "--threshold 2.5",
                           "--recover thesis",
                           "--recover off",
                           "--normal gradient",
                           "--method thesis",
                           "--representation mesh",
                           "--representation mesh --mesh-cell 0.04",
                           "--ior 1.5",
                           "--absorption 1,2,3",
                           "--env studio",
                           "--env white",
                           "--sun off",
                           "--sun 0.53",
                           "--sun 10 --env sky",
                           "--floor none",
                           "--floor checker",
                           "--up z",
                           "--container -0.2,-0.2,-0.2,1,1,1",
                           "--max-depth 3",
                           "--refractions 1",
                           "--refractions 2",
                           "--refractions all",
                           "--denoise",
                           "--exposure -1",
                           "--tone srgb",
                           "--filter gaussian",
                           "--threads 2",
                           "--seed 4294967295",
                           "--floor-height -0.1",
                           "--first-sample 7"};
  for (const char* option : options) {
    const Outcome outcome = run(std::string("render water.xyz -q -o x.png --size 12x8 --spp 1 ") + option);
    EXPECT_EQ(outcome.exit_code, 0) << option << "\n" << outcome.err;
    EXPECT_EQ(outcome.err, "") << option;
    EXPECT_EQ(outcome.out, "") << option;
    EXPECT_TRUE(fs::remove(folder / "x.png")) << option;
  }
}

TEST_F(Cli, TakesOtherFluidsAndKindsOfParticle) {
  std::ofstream(folder / "few.xyz") << "0.1 0.2 0.1\n0.3 0.5 0.3\n0.3 0.52 0.3\n";
  std::ofstream(folder / "sized.csv") << "x,y,z,radius\n0.1,0.2,0.1,0.02\n0.2,0.5,0.3,0\n0.3,0.5,0.3,0.04\n";
  std::ofstream(folder / "mixed.csv") << [] {
    std::string text = "x,y,z,type,speed\n";
    for (int i = 0; i < 216; ++i)
      text += std::to_string(0.1 * (i % 6)) + "," + std::to_string(0.1 * (i / 6 % 6)) + "," +
              std::to_string(0.1 * (i / 36)) + "," + std::to_string(i % 20 == 0 ? i / 20 % 3 : 3) + "," +
              std::to_string(i) + "\n";
    return text;
  }();
  const char* renders[] = {
      "water.xyz --foam few.xyz --bubbles few.xyz --spray few.xyz --sand few.xyz",
      "water.xyz --bubbles few.xyz --bubbles sized.csv --bubble-radius 0.03",
      "water.xyz --sand sized.csv --sand-color 0.3,0.2,0.1 --spray sized.csv --foam sized.csv --foam-extinction 20",
      "water.xyz --foam few.xyz --foam-radius 0.1 --spray few.xyz --spray-radius 0.01 --sand few.xyz --sand-radius 0.1",
      "mixed.csv --kinds type:0=foam,1=spray,2=bubble",
      "mixed.csv --kinds type:9=sand",  // none of that kind
      "mixed.csv --color-by speed --color-map heat",
      "water.xyz --extinction 5,2,1 --albedo 0.9 --phase-g 0.6 --density-radius 0.08",
      "water.xyz --fluid few.xyz:ior=1.4:absorption=1,2,3 --radius 0.05",
      "water.xyz --fluid few.xyz:extinction=5:albedo=0.5,0.6,0.7:g=-0.2 --overlap max --radius 0.05",
      "water.xyz --fluid few.xyz --fluid few.xyz --radius 0.05",
      "few.xyz --radius 0.1",
      "water.xyz --container -0.1,-0.1,-0.1,0.7,1,0.7 --tank 0.05 --tank-ior 1.6"};
  for (const char* arguments : renders) {
    const Outcome outcome = run(std::string("render -q -o x.png --size 12x8 --spp 1 --order 2 ") + arguments);
    EXPECT_EQ(outcome.exit_code, 0) << arguments << "\n" << outcome.err;
    EXPECT_TRUE(fs::remove(folder / "x.png")) << arguments;
  }
  // A lone particle is a fluid too.
  std::ofstream(folder / "one.xyz") << "0 0 0\n";
  EXPECT_EQ(run("render one.xyz -q -o x.png --radius 0.1" + small).exit_code, 0);
}

/// Mean of a picture's first channel.
double mean_of(const fs::path& picture) {
  const Image image = read_image(picture);
  double sum = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += static_cast<std::size_t>(image.channels))
    sum += static_cast<double>(image.pixels[i]);
  return sum / static_cast<double>(image.pixel_count());
}

// Extremes of the medium, whose pictures are known: one particle of radius 0.5, without refraction, before white, along a
// chord of length 0.8. The same numbers in a scene file.
TEST_F(Cli, ExtremeMediaLookAsTheyMust) {
  std::ofstream(folder / "one.xyz") << "0 0 0\n";
  std::ofstream(folder / "same.xyz") << "0 0 0\n0 0 0\n0 0 0\n";
  const std::string view =
      " -q -o x.pfm --size 4x4 --spp 2048 --order 1 --radius 0.5 --ior 1 --absorption 0,0,0 --env white --floor none "
      "--camera-from=-3,0.3,0 --camera-to 3,0.3,0 --fov 0.01 ";
  struct Extreme {
    const char *file, *medium, *elements;
    double expected;
  };
  const double beer = std::exp(-0.8 * 1.5);
  const Extreme extremes[] = {
      {"one.xyz", "--extinction 1.5 --albedo 0",
       "<rgb name=\"extinction\" value=\"1.5\"/><rgb name=\"albedo\" value=\"0\"/>", beer},
      {"same.xyz", "--extinction 1.5 --albedo 0 --density-radius 0.5",
       "<rgb name=\"extinction\" value=\"1.5\"/><rgb name=\"albedo\" value=\"0\"/>", beer},
      {"one.xyz", "--extinction 0 --albedo 0.5",
       "<rgb name=\"extinction\" value=\"0\"/><rgb name=\"albedo\" value=\"0.5\"/>", 1},
      {"one.xyz", "--extinction inf --albedo 0.25",
       "<rgb name=\"extinction\" value=\"inf\"/><rgb name=\"albedo\" value=\"0.25\"/>", 0.25},
      {"one.xyz", "--extinction 20 --phase-g 0.999",
       "<rgb name=\"extinction\" value=\"20\"/><phase type=\"hg\"><float name=\"g\" value=\"0.999\"/></phase>", 1},
      {"one.xyz", "--extinction 20 --phase-g=-0.999",
       "<rgb name=\"extinction\" value=\"20\"/><phase type=\"hg\"><float name=\"g\" value=\"-0.999\"/></phase>", 1},
  };
  for (const Extreme& e : extremes) {
    const Outcome by_flags = run("render " + std::string(e.file) + view + e.medium);
    ASSERT_EQ(by_flags.exit_code, 0) << e.medium << by_flags.err;
    EXPECT_NEAR(mean_of(folder / "x.pfm"), e.expected, 0.012) << e.medium;
    std::ofstream(folder / "scene.xml")
        << "<scene version=\"3.0.0\"><integrator type=\"volpath\"/><sensor type=\"perspective\"><float name=\"fov\" "
           "value=\"0.01\"/><transform name=\"to_world\"><lookat origin=\"-3,0.3,0\" target=\"3,0.3,0\" "
           "up=\"0,1,0\"/></transform></sensor><emitter type=\"constant\"/>\n<shape type=\"particles\"><string "
           "name=\"filename\" value=\""
        << e.file
        << "\"/><float name=\"radius\" value=\"0.5\"/><integer name=\"order\" value=\"1\"/><bsdf "
           "type=\"dielectric\"><float name=\"int_ior\" value=\"1\"/><float name=\"ext_ior\" value=\"1\"/></bsdf>"
        << e.elements << "</shape></scene>\n";
    const Outcome by_file = run("render scene.xml -q -o y.pfm --size 4x4 --spp 2048");
    ASSERT_EQ(by_file.exit_code, 0) << e.elements << by_file.err;
    EXPECT_NEAR(mean_of(folder / "y.pfm"), e.expected, 0.012) << e.elements;
  }
}

// A solver writes empty files, and files without some kinds; a frame of those renders.
TEST_F(Cli, AFrameMayHoldNoneOfAKind) {
  std::ofstream(folder / "none.csv") << "x,y,z\n";
  for (const char* kind : {"--foam", "--bubbles", "--sand", "--spray"}) {
    const Outcome outcome = run("render water.xyz -o x.pfm " + std::string(kind) + " none.csv" + small);
    EXPECT_EQ(outcome.exit_code, 0) << kind << outcome.err;
    EXPECT_NE(outcome.out.find("none.csv: no "), std::string::npos) << outcome.out;
  }
  std::ofstream(folder / "scene.xml")
      << "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"particles\"><string name=\"filename\" "
         "value=\"none.csv\"/><string name=\"kind\" value=\"foam\"/></shape></scene>\n";
  const Outcome outcome = run("render scene.xml -o x.pfm --size 8x8 --spp 1");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("there are no particles"), std::string::npos) << outcome.out;
  expect_refused("render none.csv -o x.png", 1, "none.csv: line 1: the file holds no particles");
  expect_refused("render water.xyz --fluid none.csv -o x.png", 1, "none.csv: line 1: the file holds no particles");
}

TEST_F(Cli, ShadowRaysAndTheClampAreAskedFor) {
  // A floor under water, lit by a small sun, which only straight shadow rays find.
  const std::string scene = "render water.xyz -q --sun 0.53 --max-depth 3 --size 16x12 --spp 16 --order 2 ";
  ASSERT_EQ(run(scene + "-o off.pfm").exit_code, 0);
  ASSERT_EQ(run(scene + "-o straight.pfm --boundary-nee straight").exit_code, 0);
  EXPECT_NE(content_of(folder / "off.pfm"), content_of(folder / "straight.pfm"));
  ASSERT_EQ(run(scene + "-o dark.pfm --clamp 0.001").exit_code, 0);
  EXPECT_LT(mean_of(folder / "dark.pfm"), 0.9 * mean_of(folder / "off.pfm"));
  // A scene file says the same, and the flags overrule it.
  ASSERT_EQ(run(scene + "--boundary-nee straight --clamp 2 --write-scene scene.xml").exit_code, 0);
  const std::string text = content_of(folder / "scene.xml");
  EXPECT_NE(text.find("<boolean name=\"straight_shadows\" value=\"true\"/>"), std::string::npos) << text;
  EXPECT_NE(text.find("<float name=\"clamp\" value=\"2\"/>"), std::string::npos) << text;
  ASSERT_EQ(run("render scene.xml -q -o plain.pfm --boundary-nee off --clamp off").exit_code, 0);
  EXPECT_EQ(content_of(folder / "plain.pfm"), content_of(folder / "off.pfm"));
}

TEST_F(Cli, TheIntegratorIsAskedFor) {
  const std::string scene = "render water.xyz -q --size 16x12 --spp 4 --order 2 ";
  ASSERT_EQ(run(scene + "-o path.pfm").exit_code, 0);
  for (const std::string name : {"whitted", "ao", "gauss"}) {
    ASSERT_EQ(run(scene + "-o direct.pfm --integrator " + name).exit_code, 0);
    EXPECT_NE(content_of(folder / "direct.pfm"), content_of(folder / "path.pfm"));
    // A scene file says the same, and the flag overrules it.
    ASSERT_EQ(run(scene + "--write-scene scene.xml --integrator " + name).exit_code, 0);
    EXPECT_NE(content_of(folder / "scene.xml").find("<integrator type=\"" + name), std::string::npos);
    ASSERT_EQ(run("render scene.xml -q -o same.pfm").exit_code, 0);
    EXPECT_EQ(content_of(folder / "same.pfm"), content_of(folder / "direct.pfm"));
    ASSERT_EQ(run("render scene.xml -q -o path_again.pfm --integrator path").exit_code, 0);
    EXPECT_EQ(content_of(folder / "path_again.pfm"), content_of(folder / "path.pfm"));
  }
  // The water's own shadow rays, and those asked for.
  ASSERT_EQ(run(scene + "-o whitted.pfm --integrator whitted").exit_code, 0);
  ASSERT_EQ(run(scene + "-o straight.pfm --integrator whitted --boundary-nee straight").exit_code, 0);
  ASSERT_EQ(run(scene + "-o ending.pfm --integrator whitted --boundary-nee off").exit_code, 0);
  EXPECT_EQ(content_of(folder / "whitted.pfm"), content_of(folder / "straight.pfm"));
  EXPECT_LT(mean_of(folder / "ending.pfm"), 0.99 * mean_of(folder / "whitted.pfm"));
  // Clear water is a surface like others, and hides the less the nearer it has to be.
  ASSERT_EQ(run(scene + "-o far.pfm --integrator ao").exit_code, 0);
  ASSERT_EQ(run(scene + "-o near.pfm --integrator ao --ao-distance 0.01").exit_code, 0);
  EXPECT_LT(mean_of(folder / "far.pfm"), 0.99 * mean_of(folder / "near.pfm"));
  expect_refused("render water.xyz -o x.png --integrator direct", 2, "path, whitted, ao, gauss");
  expect_refused("render water.xyz -o x.png --ao-distance 1", 2, "not ao");
  expect_refused("render water.xyz -o x.png --integrator ao --ao-distance -1", 2, "must be positive");
}

// Gauss's rule has a node for each sample; parts of a picture say how many there are in all.
TEST_F(Cli, GaussHasItsNodes) {
  const std::string scene = "render water.xyz --size 16x12 --order 2 --integrator gauss ";
  ASSERT_EQ(run(scene + "-q --spp 16 -o whole.pfm").exit_code, 0);
  const Outcome first = run(scene + "--spp 8 --gauss-nodes 16 -o first.pfm");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_NE(first.out.find("8 samples a pixel are no multiple of the 16 nodes"), std::string::npos) << first.out;
  ASSERT_EQ(run(scene + "-q --spp 8 --gauss-nodes 16 --first-sample 8 -o second.pfm").exit_code, 0);
  EXPECT_NEAR(0.5 * (mean_of(folder / "first.pfm") + mean_of(folder / "second.pfm")), mean_of(folder / "whole.pfm"),
              1e-5 * mean_of(folder / "whole.pfm"));
  expect_refused(scene + "-o x.png --spp 17", 2, "the nearest are 16 (2 x 8) and 18 (2 x 9)");
  expect_refused(scene + "-o x.png --gauss-nodes 0", 2, "nodes");
  expect_refused("render water.xyz -o x.png --gauss-nodes 16", 2, "not gauss");
  // What a scene file's integrator has may be changed without naming it again.
  ASSERT_EQ(run(scene + "--spp 16 --write-scene scene.xml").exit_code, 0);
  EXPECT_EQ(run("render scene.xml -q -o x.pfm --crop 3,4,1,1 --spp 1 --first-sample 5 --gauss-nodes 16").exit_code, 0);
  EXPECT_EQ(run("render scene.xml -q -o x.pfm --spp 17").exit_code, 1);
  ASSERT_EQ(run("render water.xyz --size 16x12 --integrator ao --write-scene ao.xml").exit_code, 0);
  EXPECT_EQ(run("render ao.xml -q -o x.pfm --spp 1 --ao-distance 0.1").exit_code, 0);
  EXPECT_EQ(run("render scene.xml -q -o x.pfm --spp 1 --ao-distance 0.1").exit_code, 1);
}

// What was chosen for other particles is said.
TEST_F(Cli, SaysWhatItTakesOtherParticlesFor) {
  std::ofstream(folder / "few.xyz") << "0.1 0.2 0.1\n0.3 0.5 0.3\n";
  std::ofstream(folder / "mixed.csv") << "x,y,z,speed\n0,0,0,1\n0.1,0,0,2\n0,0.1,0,4\n0,0,0.1,3\n";
  const Outcome outcome = run("render water.xyz -o x.png --bubbles few.xyz --radius 0.04" + small);
  EXPECT_NE(outcome.out.find("few.xyz: 2 bubbles of radius 0.01 m, 0.25 of the water's"), std::string::npos)
      << outcome.out;
  const Outcome colored = run("render mixed.csv -o x.png --color-by speed --radius 0.06" + small);
  EXPECT_NE(colored.out.find("coloured by speed: 1 to 4"), std::string::npos) << colored.out;
}

// After its last refraction a path goes straight on, also where two sheets meet: some crossed them in turn 2000 times, about
// one of 12,000 here, and were lost.
TEST_F(Cli, GoesStraightOnThroughSheetsThatMeet) {
  ASSERT_EQ(run(std::string("render ") + EMBRUN_DATA_DIR +
                "/dam_break.bgeo -q -o x.pfm --size 192x144 --max-depth 8 --refractions 2 --spp 8 --json r.json")
                .exit_code,
            0);
  const auto report = nlohmann::json::parse(content_of(folder / "r.json"));
  EXPECT_EQ(report["bad_samples"]["count"], 0);
  EXPECT_GT(report["rays"]["secondary_inside"]["count"], 10000);
}

TEST_F(Cli, TakesAnEnvironmentAndAMesh) {
  ASSERT_EQ(run("render water.xyz -q -o sky.hdr --size 64x32 --spp 1").exit_code, 0);
  std::ofstream(folder / "mesh.obj") << "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n";
  EXPECT_EQ(run("render water.xyz -q -o x.png --env sky.hdr --mesh mesh.obj" + small).exit_code, 0);
}

// So that the command of a report can be given again with something changed.
TEST_F(Cli, TheLastOfAnOptionCounts) {
  ASSERT_EQ(run("render water.xyz -q -o a.pfm --size 8x8 --spp 1 -o b.pfm --size 12x9 --crop 0,0,1,1 --crop 2,3,4,5")
                .exit_code,
            0);
  EXPECT_FALSE(fs::exists(folder / "a.pfm"));
  EXPECT_EQ(read_image(folder / "b.pfm").height, 5);
  std::ofstream(folder / "one.obj") << "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n";
  const Outcome outcome = run("render water.xyz -q -o c.pfm --mesh one.obj --mesh two.obj" + small);
  EXPECT_EQ(outcome.exit_code, 1);  // meshes add up: the second is missing
  EXPECT_NE(outcome.err.find("two.obj"), std::string::npos);
}

TEST_F(Cli, WritesMeshes) {
  ASSERT_EQ(run("mesh water.xyz -o a.ply --json a.json --threads 1").exit_code, 0);
  const Outcome outcome = run("mesh water.xyz -o b.ply --threads 7");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("2 closed pieces"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.err.find("meshing 100 %"), std::string::npos) << outcome.err;
  const auto body = [&](const char* name) {
    const std::string bytes = content_of(folder / name);
    return bytes.substr(bytes.find("end_header"));
  };
  EXPECT_EQ(body("a.ply"), body("b.ply"));
  const TriangleMesh mesh = read_mesh(path("a.ply"));
  const auto r = nlohmann::json::parse(content_of(folder / "a.json"));
  EXPECT_EQ(r["mesh"]["triangles"], mesh.triangles.size());
  EXPECT_EQ(r["mesh"]["vertices"], mesh.positions.size());
  EXPECT_EQ(r["mesh"]["components"], 2);
  EXPECT_DOUBLE_EQ(r["mesh"]["cell"], 0.5 * r["particles"]["radius"].get<double>());
  // 216 particles of spacing 0.1; a block of so few loses a fifth at its edges.
  EXPECT_GT(r["mesh"]["volume"], 0.75 * 0.216);
  EXPECT_LT(r["mesh"]["volume"], 0.216);
  for (const char* stage : {"read", "measure", "sample", "extract", "write", "cpu"})
    EXPECT_GE(r["seconds"][stage], 0.0) << stage;
  Box3 box;
  for (const Vec3& p : mesh.positions) box.include(p);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_FLOAT_EQ(r["mesh"]["low"][axis], box.low[axis]);
    EXPECT_FLOAT_EQ(r["mesh"]["high"][axis], box.high[axis]);
  }

  ASSERT_EQ(run("mesh water.xyz -o c.obj -q --cell 0.05 --order 2 --kernel blinn --recover off --normal gradient "
                "--threshold 2 --radius 0.05")
                .exit_code,
            0);
  EXPECT_LT(read_mesh(path("c.obj")).triangles.size(), mesh.triangles.size());
  // What is written can be shown again.
  EXPECT_EQ(run("render water.xyz -q -o x.png --mesh a.ply" + small).exit_code, 0);

  const auto refused = [&](const std::string& arguments, int exit_code, const std::string& message) {
    const Outcome refusal = run(arguments);
    EXPECT_EQ(refusal.exit_code, exit_code) << arguments;
    EXPECT_NE(refusal.err.find(message), std::string::npos) << arguments << "\n" << refusal.err;
  };
  refused("mesh water.xyz", 2, "--output");
  refused("mesh water.xyz -o x.stl", 1, "x.stl: a mesh is written as .ply or .obj");
  refused("mesh water.xyz -o no/x.ply", 1, "no/x.ply");
  refused("mesh none.xyz -o x.ply", 1, "none.xyz");
  refused("mesh water.xyz -o x.ply --cell 0", 2, "cell 0");
  refused("mesh water.xyz -o x.ply --cell 1e-9", 1, "too fine");
  refused("mesh water.xyz -o x.ply --order 0", 2, "order 0");
  refused("mesh scene.xml -o x.ply", 2, "particle file");
  EXPECT_FALSE(fs::exists(folder / "x.ply"));
}

TEST_F(Cli, WritesDensities) {
  const Outcome outcome = run("mesh water.xyz -o a.ply --density a.vdb --density-radius 0.08 --json a.json");
  if (outcome.err.find("no OpenVDB") != std::string::npos) {
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.err.find("apt-get install libopenvdb-dev"), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(folder / "a.ply"));
    GTEST_SKIP() << "built without OpenVDB";
  }
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_GT(fs::file_size(folder / "a.vdb"), 1000u);
  // Balls of 1.6 times the radius fill a cube of spacing 0.1, and stand out by about half their radius on average.
  const auto r = nlohmann::json::parse(content_of(folder / "a.json"));
  EXPECT_GT(r["density"]["integral"], 0.216);
  EXPECT_LT(r["density"]["integral"], 0.7 * 0.7 * 0.7);
  EXPECT_GT(r["density"]["voxels"], 1000);
  EXPECT_GE(r["seconds"]["density"], 0.0);
  EXPECT_EQ(run("mesh water.xyz -o b.ply --density b.txt").exit_code, 1);
  EXPECT_EQ(run("mesh water.xyz -o b.ply --density-radius 0.1").exit_code, 2);
  EXPECT_EQ(run("mesh water.xyz -o b.ply --density b.vdb --density-radius 0").exit_code, 2);
  EXPECT_FALSE(fs::exists(folder / "b.ply"));
}

// The fluids of a scene file as it says, or as the command line wants them.
TEST_F(Cli, SwitchesTheRepresentationOfAScene) {
  ASSERT_EQ(run("render water.xyz --write-scene s.xml --representation mesh --mesh-cell 0.02" + small).exit_code, 0);
  EXPECT_NE(content_of(folder / "s.xml").find("name=\"method\" value=\"mesh\""), std::string::npos);
  const auto triangles = [&](const std::string& options) {
    const Outcome outcome = run("render s.xml -o x.png -q --json r.json --size 12x8 --spp 1 " + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(content_of(folder / "r.json"))["mesh"]["triangles"].get<int>();
  };
  const int as_written = triangles("");
  EXPECT_GT(as_written, 1000);
  EXPECT_EQ(triangles("--representation direct"), 0);
  EXPECT_EQ(triangles("--representation mesh"), as_written);
  // Half the cells' side makes about four times the triangles.
  const int fine = triangles("--mesh-cell 0.01");
  EXPECT_GT(fine, 3 * as_written);
  EXPECT_LT(fine, 5 * as_written);
}

TEST_F(Cli, UsageErrorsEndIn2) {
  expect_refused("render water.xyz", 2, "--output");
  expect_refused("render -o x.png", 2, "INPUT");
  expect_refused("render water.xyz -o x.png --colour red", 2, "--colour");
  expect_refused("paint water.xyz", 2, "subcommand is required");
  expect_refused("render water.xyz -o x.png --size 12", 2, "\"12\" is not a size WxH");
  expect_refused("render water.xyz -o x.png --size 0x8", 2, "\"0x8\" is not a size");
  expect_refused("render water.xyz -o x.png --size 8x1000000", 2, "is not a size");
  expect_refused("render water.xyz -o x.png --spp 0", 2, "0 samples per pixel");
  expect_refused("render water.xyz -o x.png --spp many", 2, "--spp");
  expect_refused("render water.xyz -o x.png --radius -1", 2, "radius -1");
  expect_refused("render water.xyz -o x.png --radius nan", 2, "radius");
  expect_refused("render water.xyz -o x.png --order 0", 2, "neighbourhood order 0");
  expect_refused("render water.xyz -o x.png --crop 1,2,3", 2, "--crop: \"1,2,3\" is not 4 finite numbers x,y,w,h");
  expect_refused("render water.xyz -o x.png --crop 1275,0,20,20", 2, "crop 1275,0,20,20");
  expect_refused("render water.xyz -o x.png --camera-from 1,2", 2, "--camera-from: \"1,2\" is not 3 finite numbers");
  expect_refused("render water.xyz -o x.png --camera-from 1,2,inf", 2, "--camera-from");
  expect_refused("render water.xyz -o x.png --camera-from 1,2,3 --camera-to 1,2,3", 2, "camera");
  expect_refused("render water.xyz -o x.png --camera-to 1,2,3", 2, "give where the camera is");
  expect_refused("render water.xyz -o x.png --fov 180", 2, "field of view 180");
  expect_refused("render water.xyz -o x.png --view below", 2, "three-quarter");
  expect_refused("render water.xyz -o x.png --kernel cubic", 2, "metaball, zhu-bridson, blinn");
  expect_refused("render water.xyz -o x.png --threshold 0", 2, "threshold \"0\"");
  expect_refused("render water.xyz -o x.png --refractions 0", 2, "--refractions");
  expect_refused("render water.xyz -o x.png --representation points", 2, "direct, mesh");
  expect_refused("render water.xyz -o x.png --representation mesh --mesh-cell 0", 2, "mesh cell 0");
  expect_refused("render water.xyz -o x.png --mesh-cell 0.1", 2, "--representation mesh");
  expect_refused("render water.xyz -o x.png --representation mesh --method thesis", 2, "method \"thesis\"");
  expect_refused("render water.xyz -o x.png --ior 0.2", 2, "refractive index 0.2");
  expect_refused("render water.xyz -o x.png --absorption=-1,0,0", 2, "absorption");
  expect_refused("render water.xyz -o x.png --container 0,0,0,1,1", 2, "6 finite numbers");
  expect_refused("render water.xyz -o x.png --container 1,1,1,0,0,0", 2, "container");
  expect_refused("render water.xyz -o x.png --up x", 2, "up axis \"x\"");
  expect_refused("render water.xyz -o x.png --sun -1", 2, "sun of -1 degrees");
  expect_refused("render water.xyz -o x.png --sun bright", 2, "--sun");
  expect_refused("render water.xyz -o x.png --sun 1 --env white", 2, "only the sky has one");
  expect_refused("render water.xyz -o x.png --floor wood", 2, "none, plain, checker");
  expect_refused("render water.xyz -o x.png --max-depth 100000", 2, "depth 100000");
  expect_refused("render water.xyz -o x.png --threads -1", 2, "-1 threads");
  expect_refused("render water.xyz -o x.png --seed -1", 2, "--seed");
  expect_refused("render water.xyz -o x.png --extinction 1,2", 2, "--extinction: \"1,2\" is not 3 finite numbers");
  expect_refused("render water.xyz -o x.png --extinction=-1", 2, "extinction");
  expect_refused("render water.xyz -o x.png --extinction 1 --albedo 1.5", 2, "albedo");
  expect_refused("render water.xyz -o x.png --extinction 1 --phase-g 1", 2, "g = 1");
  expect_refused("render water.xyz -o x.png --extinction inf,0,0", 2, "is not 3 finite numbers");
  expect_refused("render water.xyz -o x.png --extinction inf --color-by density", 2, "one albedo");
  expect_refused("render water.xyz -o x.png --density-radius 0", 2, "density radius 0");
  expect_refused("render water.xyz -o x.png --radius 0", 2, "radius 0");
  expect_refused("render water.xyz -o x.png --boundary-nee on", 2, "auto, off, straight");
  expect_refused("render water.xyz -o x.png --clamp 0", 2, "clamp at 0");
  expect_refused("render water.xyz -o x.png --clamp much", 2, "--clamp");
  expect_refused("render water.xyz -o x.png --overlap add", 2, "min, max, sum");
  expect_refused("render water.xyz -o x.png --color-map red", 2, "spectrum, heat, grey");
  expect_refused("render water.xyz -o x.png --kinds type", 2, "kinds \"type\"");
  expect_refused("render water.xyz -o x.png --kinds type:1=lava", 2, "\"lava\"");
  expect_refused("render water.xyz -o x.png --bubble-radius 0", 2, "radius 0 of bubbles");
  expect_refused("render water.xyz -o x.png --foam-extinction=-3", 2, "extinction");
  expect_refused("render water.xyz -o x.png --sand-color 2,0,0", 2, "reflectance");
  expect_refused("render water.xyz -o x.png --tank 0.1", 2, "needs a container");
  expect_refused("render water.xyz -o x.png --container 0,0,0,1,1,1 --tank -1", 2, "thickness -1");
  expect_refused("render water.xyz -o x.png --container 0,0,0,1,1,1 --tank 0.1 --tank-ior 0.5", 2, "refractive index");
  expect_refused("render water.xyz -o x.png --fluid water.xyz:color=red", 2, "\"color\"");
  expect_refused("render water.xyz -o x.png --fluid water.xyz:ior=0.3", 2, "refractive index 0.3");
  expect_refused("render water.xyz -o x.png --fluid :ior=1.3", 2, "--fluid");
}

TEST_F(Cli, BadFilesEndIn1) {
  expect_refused("render none.bgeo -o x.png", 1, "none.bgeo");
  std::ofstream(folder / "empty.xyz");
  expect_refused("render empty.xyz -o x.png", 1, "empty.xyz");
  expect_refused("render . -o x.png", 1, "embrun: ");
  expect_refused("render water.xyz -o x.tiff", 1, "x.tiff");
  expect_refused("render water.xyz -o no/such/x.png", 1, "no/such");
  expect_refused("render water.xyz -o x.png --json no/such/r.json", 1, "no/such");
  expect_refused("render water.xyz -o x.png --env none.exr", 1, "none.exr");
  expect_refused("render water.xyz -o x.png --env water.xyz", 1, "water.xyz");
  expect_refused("render water.xyz -o x.png --mesh none.obj", 1, "none.obj");
  expect_refused("info none.bgeo", 1, "none.bgeo");
  expect_refused("render water.xyz -o x.png --layer gloss", 2, "beauty");
}

// The output is looked at before the particles are: a typing mistake does not cost a render.
TEST_F(Cli, BadKindsOfParticleEndIn1) {
  expect_refused("render water.xyz -o x.png --foam none.xyz", 1, "none.xyz");
  expect_refused("render water.xyz -o x.png --fluid none.xyz", 1, "none.xyz");
  expect_refused("render water.xyz -o x.png --color-by speed", 1, "no attribute \"speed\"");
  expect_refused("render water.xyz -o x.png --kinds type:1=foam", 1, "no attribute \"type\"");
  std::ofstream(folder / "foam.csv") << "x,y,z,type\n0,0,0,1\n1,0,0,1\n";
  expect_refused("render foam.csv -o x.png --kinds type:1=foam", 1, "no particle is water");
  std::ofstream(folder / "none.csv") << "x,y,z,radius\n0,0,0,0\n1,0,0,0\n";
  expect_refused("render water.xyz -o x.png --bubbles none.csv", 1, "half of the bubbles have none");
}

TEST_F(Cli, ABadOutputIsFoundFirst) {
  const Outcome outcome = run("render none.bgeo -o x.jpeg2000");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("x.jpeg2000"), std::string::npos) << outcome.err;
}

TEST_F(Cli, InstructionSetsCanBePinned) {
  Outcome outcome = run("render water.xyz -o x.png --json r.json" + small, "EMBRUN_ISA=baseline");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string used = nlohmann::json::parse(content_of(folder / "r.json"))["machine"]["instruction_set"];
  EXPECT_TRUE(used == "baseline" || used == "native") << used;
  outcome = run("render water.xyz -o y.png" + small, "EMBRUN_ISA=mmx");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("baseline, avx2 or avx512"), std::string::npos) << outcome.err;
}

TEST_F(Cli, HelpTeaches) {
  Outcome outcome = run("--help");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.out.find("Exit codes"), std::string::npos);
  outcome = run("render --help");
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* option : {"--output",
                             "--size",
                             "--crop",
                             "--spp",
                             "--seed",
                             "--threads",
                             "--max-depth",
                             "--camera-from",
                             "--camera-to",
                             "--fov",
                             "--view",
                             "--radius",
                             "--order",
                             "--kernel",
                             "--threshold",
                             "--recover",
                             "--normal",
                             "--method",
                             "--ior",
                             "--absorption",
                             "--env",
                             "--floor",
                             "--container",
                             "--up",
                             "--layer",
                             "--denoise",
                             "--json",
                             "--refractions",
                             "Examples:",
                             "Exit codes:",
                             "goes straight on",
                             "--boundary-nee",
                             "--integrator",
                             "--ao-distance",
                             "--clamp"})
    EXPECT_NE(outcome.out.find(option), std::string::npos) << option;
  outcome = run("--version");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out, "embrun 0.1.0\n");
}

TEST_F(Cli, InfoSaysWhatIsInAFile) {
  Outcome outcome = run("info water.xyz");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.out.find("217"), std::string::npos);
  outcome = run("info water.xyz --json");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NO_THROW(nlohmann::json::parse(outcome.out));
}

// Ctrl-C in the middle of a long render: what there is is written, whole, and said to be partial.
TEST_F(Cli, AnInterruptWritesWhatThereIs) {
  const pid_t child = fork();
  if (child == 0) {
    if (chdir(folder.c_str()) != 0) _exit(99);
    std::freopen("err.txt", "w", stderr);
    std::freopen("out.txt", "w", stdout);
    execl(EMBRUN_CLI, EMBRUN_CLI, "render", "water.xyz", "-o", "x.exr", "--size", "64x48", "--spp", "10000000",
          "--json", "r.json", static_cast<char*>(nullptr));
    _exit(98);
  }
  const auto rendering = [&] { return content_of(folder / "err.txt").find("rendering 0 %") != std::string::npos; };
  for (int i = 0; i < 600 && !rendering(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  kill(child, SIGINT);
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_NE(content_of(folder / "err.txt").find("interrupted: x.exr holds what there is"), std::string::npos);
  EXPECT_EQ(read_image(folder / "x.exr").width, 64);
  const auto report = nlohmann::json::parse(content_of(folder / "r.json"));
  EXPECT_TRUE(report["picture"]["interrupted"]);
  EXPECT_GT(report["picture"]["samples"], 0);
}

}  // namespace
}  // namespace embrun

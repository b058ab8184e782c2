// Scene files from the command line.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "cli_fixture.h"
#include "io/image_read.h"

namespace embrun {
namespace {

/// A sphere of parameter r before white, and the particles beside the file.
constexpr const char* scene_text =
    "<scene version=\"3.0.0\">\n<default name=\"r\" value=\"0.5\"/>\n"
    "<sensor type=\"perspective\"><transform name=\"to_world\"><lookat origin=\"0.3,0.5,4\" target=\"0.3,0.5,0\" "
    "up=\"0,1,0\"/></transform><film type=\"hdrfilm\"><integer name=\"width\" value=\"40\"/><integer name=\"height\" "
    "value=\"30\"/></film><sampler type=\"sobol\"><integer name=\"sample_count\" value=\"3\"/></sampler></sensor>\n"
    "<emitter type=\"constant\"/>\n<shape type=\"sphere\"><float name=\"radius\" value=\"$r\"/></shape>\n"
    "<shape type=\"particles\"><string name=\"filename\" value=\"water.xyz\"/></shape>\n</scene>\n";

class SceneCli : public Cli {
 protected:
  void SetUp() override {
    Cli::SetUp();
    fs::create_directories(folder / "scenes");
    fs::copy(folder / "water.xyz", folder / "scenes" / "water.xyz");
    std::ofstream(folder / "scenes" / "scene.xml") << scene_text;
  }
};

TEST_F(SceneCli, RendersAsTheFileSays) {
  const Outcome outcome = run("render scenes/scene.xml -o x.png --json r.json");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const Image image = read_image(folder / "x.png");
  EXPECT_EQ(image.width, 40);
  EXPECT_EQ(image.height, 30);
  const auto report = nlohmann::json::parse(content_of(folder / "r.json"));
  EXPECT_EQ(report["picture"]["samples_per_pixel"], 3);
  EXPECT_EQ(report["particles"]["count"], 217);
}

TEST_F(SceneCli, FlagsAndParametersOverrule) {
  const Outcome outcome = run("render scenes/scene.xml -o x.png --size 20x16 --spp 2 --seed 7 -D r=0.1 --json r.json");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(read_image(folder / "x.png").width, 20);
  const auto report = nlohmann::json::parse(content_of(folder / "r.json"));
  EXPECT_EQ(report["picture"]["samples_per_pixel"], 2);
  EXPECT_EQ(report["picture"]["seed"], 7);
  const Outcome crop = run("render scenes/scene.xml -o y.pfm --crop 3,4,5,6 -q");
  EXPECT_EQ(crop.exit_code, 0) << crop.err;
  EXPECT_EQ(read_image(folder / "y.pfm").height, 6);
}

TEST_F(SceneCli, MistakesAreToldApart) {
  expect_refused("render scenes/scene.xml -o x.png --radius 1", 2, "--radius: a scene file says that itself");
  expect_refused("render scenes/scene.xml -o x.png -D r", 2, "--define: \"r\" is not name=value");
  expect_refused("render water.xyz -o x.png -D r=1", 2, "only a scene file has parameters");
  expect_refused("render scenes/scene.xml -o x.png -D q=1", 1, "nothing in it uses the parameter $q");
  expect_refused("render scenes/scene.xml -o x.png -D r=wide", 1, "scene.xml: line 5: float: 'radius' is 'wide'");
  expect_refused("render scenes/scene.xml -o x.png --crop 39,0,5,5", 1, "crop 39,0,5,5 does not lie within");
  expect_refused("render none.xml -o x.png", 1, "none.xml: cannot open");
  expect_refused("render scenes/scene.xml", 2, "--output is required");
}

TEST_F(SceneCli, DumpsWhatWasUnderstood) {
  const Outcome dump = run("scene scenes/scene.xml -D r=0.25 --dump");
  EXPECT_EQ(dump.exit_code, 0) << dump.err;
  EXPECT_NE(dump.out.find("<float name=\"radius\" value=\"0.25\"/>"), std::string::npos) << dump.out;
  EXPECT_NE(dump.out.find(path("scenes/water.xyz")), std::string::npos) << dump.out;
  // It is the same from elsewhere, and dumps to itself.
  std::ofstream(folder / "again.xml") << dump.out;
  EXPECT_EQ(run("scene again.xml --dump").out, dump.out);
  EXPECT_EQ(run("scene scenes/scene.xml").exit_code, 0);
}

TEST_F(SceneCli, FlagsBecomeASceneFile) {
  const std::string flags = " --size 24x18 --spp 2 --order 2 --floor checker -q";
  EXPECT_EQ(run("render water.xyz --write-scene water.xml" + flags).exit_code, 0);
  EXPECT_EQ(run("render water.xyz -o x.pfm" + flags).exit_code, 0);
  EXPECT_EQ(run("render water.xml -o y.pfm -q").exit_code, 0);
  EXPECT_EQ(read_image(folder / "x.pfm").pixels, read_image(folder / "y.pfm").pixels);
}

}  // namespace
}  // namespace embrun

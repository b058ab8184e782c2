// embrun bench: its figures by their stable names.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "cli_fixture.h"

namespace embrun {
namespace {

class BenchCli : public Cli {};

TEST_F(BenchCli, PrintsAllFiguresByTheirNames) {
  const Outcome outcome = run("bench water.xyz --order 2 --json --rays 4000 --oracle-rays 3000 --repetitions 3");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  const auto positive = [&](const std::string& pointer) {
    const auto& value = json.at(nlohmann::json::json_pointer(pointer));
    EXPECT_GT(value.get<double>(), 0.0) << pointer;
    return value.get<double>();
  };
  for (const std::string kind :
       {"/rays/camera", "/rays/outside", "/rays/inside", "/rays/shuffled", "/freeflight/mfp10", "/freeflight/mfp100"}) {
    const double direct = positive(kind + "/direct"), mesh = positive(kind + "/mesh");
    EXPECT_NEAR(positive(kind + "/ratio"), direct / mesh, 1e-6 * direct / mesh);
    EXPECT_LT(direct, 1000.0);  // millions a second
  }
  const double direct = positive("/build/direct_s"), mesh = positive("/build/mesh_s");
  EXPECT_NEAR(positive("/build/ratio"), mesh / direct, 1e-6 * mesh / direct);
  EXPECT_GT(positive("/memory/bytes_per_particle"), 10.0);
  EXPECT_EQ(json["oracle"]["rays"], 3000);
  EXPECT_EQ(json["oracle"]["wrong"], 0);
  EXPECT_EQ(json["particles"]["count"], 217);
  EXPECT_EQ(json["rays"]["camera"]["embree"].get<std::string>().find("rtcIntersect1"), 0u);

  const Outcome text = run("bench water.xyz --rays 256 --oracle-rays 0 --repetitions 1 -q");
  ASSERT_EQ(text.exit_code, 0) << text.err;
  for (const char* name :
       {"rays.camera.direct ", "rays.shuffled.ratio ", "build.direct_s ", "memory.bytes_per_particle ", "oracle.rays ",
        "oracle.wrong ", "freeflight.mfp10.ratio ", "freeflight.mfp100.ratio "})
    EXPECT_NE(text.out.find(name), std::string::npos) << name << text.out;
  EXPECT_EQ(text.err, "");
}

TEST_F(BenchCli, RefusesWhatCannotBe) {
  const auto refused = [&](const std::string& arguments, int exit_code, const std::string& message) {
    const Outcome outcome = run("bench " + arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments << "\n" << outcome.err;
  };
  refused("", 2, "INPUT");
  refused("water.xyz --order 0", 2, "order 0");
  refused("water.xyz --rays 10", 2, "10 rays");
  refused("water.xyz --rays many", 2, "--rays");
  refused("water.xyz --oracle-rays -1", 2, "-1 oracle rays");
  refused("water.xyz --repetitions 0", 2, "0 repetitions");
  refused("water.xyz --radius 0", 2, "radius 0");
  refused("scene.xml", 2, "not a scene");
  refused("none.bgeo", 1, "none.bgeo");
  std::ofstream(folder / "one.xyz") << "1 2 3\n";
  refused("one.xyz", 1, "radius");
}

}  // namespace
}  // namespace embrun

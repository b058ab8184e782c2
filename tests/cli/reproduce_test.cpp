// embrun reproduce on a handful of particles: what is written, that no row is missing, that it goes on where it was.

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "cli_fixture.h"
#include "io/image_read.h"

namespace embrun {
namespace {

/// The cells of the table below a heading: header first, then the rows.
std::vector<std::vector<std::string>> table_below(const std::string& document, const std::string& heading,
                                                  int which = 0) {
  std::istringstream lines(document.substr(std::min(document.find(heading), document.size())));
  std::vector<std::vector<std::string>> table;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] != '|') {
      if (inside && which-- == 0) return table;
      inside = false;
      table.clear();
      continue;
    }
    inside = true;
    if (line.find("| --- |") == 0) continue;
    std::vector<std::string> cells;
    std::istringstream row(line.substr(1));
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell.substr(1, cell.size() - 2));
    table.push_back(cells);
  }
  return table;
}

/// The first so many cells of each row, without the header.
std::vector<std::vector<std::string>> keys_of(const std::vector<std::vector<std::string>>& table, std::size_t count) {
  std::vector<std::vector<std::string>> keys;
  for (std::size_t i = 1; i < table.size(); ++i) {
    EXPECT_EQ(table[i].size(), table[0].size());
    keys.emplace_back(table[i].begin(),
                      table[i].begin() + static_cast<std::ptrdiff_t>(std::min(count, table[i].size())));
  }
  return keys;
}

class Reproduce : public Cli {
 protected:
  using Keys = std::vector<std::vector<std::string>>;

  void SetUp() override {
    Cli::SetUp();
    fs::create_directory(folder / "samples");
    fs::copy_file(folder / "water.xyz", folder / "samples/dam_break.xyz");
    fs::copy_file(folder / "water.xyz", folder / "samples/dam_break_foam.xyz");
  }
  const std::string command =
      "reproduce dam-break -o out --data samples --size 24x18 --spp 4 --radius 0.05 --threads 1";
};

TEST_F(Reproduce, WritesEveryRowOfTheTablesAndGoesOn) {
  const Outcome outcome = run(command);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("out/reproduction.md"), std::string::npos);
  EXPECT_NE(outcome.err.find("view 2, n = 3, refractions 1, mesh"), std::string::npos) << outcome.err;
  const std::string text = content_of(folder / "out/reproduction.md");

  const auto first = table_below(text, "## Table 1");
  EXPECT_EQ(keys_of(first, 2),
            (Keys{{"1", "1"}, {"1", "2"}, {"1", "3"}, {"1", "4"}, {"2", "1"}, {"2", "2"}, {"2", "3"}, {"2", "4"}}));
  // The thesis's 7 min 45 s over 1.70 s.
  EXPECT_EQ(first[7][9], "7 min 45 s");
  EXPECT_EQ(first[7][11], "274");
  EXPECT_EQ(keys_of(table_below(text, "## Table 2"), 2),
            (Keys{{"1", "1"}, {"1", "2"}, {"1", "all"}, {"2", "1"}, {"2", "2"}, {"2", "all"}}));
  EXPECT_EQ(keys_of(table_below(text, "## Table 3"), 1), (Keys{{"1"}, {"2"}}));
  EXPECT_EQ(table_below(text, "## Table 3")[2].back(), "83.7");
  EXPECT_EQ(table_below(text, "## The thesis's own tracer").size(), 2u);
  EXPECT_EQ(keys_of(table_below(text, "## Section 5.3.1"), 1),
            (Keys{{"uniform grid"}, {"SAH kd-tree"}, {"grid / kd-tree"}}));
  EXPECT_NE(text.find("they found the same balls"), std::string::npos);

  Keys rows;
  for (const char* view : {"1", "2"}) {
    for (const char* order : {"1", "2", "3", "4"}) rows.push_back({view, order, "all", "surface"});
    rows.push_back({view, "3", "1", "surface"});
    rows.push_back({view, "3", "2", "surface"});
    rows.push_back({view, "3", "all", "volume"});
    rows.push_back({view, "3", "all", "gradient normals"});
  }
  const auto errors = table_below(text, "## Figure 65");
  EXPECT_EQ(keys_of(errors, 4), rows);
  EXPECT_EQ(keys_of(table_below(text, "## Figure 65", 1), 3).size(), 12u);
  // Every MSE is there and none is zero: pictures of 4 samples have noise.
  for (std::size_t i = 1; i < errors.size(); ++i) EXPECT_GT(std::stod(errors[i][4]), 0.0) << i;

  // Every figure that it names is there; what there were no particles for is said to be left out.
  std::size_t figures = 0;
  for (std::size_t at = text.find("](figures/"); at != std::string::npos;
       at = text.find("](figures/", at + 1), ++figures) {
    const std::string file = text.substr(at + 2, text.find(')', at) - at - 2);
    EXPECT_GT(fs::file_size(folder / "out" / file), 100u) << file;
  }
  EXPECT_EQ(figures, 2u + 6u + 4u + 6u + 1u);  // 65, 50 to 58, 62 to 66, differences, 67
  EXPECT_NE(text.find("Left out: figures 67a and 67c, for samples has no calm_pool"), std::string::npos);
  EXPECT_EQ(read_image(folder / "out/figures/figure-62.png").width, 4 * 24 + 3 * 6);

  // The record is what the table says, and a direct picture is not a mesh's.
  const auto direct = nlohmann::json::parse(content_of(folder / "out/renders/view1-n2-all-direct.json"))["picture"];
  const auto mesh = nlohmann::json::parse(content_of(folder / "out/renders/view1-n2-all-mesh.json"))["picture"];
  EXPECT_EQ(direct["samples"], 4);
  EXPECT_EQ(direct["triangles"], 0);
  EXPECT_EQ(first[2][8], std::to_string(mesh["triangles"].get<int>()));

  // Again: pictures of the same flags are kept; one that is damaged, or of others, is made again, and is the same.
  const std::string before = content_of(folder / "out/renders/view2-n3-all-mesh.exr");
  fs::remove(folder / "out/renders/view2-n3-all-mesh-1.exr");
  std::ofstream(folder / "out/renders/view1-n1-all-direct.json") << "{\"signature\": 3";
  std::string record = content_of(folder / "out/renders/view1-n4-all-mesh.json");
  const std::size_t samples = record.find("--spp 4 --seed");
  ASSERT_NE(samples, std::string::npos);
  std::ofstream(folder / "out/renders/view1-n4-all-mesh.json") << record.replace(samples, 7, "--spp 6");
  const Outcome again = run(command);
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find("3 rendered, 31 kept"), std::string::npos) << again.out;
  EXPECT_EQ(content_of(folder / "out/renders/view2-n3-all-mesh.exr"), before);
}

TEST_F(Reproduce, RefusesWhatCannotBe) {
  const auto refused = [&](const std::string& arguments, int exit_code, const std::string& message) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments << "\n" << outcome.err;
    EXPECT_FALSE(fs::exists(folder / "out")) << arguments;
  };
  refused("reproduce -o out", 2, "WHAT");
  refused("reproduce dam-break", 2, "--output");
  refused("reproduce wave -o out", 2, "\"wave\" cannot be reproduced; there are: dam-break, splats");
  refused("reproduce dam-break -o ''", 2, "no folder to write to");
  refused("reproduce dam-break -o out --spp 3", 2, "even number");
  refused("reproduce dam-break -o out --spp 0", 2, "even number");
  refused("reproduce dam-break -o out --spp -2", 2, "even number");
  refused("reproduce dam-break -o out --thesis-spp 1", 2, "even number");
  refused("reproduce dam-break -o out --size 8x8", 2, "at least 16x16");
  refused("reproduce dam-break -o out --size big", 2, "--size");
  refused("reproduce dam-break -o out --radius 0", 2, "radius 0");
  refused("reproduce dam-break -o out --threads -1", 2, "-1 threads");
  refused("reproduce dam-break -o out --data nowhere", 1, "nowhere: there is no dam_break.bgeo");
  std::ofstream(folder / "samples/dam_break.bgeo") << "this is no bgeo file";
  const Outcome damaged = run(command);
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_NE(damaged.err.find("samples/dam_break.bgeo"), std::string::npos) << damaged.err;
  EXPECT_EQ(run("reproduce dam-break -o water.xyz --data samples").exit_code, 1);
}

TEST_F(Reproduce, SplatsWithoutTheScans) {
  const Outcome done = run("reproduce splats --quick --data samples -o splats");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string document = content_of(folder / "splats/splats.md");
  EXPECT_NE(document.find("igea_70658.ply is not in the folder"), std::string::npos);
  const auto table = table_below(document, "## sphere");
  ASSERT_EQ(table.size(), 13u);
  // The rows are eight and four, and in the end the tree is faster than the plain loop.
  EXPECT_GT(std::stod(table[12][5]), 5);
  for (const char* file : {"figure-29.svg", "figure-28-sphere.png", "figure-33c-sphere.png"})
    EXPECT_TRUE(fs::exists(folder / "splats" / file)) << file;
  // Gauss's quadrature beside paths: every picture that the section names is there, and few nodes are wrong by themselves.
  const std::string section = document.substr(document.find("## Section 3.3"));
  const auto errors = table_below(section, "## Section 3.3");
  ASSERT_EQ(errors.size(), 3u);
  EXPECT_EQ(keys_of(errors, 2), (Keys{{"16", "2 x 8"}, {"64", "4 x 16"}}));
  EXPECT_GT(std::stod(errors[1][8]), 0.5);
  EXPECT_NE(section.find("**Verdict:** none"), std::string::npos);
  std::size_t figures = 0;
  for (std::size_t at = section.find("](quadrature-"); at != std::string::npos;
       at = section.find("](quadrature-", at + 1), ++figures) {
    const std::string file = section.substr(at + 2, section.find(')', at) - at - 2);
    EXPECT_GT(fs::file_size(folder / "splats" / file), 100u) << file;
  }
  EXPECT_EQ(figures, 1u + 3u * 4u);
  EXPECT_EQ(run("reproduce splats --data nowhere -o none").exit_code, 1);
  EXPECT_EQ(run("reproduce splats -o ''").exit_code, 2);
}

}  // namespace
}  // namespace embrun

#include "io/particle_info.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "io/read_particles.h"

namespace embrun {
namespace {

const char* const dam_break = EMBRUN_DATA_DIR "/dam_break.bgeo";

TEST(ParticleInfo, DescribesTheDamBreak) {
  const ParticleInfo info = describe_particles(read_particles(dam_break), "dam_break.bgeo", std::nullopt);
  EXPECT_EQ(info.count, 110592u);
  EXPECT_NEAR(info.low.x, -2.2057, 5e-5);
  EXPECT_NEAR(info.high.y, 3.5774, 5e-5);
  ASSERT_EQ(info.attributes.size(), 3u);
  EXPECT_EQ(info.attributes[1].name, "velocity");
  EXPECT_EQ(info.attributes[1].least.size(), 3u);
  EXPECT_NEAR(info.attributes[2].least[0], 254.6, 0.05);
  EXPECT_NEAR(info.attributes[2].greatest[0], 1041.6, 0.05);
  ASSERT_TRUE(info.radius.has_value());
  EXPECT_EQ(info.radius->source, RadiusSource::spacing);
  EXPECT_DOUBLE_EQ(info.radius->radius, info.spacing.spacing / 2);

  const std::string text = to_text(info);
  EXPECT_NE(text.find("dam_break.bgeo: BGEO V5, gzip, 110592 particles\n"), std::string::npos);
  EXPECT_NE(text.find("rest spacing: 0.046"), std::string::npos);
  EXPECT_NE(text.find("half the rest spacing"), std::string::npos);
  EXPECT_EQ(text.back(), '\n');
}

TEST(ParticleInfo, JsonHoldsTheSame) {
  const ParticleInfo info = describe_particles(read_particles(dam_break), "dam_break.bgeo", 0.025);
  const nlohmann::json json = nlohmann::json::parse(to_json(info));
  EXPECT_EQ(json["count"], 110592);
  EXPECT_EQ(json["bounds"]["low"].size(), 3u);
  EXPECT_DOUBLE_EQ(json["rest_spacing"], info.spacing.spacing);
  EXPECT_DOUBLE_EQ(json["median_nearest_neighbour"], info.spacing.nearest_neighbour);
  EXPECT_EQ(json["radius"]["source"], "given");
  EXPECT_EQ(json["radius"]["value"], 0.025);
  EXPECT_EQ(json["attributes"][0]["name"], "id");
  EXPECT_EQ(json["attributes"][0]["max"][0], 110591);
  EXPECT_EQ(json["attributes"][1]["components"], 3);
}

TEST(ParticleInfo, ALoneParticleHasNoRadius) {
  ParticleSet set;
  set.positions = {{1, 2, 3}};
  set.format = "CSV";
  const ParticleInfo info = describe_particles(set, "one.csv", std::nullopt);
  EXPECT_FALSE(info.radius.has_value());
  EXPECT_NE(to_text(info).find("--radius"), std::string::npos);
  const nlohmann::json json = nlohmann::json::parse(to_json(info));
  EXPECT_TRUE(json["radius"].is_null());
  EXPECT_TRUE(json["rest_spacing"].is_null());
  EXPECT_THROW(describe_particles(set, "one.csv", -1.0), Error);
}

// Names from damaged files need not be UTF-8; the JSON must be.
TEST(ParticleInfo, BadNamesStillMakeGoodJson) {
  ParticleSet set;
  set.positions = {{1, 2, 3}, {1, 2, 4}};
  Attribute attribute;
  attribute.name = "\xff\xfe\r";
  attribute.floats = {1, 2};
  set.attributes.push_back(attribute);
  EXPECT_EQ(to_text(describe_particles(set, "f", std::nullopt)).find('\r'), std::string::npos);
  EXPECT_TRUE(nlohmann::json::accept(to_json(describe_particles(set, "\xc3", std::nullopt))));
}

/// A cylinder without ends of radius 1 and height 2 on a grid of steps of 0.1, and a stray point.
ParticleSet tube() {
  ParticleSet set;
  set.format = "CSV";
  for (int i = 0; i < 63; ++i) {
    for (int j = 0; j <= 20; ++j) {
      const double angle = 2 * 3.14159265358979 * i / 63;
      set.positions.push_back({std::cos(angle), 0.1 * j, std::sin(angle)});
    }
  }
  set.positions.push_back({4, 0, 0});
  set.positions.push_back(set.positions[5]);
  return set;
}

TEST(ParticleInfo, OfAScanSaysWhatItsSplatsWouldBe) {
  const CloudVerdict verdict = tell_surface(tube());
  ASSERT_TRUE(verdict.is_surface);
  SplatOptions options;
  options.neighbours = 20;
  const ParticleInfo info = describe_cloud(tube(), "tube.csv", verdict, options);
  ASSERT_TRUE(info.cloud.has_value());
  EXPECT_FALSE(info.cloud->closed);
  EXPECT_EQ(info.cloud->splats.duplicates, 1u);
  EXPECT_EQ(info.cloud->splats.outliers, 1u);
  // The cell of a square lattice reaches to half the diagonal.
  EXPECT_NEAR(info.cloud->splats.median_radius, 1.05 * std::sqrt(0.5) * 0.1, 1e-3);
  const std::string text = to_text(info);
  for (const char* line :
       {"tube.csv: CSV, 1325 points of a surface\n", "taken for a scan: most points' neighbours lie in a plane\n",
        "left out: 1 duplicates, 1 outliers\n", "normals: estimated from 20 neighbours, outwards\n", "closed: no, ",
        "colours: none\n"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  }
  EXPECT_EQ(text.find("rest spacing"), std::string::npos);
  const nlohmann::json json = nlohmann::json::parse(to_json(info));
  EXPECT_EQ(json["count"], 1325);
  EXPECT_EQ(json["cloud"]["splats"], 1323);
  EXPECT_EQ(json["cloud"]["normals"]["source"], "estimated-outwards");
  EXPECT_EQ(json["cloud"]["splat_radius"]["source"], "spacing");
  EXPECT_EQ(json["cloud"]["closed"], false);
  EXPECT_GT(json["cloud"]["open_share"], 0.01);
  EXPECT_TRUE(json["radius"].is_null());
}

}  // namespace
}  // namespace embrun

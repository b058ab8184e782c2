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

}  // namespace
}  // namespace embrun

#include "particles/particle_kinds.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace embrun {
namespace {

/// Particles at x = 0, 1, 2, ... with a type each.
ParticleSet typed(std::vector<std::int32_t> types, std::vector<std::string> texts = {}) {
  ParticleSet set;
  for (std::size_t i = 0; i < types.size(); ++i) set.positions.push_back({static_cast<double>(i), 0, 0});
  Attribute type;
  type.name = "type";
  type.type = AttributeType::int32;
  type.ints = std::move(types);
  type.strings = std::move(texts);
  set.attributes.push_back(std::move(type));
  return set;
}

std::string error_of(const std::string& mapping, const ParticleSet& set) {
  try {
    split_by_kind(set, kind_mapping_from_text(mapping), "mixed.bgeo");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ParticleKinds, AreToldByAnAttribute) {
  const ParticleSet set = typed({2, 0, 1, 0, 7, 3});
  const auto sets = split_by_kind(set, kind_mapping_from_text("type:0=foam,1=spray,2=bubble,3=none"), "f");
  const auto places = [&](ParticleKind kind) {
    std::vector<double> x;
    for (const Vec3d& p : sets[static_cast<std::size_t>(kind)].positions) x.push_back(p.x);
    return x;
  };
  EXPECT_EQ(places(ParticleKind::foam), (std::vector<double>{1, 3}));
  EXPECT_EQ(places(ParticleKind::spray), (std::vector<double>{2}));
  EXPECT_EQ(places(ParticleKind::bubble), (std::vector<double>{0}));
  EXPECT_EQ(places(ParticleKind::water), (std::vector<double>{4}));  // what is not named
  EXPECT_EQ(places(ParticleKind::none), (std::vector<double>{5}));
  EXPECT_EQ(places(ParticleKind::sand), (std::vector<double>{}));
  EXPECT_EQ(sets[static_cast<std::size_t>(ParticleKind::foam)].attributes[0].ints, (std::vector<std::int32_t>{0, 0}));
}

TEST(ParticleKinds, AreToldByTexts) {
  const ParticleSet set = typed({1, 0, 1, -1}, {"sea", "froth"});
  const auto sets = split_by_kind(set, kind_mapping_from_text("type:froth=foam"), "f");
  EXPECT_EQ(sets[static_cast<std::size_t>(ParticleKind::foam)].size(), 2u);
  EXPECT_EQ(sets[static_cast<std::size_t>(ParticleKind::water)].size(), 2u);
}

TEST(ParticleKinds, NamesGoBothWays) {
  for (int k = 0; k < particle_kind_count; ++k)
    EXPECT_EQ(kind_from_name(to_string(static_cast<ParticleKind>(k))), static_cast<ParticleKind>(k));
}

TEST(ParticleKinds, MistakesAreNamed) {
  const ParticleSet set = typed({0, 1});
  EXPECT_NE(error_of("type", set).find("\"type\""), std::string::npos);
  EXPECT_NE(error_of(":0=foam", set).find("type:0=foam"), std::string::npos);
  EXPECT_NE(error_of("type:", set).find("give an attribute"), std::string::npos);
  EXPECT_NE(error_of("type:0=foam,", set).find("give an attribute"), std::string::npos);
  EXPECT_NE(error_of("type:=foam", set).find("give an attribute"), std::string::npos);
  EXPECT_NE(error_of("type:0=lava", set).find("water, foam, spray, bubble, sand, none"), std::string::npos);
  EXPECT_NE(error_of("kind:0=foam", set).find("mixed.bgeo: the particles have no attribute \"kind\""),
            std::string::npos);
  EXPECT_NE(error_of("type:zero=foam", set).find("\"zero\" is none"), std::string::npos);
  ParticleSet vectors = set;
  vectors.attributes[0].components = 2;
  vectors.attributes[0].ints = {0, 1, 2, 3};
  EXPECT_NE(error_of("type:0=foam", vectors).find("they have: none"), std::string::npos);
}

}  // namespace
}  // namespace embrun

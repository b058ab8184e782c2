#include "particles/radius.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/error.h"

namespace embrun {
namespace {

ParticleSet with_radii(std::vector<float> radii, const char* name = "radius") {
  ParticleSet set;
  for (std::size_t i = 0; i < radii.size(); ++i) set.positions.push_back({static_cast<double>(i), 0, 0});
  Attribute attribute;
  attribute.name = name;
  attribute.floats = std::move(radii);
  set.attributes.push_back(attribute);
  return set;
}

SpacingEstimate measured() {
  SpacingEstimate spacing;
  spacing.has_bulk = true;
  spacing.spacing = 0.05;
  spacing.nearest_neighbour = 0.04;
  return spacing;
}

std::string error_of(const ParticleSet& set, const SpacingEstimate& spacing, std::optional<double> given) {
  try {
    choose_radius(set, spacing, given, "dam.bgeo");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Radius, TheUsersComesFirst) {
  const RadiusChoice choice = choose_radius(with_radii({1, 2}), measured(), 0.5, "f");
  EXPECT_EQ(choice.source, RadiusSource::given);
  EXPECT_EQ(choice.radius, 0.5);
  EXPECT_TRUE(choice.radii.empty());
}

TEST(Radius, ThenTheFiles) {
  const RadiusChoice choice = choose_radius(with_radii({1, 2, 4}), measured(), std::nullopt, "f");
  EXPECT_EQ(choice.source, RadiusSource::file);
  EXPECT_EQ(choice.radius, 2);
  EXPECT_EQ(choice.radii, (std::vector<float>{1, 2, 4}));
  // All the same: no need for an array.
  const RadiusChoice same = choose_radius(with_radii({2, 2}), measured(), std::nullopt, "f");
  EXPECT_EQ(same.radius, 2);
  EXPECT_TRUE(same.radii.empty());
}

TEST(Radius, ThenHalfTheSpacing) {
  const RadiusChoice choice = choose_radius(with_radii({1}, "mass"), measured(), std::nullopt, "f");
  EXPECT_EQ(choice.source, RadiusSource::spacing);
  EXPECT_EQ(choice.radius, 0.025);
}

TEST(Radius, WithoutBulkHalfTheNeighbourDistance) {
  SpacingEstimate spacing;
  spacing.nearest_neighbour = 0.04;
  const RadiusChoice choice = choose_radius(with_radii({1}, "mass"), spacing, std::nullopt, "f");
  EXPECT_EQ(choice.source, RadiusSource::nearest_neighbour);
  EXPECT_EQ(choice.radius, 0.02);
}

TEST(Radius, UnusableRadiiAreMarkedAndDropped) {
  ParticleSet set = with_radii({1, 0, 3, -1, std::numeric_limits<float>::denorm_min(), 5});
  RadiusChoice choice = choose_radius(set, measured(), std::nullopt, "f");
  EXPECT_EQ(choice.without_radius, 3u);
  EXPECT_EQ(choice.radii, (std::vector<float>{1, 0, 3, 0, 0, 5}));
  EXPECT_EQ(choice.radius, 3);
  drop_particles_without_radius(set, choice);
  ASSERT_EQ(set.size(), 3u);
  EXPECT_EQ(set.positions[1].x, 2);
  EXPECT_EQ(set.find("radius")->floats, (std::vector<float>{1, 3, 5}));
  EXPECT_EQ(choice.radii, (std::vector<float>{1, 3, 5}));
  EXPECT_EQ(set.notes, std::vector<std::string>{"3 of 6 particles were dropped: no positive radius"});
}

TEST(Radius, ErrorsSayWhatToDo) {
  const ParticleSet none = with_radii({1}, "mass");
  for (const double bad :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e-60}) {
    EXPECT_NE(error_of(none, measured(), bad).find("dam.bgeo: radius: the given radius"), std::string::npos) << bad;
  }
  EXPECT_EQ(error_of(with_radii({0, -2}), measured(), std::nullopt),
            "dam.bgeo: radius: none of the particles has a positive radius; give one with --radius");
  EXPECT_NE(error_of(none, {}, std::nullopt).find("give one with --radius"), std::string::npos);
}

// Single precision has 24 bits: at half the span of 1e6 m from the middle it steps by 0.06 m.
TEST(Radius, RunawayParticlesAreRefused) {
  ParticleSet set;
  set.positions = {{0, 0, 0}, {1, 2, 3}};
  EXPECT_NO_THROW(check_extent(set, 0.025, "dam.bgeo"));
  set.positions.push_back({0, 1e6, 0});
  EXPECT_THROW(check_extent(set, 0.025, "dam.bgeo"), Error);
  EXPECT_NO_THROW(check_extent(set, 25, "dam.bgeo"));
  // Far away together is no problem: positions are recentred.
  set.positions = {{1e9, 0, 0}, {1e9 + 1, 2, 3}};
  EXPECT_NO_THROW(check_extent(set, 0.025, "dam.bgeo"));
}

TEST(ParticleSet, KeepsTheChosenParticlesWithAllAttributes) {
  ParticleSet set = with_radii({1, 2, 3});
  Attribute pairs;
  pairs.name = "pairs";
  pairs.type = AttributeType::int64;
  pairs.components = 2;
  pairs.longs = {10, 11, 20, 21, 30, 31};
  set.attributes.push_back(pairs);
  keep_particles(set, {1, 0, 1});
  ASSERT_EQ(set.size(), 2u);
  EXPECT_EQ(set.positions[1].x, 2);
  EXPECT_EQ(set.attributes[0].floats, (std::vector<float>{1, 3}));
  EXPECT_EQ(set.attributes[1].longs, (std::vector<std::int64_t>{10, 11, 30, 31}));
}

}  // namespace
}  // namespace embrun

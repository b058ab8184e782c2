#include "particles/append_particles.h"

#include <gtest/gtest.h>

namespace embrun {
namespace {

Attribute floats(const char* name, std::vector<float> values, int components = 1) {
  Attribute a;
  a.name = name;
  a.components = components;
  a.floats = std::move(values);
  return a;
}

Attribute ints(const char* name, std::vector<std::int32_t> values, std::vector<std::string> strings = {}) {
  Attribute a;
  a.name = name;
  a.type = AttributeType::int32;
  a.ints = std::move(values);
  a.strings = std::move(strings);
  return a;
}

Attribute longs(const char* name, std::vector<std::int64_t> values) {
  Attribute a;
  a.name = name;
  a.type = AttributeType::int64;
  a.longs = std::move(values);
  return a;
}

TEST(AppendParticles, KeepsWhatBothHave) {
  ParticleSet set, more;
  set.positions = {{0, 0, 0}, {1, 0, 0}};
  set.attributes = {floats("density", {1, 2}), floats("tint", {1, 2, 3, 4, 5, 6}, 3), ints("id", {7, 8}),
                    ints("type", {0, 1}, {"foam", "water"})};
  more.positions = {{2, 0, 0}};
  more.attributes = {ints("type", {0}, {"sand"}), longs("id", {10000000000}), floats("age", {5}),
                     floats("density", {3}), floats("tint", {9})};
  append_particles(set, more);
  ASSERT_EQ(set.size(), 3u);
  EXPECT_EQ(set.positions[2], (Vec3d{2, 0, 0}));
  ASSERT_EQ(set.attributes.size(), 3u);
  EXPECT_EQ(set.find("density")->floats, (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(set.find("id")->longs, (std::vector<std::int64_t>{7, 8, 10000000000}));
  EXPECT_TRUE(set.find("id")->ints.empty());
  const Attribute* type = set.find("type");
  EXPECT_EQ(type->ints, (std::vector<std::int32_t>{0, 1, 2}));
  EXPECT_EQ(type->strings, (std::vector<std::string>{"foam", "water", "sand"}));
  EXPECT_EQ(set.notes.size(), 2u);  // of age, and of tint with another number of components
}

TEST(AppendParticles, NumbersOfDifferentTypesBecomeOne) {
  ParticleSet set, more;
  set.positions = {{0, 0, 0}};
  set.attributes = {ints("a", {7})};
  more.positions = {{2, 0, 0}};
  more.attributes = {floats("a", {0.5f})};
  append_particles(set, more);
  EXPECT_EQ(set.find("a")->floats, (std::vector<float>{7, 0.5f}));
  EXPECT_TRUE(set.notes.empty());
}

}  // namespace
}  // namespace embrun

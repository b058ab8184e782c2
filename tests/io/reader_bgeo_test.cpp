#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "io/particle_files.h"
#include "io/read_particles.h"

namespace embrun {
namespace {

using namespace test;

struct Range {
  double least = INFINITY, greatest = -INFINITY, mean = 0;
};

Range range(const ParticleSet& set, const char* name, std::size_t component) {
  const Attribute& a = *set.find(name);
  const std::size_t components = static_cast<std::size_t>(a.components);
  Range r;
  for (std::size_t i = component; i < a.value_count(); i += components) {
    r.least = std::min(r.least, a.value(i));
    r.greatest = std::max(r.greatest, a.value(i));
    r.mean += a.value(i);
  }
  r.mean /= static_cast<double>(set.size());
  return r;
}

void expect_bounds(const ParticleSet& set, Vec3d low, Vec3d high) {
  Vec3d least = set.positions[0], greatest = least;
  for (const Vec3d p : set.positions) {
    least = {std::min(least.x, p.x), std::min(least.y, p.y), std::min(least.z, p.z)};
    greatest = {std::max(greatest.x, p.x), std::max(greatest.y, p.y), std::max(greatest.z, p.z)};
  }
  // The figures are known to four digits after the point.
  EXPECT_NEAR(least.x, low.x, 5e-5);
  EXPECT_NEAR(least.y, low.y, 5e-5);
  EXPECT_NEAR(least.z, low.z, 5e-5);
  EXPECT_NEAR(greatest.x, high.x, 5e-5);
  EXPECT_NEAR(greatest.y, high.y, 5e-5);
  EXPECT_NEAR(greatest.z, high.z, 5e-5);
}

// Counts, bounds and density as the provider of the data states them (another reader's figures).
TEST(BgeoReader, ReadsTheDamBreak) {
  const ParticleSet set = read_particles(EMBRUN_DATA_DIR "/dam_break.bgeo");
  EXPECT_EQ(set.size(), 110592u);
  EXPECT_EQ(set.dropped_non_finite, 0u);
  EXPECT_EQ(set.format, "BGEO V5, gzip");
  EXPECT_TRUE(set.notes.empty());
  expect_bounds(set, {-2.2057, -0.0145, -1.4617}, {2.2061, 3.5774, 1.4625});
  ASSERT_EQ(set.attributes.size(), 3u);
  const Range density = range(set, "density", 0);
  EXPECT_NEAR(density.mean, 950.5, 0.05);
  EXPECT_NEAR(density.least, 254.6, 0.05);
  EXPECT_NEAR(density.greatest, 1041.6, 0.05);
  const Attribute& velocity = *set.find("velocity");
  ASSERT_EQ(velocity.components, 3);
  double fastest = 0, mean = 0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    const Vec3 v{velocity.floats[3 * i], velocity.floats[3 * i + 1], velocity.floats[3 * i + 2]};
    fastest = std::max(fastest, static_cast<double>(length(v)));
    mean += static_cast<double>(length(v)) / static_cast<double>(set.size());
  }
  EXPECT_NEAR(fastest, 10.7, 0.05);
  EXPECT_NEAR(mean, 0.893, 5e-4);
  // Each id from 0 to n - 1 comes once.
  const Attribute& id = *set.find("id");
  ASSERT_EQ(id.type, AttributeType::int32);
  const std::set<std::int32_t> ids(id.ints.begin(), id.ints.end());
  EXPECT_EQ(ids.size(), set.size());
  EXPECT_EQ(*ids.begin(), 0);
  EXPECT_EQ(*ids.rbegin(), 110591);
}

TEST(BgeoReader, ReadsTheCalmPool) {
  const ParticleSet set = read_particles(EMBRUN_DATA_DIR "/calm_pool.bgeo");
  EXPECT_EQ(set.size(), 110375u);
  expect_bounds(set, {-2.2028, -0.0037, -1.4585}, {2.2017, 1.0134, 1.4581});
  const Range density = range(set, "density", 0);
  EXPECT_NEAR(density.mean, 995.9, 0.05);
  EXPECT_NEAR(density.least, 286.2, 0.05);
  EXPECT_NEAR(density.greatest, 1005.8, 0.05);
}

TEST(BgeoReader, PlainAndGzippedAreTheSame) {
  const ParticleSet set = some_particles(300);
  const std::string file = as_bgeo(set);
  const ParticleSet plain = read_particles_from_memory(as_bytes(file), "plain");
  const std::string packed = gzipped(file);
  const ParticleSet unpacked = read_particles_from_memory(as_bytes(packed), "packed");
  EXPECT_EQ(plain.format, "BGEO V5");
  ASSERT_EQ(plain.size(), 300u);
  ASSERT_EQ(unpacked.size(), 300u);
  for (std::size_t i = 0; i < 300; ++i) {
    EXPECT_EQ(to_float(plain.positions[i]), to_float(set.positions[i]));
    EXPECT_EQ(to_float(unpacked.positions[i]), to_float(set.positions[i]));
  }
  for (std::size_t a = 0; a < set.attributes.size(); ++a) {
    EXPECT_EQ(plain.attributes[a].floats, set.attributes[a].floats);
    EXPECT_EQ(plain.attributes[a].ints, set.attributes[a].ints);
    EXPECT_EQ(unpacked.attributes[a].floats, set.attributes[a].floats);
  }
}

// A gzip file may be several streams, one after the other.
TEST(BgeoReader, ReadsSeveralGzipMembers) {
  const std::string file = as_bgeo(some_particles(50));
  const std::string packed = gzipped(file.substr(0, 700)) + gzipped(file.substr(700));
  EXPECT_EQ(read_particles_from_memory(as_bytes(packed), "packed").size(), 50u);
}

// Float, int, indexed string and vector; names with a blank; what follows the points is not looked at.
TEST(BgeoReader, ReadsAllAttributeTypes) {
  FileBytes file;
  file.text("BgeoV").number(std::int32_t{5}).number(std::int32_t{2});
  file.number(std::int32_t{1}).number(std::int32_t{0}).number(std::int32_t{0});  // one primitive
  file.number(std::int32_t{5}).number(std::int32_t{1}).number(std::int32_t{0}).number(std::int32_t{0});
  const auto attribute = [&](std::string_view name, int components, int type) {
    file.number(static_cast<std::uint16_t>(name.size())).text(name);
    file.number(static_cast<std::uint16_t>(components)).number(static_cast<std::int32_t>(type));
  };
  attribute("my mass", 1, 0);
  file.number(0.0f);
  attribute("v", 3, 5);
  file.number(0.0f).number(0.0f).number(0.0f);
  attribute("pscale", 1, 0);
  file.number(1.0f);
  attribute("material", 1, 4);
  file.number(std::int32_t{2}).number(std::uint16_t{5}).text("water").number(std::uint16_t{4}).text("foam");
  attribute("pair", 2, 1);
  file.number(std::int32_t{0}).number(std::int32_t{0});
  file.number(1.0f).number(2.0f).number(3.0f).number(1.0f);  // position, w
  file.number(0.5f).number(7.0f).number(8.0f).number(9.0f).number(0.25f).number(std::int32_t{1});
  file.number(std::int32_t{-5}).number(std::int32_t{6});
  file.number(-1.0f).number(-2.0f).number(-3.0f).number(0.5f);
  file.number(1.5f).number(10.0f).number(11.0f).number(12.0f).number(0.75f).number(std::int32_t{0});
  file.number(std::int32_t{-7}).number(std::int32_t{8});
  file.text("primitives and so on");

  const ParticleSet set = read_particles_from_memory(as_bytes(file.str()), "types");
  ASSERT_EQ(set.size(), 2u);
  EXPECT_EQ(set.positions[1].z, -3.0);
  ASSERT_NE(set.find("my mass"), nullptr);
  EXPECT_EQ(set.find("my mass")->floats, (std::vector<float>{0.5f, 1.5f}));
  EXPECT_EQ(set.find("velocity")->floats, (std::vector<float>{7, 8, 9, 10, 11, 12}));
  EXPECT_EQ(set.find("v"), set.find("velocity"));
  EXPECT_EQ(set.find("radius")->floats, (std::vector<float>{0.25f, 0.75f}));
  EXPECT_EQ(set.find("radius")->file_name, "pscale");
  EXPECT_EQ(set.find("material")->strings, (std::vector<std::string>{"water", "foam"}));
  EXPECT_EQ(set.find("material")->ints, (std::vector<std::int32_t>{1, 0}));
  EXPECT_EQ(set.find("pair")->ints, (std::vector<std::int32_t>{-5, 6, -7, 8}));
  // w is kept, as it is not always 1 here.
  ASSERT_NE(set.find("w"), nullptr);
  EXPECT_EQ(set.find("w")->floats, (std::vector<float>{1.0f, 0.5f}));
}

std::string one_attribute_file(float value, Vec3 position = {1, 2, 3}) {
  FileBytes file = bgeo_header(2, 1);
  file.number(std::uint16_t{7}).text("density").number(std::uint16_t{1}).number(std::int32_t{0}).number(0.0f);
  file.number(0.0f).number(0.0f).number(0.0f).number(1.0f).number(1000.0f);
  file.number(position.x).number(position.y).number(position.z).number(1.0f).number(value);
  return file.text(std::string_view("\0\xff", 2)).str();
}

TEST(BgeoReader, DropsAndCountsNonFinitePositions) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Vec3 bad : {Vec3{nan, 0, 0}, Vec3{0, infinity, 0}, Vec3{0, 0, -infinity}}) {
    const std::string file = one_attribute_file(998, bad);
    const ParticleSet set = read_particles_from_memory(as_bytes(file), "bad");
    EXPECT_EQ(set.size(), 1u);
    EXPECT_EQ(set.dropped_non_finite, 1u);
    EXPECT_EQ(set.find("density")->floats, std::vector<float>{1000});
    EXPECT_EQ(set.notes.size(), 1u);
  }
}

TEST(BgeoReader, ReplacesOtherNonFiniteValues) {
  const std::string file = one_attribute_file(std::numeric_limits<float>::quiet_NaN());
  const ParticleSet set = read_particles_from_memory(as_bytes(file), "bad");
  EXPECT_EQ(set.size(), 2u);
  EXPECT_EQ(set.find("density")->floats, (std::vector<float>{1000, 0}));
  EXPECT_EQ(set.find("density")->replaced_non_finite, 1u);
  EXPECT_EQ(set.notes.size(), 1u);
}

TEST(BgeoReader, ErrorsNameFilePlaceAndAttribute) {
  const std::string good = one_attribute_file(998);
  ASSERT_EQ(particle_error(good), "");
  // 41 bytes of header, 7 + 12 bytes of attribute, a point is 20 bytes: the second one begins at 80 and is cut.
  EXPECT_EQ(particle_error(good.substr(0, 90)),
            "some.file: offset 60: points: 2 times 20 bytes are announced, but at most 30 are left in the file");
  EXPECT_EQ(particle_error(good.substr(0, 50)),
            "some.file: offset 50: attribute 'density': the file ends here: 2 bytes are needed, 0 are left");
  std::string wrong_type = good;
  wrong_type[55] = 9;
  EXPECT_EQ(particle_error(wrong_type),
            "some.file: offset 56: attribute 'density': type 9 is not known (0 float, 1 int, 4 string, 5 vector)");
  std::string version = good;
  version[8] = 6;
  EXPECT_EQ(particle_error(version), "some.file: offset 9: version: 6 is not supported, only 5");
  const std::string far_away = one_attribute_file(998, {0, 3e20f, 0});
  EXPECT_EQ(particle_error(far_away),
            "some.file: offset 80: position: coordinate 3e+20 of particle 1 is beyond 1e+15 m: single precision cannot "
            "render that");
  const std::string empty = bgeo_header(0, 0).str();
  EXPECT_EQ(particle_error(empty), "some.file: offset 41: number of points: the file holds no particles");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  FileBytes lone = bgeo_header(1, 0);
  lone.number(nan).number(0.0f).number(0.0f).number(1.0f);
  EXPECT_EQ(particle_error(lone.str()),
            "some.file: offset 41: position: none of the 1 particles has a finite position");
}

TEST(BgeoReader, CountsAreCheckedAgainstTheSize) {
  EXPECT_NE(particle_error(bgeo_header(2000000000, 0).str()).find("offset 41: points: 2000000000 times 16 bytes"),
            std::string::npos);
  // A hundred bytes of gzip can hold about a hundred kilobytes, no more.
  EXPECT_NE(particle_error(gzipped(bgeo_header(2000000000, 0).str())).find("points: 2000000000 times 16 bytes"),
            std::string::npos);
  EXPECT_NE(particle_error(bgeo_header(1, 2000000000).str()).find("number of point attributes"), std::string::npos);
  EXPECT_NE(particle_error(bgeo_header(-1, 0).str()).find("number of points: -1 is negative"), std::string::npos);
}

TEST(BgeoReader, GzipDamageIsFound) {
  const std::string packed = gzipped(as_bgeo(some_particles(100)));
  std::string checksum = packed;
  checksum[checksum.size() - 6] ^= 1;
  EXPECT_NE(particle_error(checksum).find("gzip: the compressed data are damaged"), std::string::npos);
  EXPECT_NE(particle_error(packed.substr(0, packed.size() / 2)).find("gzip: the compressed data end too early"),
            std::string::npos);
  EXPECT_NE(particle_error(gzipped("ply\nformat ascii 1.0\n")).find("only BGEO is read gzipped"), std::string::npos);
}

}  // namespace
}  // namespace embrun

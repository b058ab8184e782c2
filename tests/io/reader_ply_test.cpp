#include <gtest/gtest.h>

#include <limits>

#include "io/particle_files.h"
#include "io/read_particles.h"

namespace embrun {
namespace {

using namespace test;

ParticleSet read(std::string_view file) { return read_particles_from_memory(as_bytes(file), "some.ply"); }

TEST(PlyReader, ReadsTheBundledDroplets) {
  const ParticleSet set = read_particles(EMBRUN_DATA_DIR "/droplets.ply");
  EXPECT_EQ(set.size(), 2955u);
  EXPECT_EQ(set.format, "PLY binary little-endian");
  // The first row of the same particles as text, by the provider of the data: 0.0076209195,0.481815994,0.0856064036,
  // 16658, 2.25.
  EXPECT_EQ(to_float(set.positions[0]), (Vec3{0.0076209195f, 0.481815994f, 0.0856064036f}));
  EXPECT_EQ(set.find("id")->ints[0], 16658);
  EXPECT_EQ(set.find("extinction")->floats[0], 2.25f);
}

TEST(PlyReader, TheThreeEncodingsAgree) {
  const ParticleSet set = some_particles(200);
  for (const PlyKind kind : {PlyKind::ascii, PlyKind::little_endian, PlyKind::big_endian}) {
    const ParticleSet again = read(as_ply(set, kind));
    ASSERT_EQ(again.size(), 200u);
    for (std::size_t i = 0; i < set.size(); ++i) EXPECT_EQ(to_float(again.positions[i]), to_float(set.positions[i]));
    EXPECT_EQ(again.find("id")->ints, set.find("id")->ints);
    EXPECT_EQ(again.find("density")->floats, set.find("density")->floats);
    EXPECT_EQ(again.find("velocity")->floats, set.find("velocity")->floats);
    EXPECT_EQ(again.find("velocity")->file_name, "vx,vy,vz");
  }
}

// Every scalar type, at the ends of its range.
TEST(PlyReader, ReadsAllTypes) {
  for (const bool big : {false, true}) {
    FileBytes file(big);
    file.text("ply\r\nformat ").text(big ? "binary_big_endian" : "binary_little_endian").text(" 1.0\r\n");
    file.text(
        "obj_info nothing\r\nelement vertex 2\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\n");
    file.text("property char a\r\nproperty uint8 b\r\nproperty int16 c\r\nproperty ushort d\r\nproperty int32 e\r\n");
    file.text("property uint f\r\nproperty int64 g\r\nproperty uint64 h\r\nproperty float64 i\r\nend_header\r\n");
    for (const int row : {0, 1}) {
      file.number(1e9 + row).number(0.1).number(-0.1);
      file.number(static_cast<std::int8_t>(row ? 127 : -128)).number(static_cast<std::uint8_t>(row ? 255 : 0));
      file.number(static_cast<std::int16_t>(row ? 32767 : -32768)).number(static_cast<std::uint16_t>(row ? 65535 : 0));
      file.number(row ? INT32_MAX : INT32_MIN).number(row ? UINT32_MAX : 7u);
      file.number(row ? INT64_MAX : INT64_MIN).number(row ? UINT64_MAX : std::uint64_t{7}).number(row ? 0.5 : 1e300);
    }
    const ParticleSet set = read(file.str());
    ASSERT_EQ(set.size(), 2u);
    EXPECT_EQ(set.positions[1].x, 1000000001.0);  // more digits than a float has
    EXPECT_EQ(set.find("a")->ints, (std::vector<std::int32_t>{-128, 127}));
    EXPECT_EQ(set.find("b")->ints, (std::vector<std::int32_t>{0, 255}));
    EXPECT_EQ(set.find("c")->ints, (std::vector<std::int32_t>{-32768, 32767}));
    EXPECT_EQ(set.find("d")->ints, (std::vector<std::int32_t>{0, 65535}));
    EXPECT_EQ(set.find("e")->ints, (std::vector<std::int32_t>{INT32_MIN, INT32_MAX}));
    // What does not fit into 32 bits stays whole in 64.
    ASSERT_EQ(set.find("f")->type, AttributeType::int64);
    EXPECT_EQ(set.find("f")->longs, (std::vector<std::int64_t>{7, 4294967295}));
    EXPECT_EQ(set.find("g")->longs, (std::vector<std::int64_t>{INT64_MIN, INT64_MAX}));
    EXPECT_EQ(set.find("h")->longs, (std::vector<std::int64_t>{7, -1}));
    EXPECT_EQ(set.find("i")->floats, (std::vector<float>{0, 0.5f}));  // 1e300 is infinite as a float
    EXPECT_EQ(set.find("i")->replaced_non_finite, 1u);
    EXPECT_EQ(set.notes.size(), 2u);  // on h and on i
  }
}

TEST(PlyReader, SmallUnsignedIdsAreInt32) {
  FileBytes file(false);
  file.text(
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nproperty uint id\nend_header\n");
  file.number(1.0f).number(2.0f).number(3.0f).number(2147483647u);
  EXPECT_EQ(read(file.str()).find("id")->ints, std::vector<std::int32_t>{2147483647});
}

// Elements with lists before and after the vertices, vertices with a list of their own, x y z in any order.
TEST(PlyReader, FindsTheVerticesAnywhere) {
  const std::string header =
      "element other 2\nproperty list uchar short numbers\nproperty float weight\n"
      "element vertex 2\nproperty float z\nproperty list int uchar tags\nproperty float x\nproperty float y\n"
      "element empty 1000000000000\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string ascii =
      "ply\nformat ascii 1.0\n" + header + "3 1 2 3 0.5\n0 0.25\n\n3 2 8 9 1 2\n6 0 4 5\n3 0 1 0\n";
  FileBytes binary(true);
  binary.text("ply\nformat binary_big_endian 1.0\n" + header);
  binary.number(std::uint8_t{3}).number(std::int16_t{1}).number(std::int16_t{2}).number(std::int16_t{3}).number(0.5f);
  binary.number(std::uint8_t{0}).number(0.25f);
  binary.number(3.0f).number(std::int32_t{2}).number(std::uint8_t{8}).number(std::uint8_t{9}).number(1.0f).number(2.0f);
  binary.number(6.0f).number(std::int32_t{0}).number(4.0f).number(5.0f);
  for (const std::string& file : {ascii, binary.str()}) {
    const ParticleSet set = read(file);
    ASSERT_EQ(set.size(), 2u);
    EXPECT_EQ(to_float(set.positions[0]), (Vec3{1, 2, 3}));
    EXPECT_EQ(to_float(set.positions[1]), (Vec3{4, 5, 6}));
    EXPECT_EQ(set.notes, std::vector<std::string>{"list property 'tags' was left out"});
  }
}

TEST(PlyReader, ScalesByteColours) {
  const ParticleSet set = read(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
      "property float nx\nproperty float ny\nproperty float nz\nend_header\n0 0 0 255 51 0 128 0 1 0\n");
  // 51/255 = 1/5.
  EXPECT_EQ(set.find("color")->floats, (std::vector<float>{1, 0.2f, 0}));
  EXPECT_EQ(set.find("alpha")->ints, std::vector<std::int32_t>{128});
  EXPECT_EQ(set.find("normal")->floats, (std::vector<float>{0, 1, 0}));
}

TEST(PlyReader, ErrorsNameFilePlaceAndProperty) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
      "property float z\nproperty uchar kind\nend_header\n";
  ASSERT_EQ(particle_error(header + "0 0 0 1\n0 0 1 2\n"), "");
  EXPECT_EQ(particle_error(header + "0 0 0 1\n0 0 1\n"),
            "some.file: line 10: property 'kind' of element 'vertex': the line ends before it");
  EXPECT_EQ(particle_error(header + "0 0 0 1\n0 0 1 256\n"),
            "some.file: line 10: property 'kind' of element 'vertex': '256' is no number of its type");
  EXPECT_EQ(particle_error(header + "0 0 0 1\n0 zero 1 2\n"),
            "some.file: line 10: property 'y' of element 'vertex': 'zero' is no number of its type");
  EXPECT_EQ(particle_error(header + "0 0 0 1 5\n0 0 1 2\n"),
            "some.file: line 9: element 'vertex': there are more values on the line than properties");
  EXPECT_EQ(particle_error(header + "0 0 0 10000\n0 0 0\n"),
            "some.file: line 9: property 'kind' of element 'vertex': '10000' is no number of its type");
  EXPECT_EQ(particle_error(header + "0 0 0 1           \n"),
            "some.file: line 9: element 'vertex': the file ends after 1 of 2 rows");
  EXPECT_EQ(particle_error(header + "0 0 0 1\n0 1e20 1 2\n"),
            "some.file: line 10: position: coordinate 1e+20 of particle 1 is beyond 1e+15 m: single precision cannot "
            "render that");
  EXPECT_EQ(particle_error("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty real y\nend_header\n"),
            "some.file: line 5: property: 'real' is not a PLY type");
  EXPECT_EQ(
      particle_error("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n0 0\n"),
      "some.file: line 7: position: no columns x, y and z of numbers; there are 'x', 'y'");
  EXPECT_EQ(particle_error("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
                           "property float z\nend_header\n"),
            "some.file: line 7: element 'vertex': the file holds no particles");
  EXPECT_EQ(particle_error("ply\nformat ascii 1.0\nelement face 0\nend_header\n"),
            "some.file: line 4: header: there is no element \"vertex\"");
  EXPECT_EQ(particle_error("ply\nformat ascii 1.0\nelement vertex 9"),
            "some.file: line 3: header: the file ends before \"end_header\"");
}

TEST(PlyReader, CountsAreCheckedAgainstTheSize) {
  const auto header = [](std::string_view format, std::string_view count) {
    return "ply\nformat " + std::string(format) + " 1.0\nelement vertex " + std::string(count) +
           "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  };
  for (const char* count : {"1000000000", "18446744073709551615"}) {
    EXPECT_NE(particle_error(header("ascii", count) + "0 0 0\n").find("element 'vertex': " + std::string(count)),
              std::string::npos);
    EXPECT_NE(particle_error(header("binary_little_endian", count) + std::string(12, '\0')).find("are announced"),
              std::string::npos);
  }
  EXPECT_NE(particle_error(header("ascii", "-1")).find("line 3: element 'vertex': '-1' is not a count"),
            std::string::npos);
  // A list that is longer than the file.
  FileBytes list(false);
  list.text(
      "ply\nformat binary_little_endian 1.0\nelement a 1\nproperty list int double b\nelement vertex 1\n"
      "property float x\nproperty float y\nproperty float z\nend_header\n");
  list.number(INT32_MAX).number(0.0);
  EXPECT_NE(particle_error(list.str()).find("property 'b' of element 'a': 2147483647 times 8 bytes"),
            std::string::npos);
}

}  // namespace
}  // namespace embrun

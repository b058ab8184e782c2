#include "io/write_mesh.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

#include "base/error.h"
#include "image/scratch_folder.h"
#include "io/read_mesh.h"

namespace embrun {
namespace {

TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.positions = {{0.1f, 0, 0}, {1, 1.0f / 3.0f, 0}, {0, 1, 1e-7f}, {0, 0, 12345.678f}};
  mesh.normals = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0.6f, -0.8f}};
  mesh.triangles = {{{0, 2, 1}}, {{0, 1, 3}}, {{1, 2, 3}}, {{2, 0, 3}}};
  return mesh;
}

/// The corners of all triangles: an OBJ file's reader numbers them in its own way.
TriangleMesh corners_of(const TriangleMesh& mesh) {
  TriangleMesh corners;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(corners.positions.size());
    corners.triangles.push_back({first, first + 1, first + 2});
    for (const std::uint32_t i : t) {
      corners.positions.push_back(mesh.positions[i]);
      if (!mesh.normals.empty()) corners.normals.push_back(mesh.normals[i]);
      if (!mesh.coordinates.empty()) corners.coordinates.push_back(mesh.coordinates[i]);
    }
  }
  return corners;
}

TEST(WriteMesh, WritesWhatItReads) {
  const ScratchFolder folder;
  for (const char* name : {"a.ply", "a.obj", "B.PLY"}) {
    const std::string path = (folder / name).string();
    TriangleMesh mesh = tetrahedron();
    write_mesh(path, mesh, {.comment = "two\nlines"});
    EXPECT_TRUE(corners_of(read_mesh(path)) == corners_of(mesh)) << name;
    EXPECT_EQ(read_mesh(path).positions.size(), mesh.positions.size());
    mesh.coordinates = {{0, 0.25f}, {0.5f, 1}, {1, 0}, {0.125f, 0.75f}};
    write_mesh(path, mesh);
    EXPECT_TRUE(corners_of(read_mesh(path)) == corners_of(mesh)) << name;
    EXPECT_EQ(read_mesh(path).positions.size(), mesh.positions.size());
    mesh.normals.clear();
    write_mesh(path, mesh);
    EXPECT_TRUE(corners_of(read_mesh(path)) == corners_of(mesh)) << name;
    EXPECT_EQ(read_mesh(path).positions.size(), mesh.positions.size());
    mesh.coordinates.clear();
    write_mesh(path, mesh);
    EXPECT_TRUE(corners_of(read_mesh(path)) == corners_of(mesh)) << name;
    EXPECT_EQ(read_mesh(path).positions.size(), mesh.positions.size());
  }
  EXPECT_EQ(folder.files(), (std::vector<std::string>{"B.PLY", "a.obj", "a.ply"}));
}

// Byte for byte, as the format's description has it.
TEST(WriteMesh, WritesBinaryLittleEndianPly) {
  const ScratchFolder folder;
  TriangleMesh mesh;
  mesh.positions = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  mesh.triangles = {{{2, 1, 0}}};
  write_mesh((folder / "t.ply").string(), mesh, {.origin = {0.5, 0, 0}, .comment = "made by hand"});
  std::string expected =
      "ply\nformat binary_little_endian 1.0\ncomment made by hand\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nelement face 1\nproperty list uchar uint vertex_indices\nend_header\n";
  const auto add = [&expected](const auto value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    expected.append(raw, sizeof value);
  };
  for (const float v : {1.5f, 2.0f, 3.0f, 4.5f, 5.0f, 6.0f, 7.5f, 8.0f, 9.0f}) add(v);
  expected += '\3';
  for (const std::uint32_t corner : {2u, 1u, 0u}) add(corner);
  EXPECT_EQ(content_of(folder / "t.ply"), expected);
}

// Far from the origin single precision would round cells away: what is asked for decides.
TEST(WriteMesh, KeepsPositionsFarAway) {
  const ScratchFolder folder;
  const TriangleMesh mesh = tetrahedron();
  const Vec3d origin{4e6, -5e6, 1e6};
  for (const char* name : {"far.ply", "far.obj"}) {
    write_mesh((folder / name).string(), mesh, {.origin = origin, .resolution = 1e-3f});
    std::string bytes = content_of(folder / name);
    if (std::string(name) == "far.ply") {
      EXPECT_NE(bytes.find("property double x"), std::string::npos);
      const char* vertices = bytes.data() + bytes.find("end_header\n") + 11;
      double second[3];
      std::memcpy(second, vertices + 3 * sizeof(double) + 3 * sizeof(float), sizeof second);
      EXPECT_EQ(second[1], origin.y + static_cast<double>(1.0f / 3.0f));
    } else {
      std::istringstream text(bytes);
      std::string line;
      std::getline(text, line);
      std::getline(text, line);
      double x, y, z;
      ASSERT_EQ(std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z), 3);
      EXPECT_EQ(y, origin.y + static_cast<double>(1.0f / 3.0f));
    }
    // Near enough, or without need, it stays single.
    write_mesh((folder / name).string(), mesh, {.origin = origin, .resolution = 10});
    EXPECT_EQ(content_of(folder / name).find("double"), std::string::npos);
  }
}

TEST(WriteMesh, SaysWhatIsWrong) {
  const ScratchFolder folder;
  const auto message = [](const auto& action) {
    try {
      action();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  EXPECT_NE(message([&] { check_mesh_path((folder / "a.stl").string()); }).find("a.stl: a mesh is written as .ply or"),
            std::string::npos);
  EXPECT_NE(message([&] { write_mesh((folder / "no/a.ply").string(), tetrahedron()); }).find("does not exist"),
            std::string::npos);
  EXPECT_NO_THROW(check_mesh_path((folder / "a.obj").string()));
  EXPECT_TRUE(folder.files().empty());
}

}  // namespace
}  // namespace embrun

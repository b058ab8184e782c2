#include <gtest/gtest.h>

#include <cmath>

#include "io/particle_files.h"
#include "io/read_mesh.h"

namespace embrun {
namespace {

using namespace test;

TriangleMesh read(std::string_view file) { return read_mesh_from_memory(as_bytes(file), "some.mesh"); }

/// Volume inside a closed mesh by the divergence theorem: the sum of the signed tetrahedra to the origin.
double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    sum += dot(to_double(mesh.positions[a]), cross(to_double(mesh.positions[b]), to_double(mesh.positions[c]))) / 6;
  }
  return sum;
}

TEST(MeshReader, ReadsPlyInAllEncodings) {
  for (const PlyKind kind : {PlyKind::ascii, PlyKind::little_endian, PlyKind::big_endian}) {
    const TriangleMesh mesh = read(tetrahedron_ply(kind));
    EXPECT_EQ(mesh.positions.size(), 4u);
    EXPECT_EQ(mesh.triangles.size(), 4u);
    EXPECT_TRUE(mesh.normals.empty());
    EXPECT_DOUBLE_EQ(volume(mesh), 1.0 / 6);
  }
}

TEST(MeshReader, ReadsObjWithNormals) {
  const TriangleMesh mesh = read(tetrahedron_obj());
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_EQ(mesh.positions.size(), 12u);  // four faces of three corners, no two of which share a normal
  ASSERT_EQ(mesh.normals.size(), 12u);
  EXPECT_DOUBLE_EQ(volume(mesh), 1.0 / 6);
  for (const auto& triangle : mesh.triangles) {
    const Vec3 a = mesh.positions[triangle[0]];
    const Vec3 face = normalize(cross(mesh.positions[triangle[1]] - a, mesh.positions[triangle[2]] - a));
    for (const std::uint32_t corner : triangle) {
      EXPECT_NEAR(length(mesh.normals[corner]), 1.0f, 1e-6f);
      EXPECT_NEAR(dot(mesh.normals[corner], face), 1.0f, 1e-6f);
    }
  }
}

TEST(MeshReader, SharedCornersStayShared) {
  const TriangleMesh mesh = read("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n");
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.normals.size(), 4u);
}

// A square cut in two: four positions, but the triangles show different parts of the picture along their common side.
TEST(MeshReader, ReadsTextureCoordinatesOfObj) {
  const std::string file =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0 0\nvt 1 0.75\nvt 0.5\n"
      "f 1/1 2/2 3/3\nf 1/1 3/4 4/3\n";
  const TriangleMesh mesh = read(file);
  EXPECT_EQ(mesh.positions.size(), 5u);
  EXPECT_TRUE(mesh.normals.empty());
  ASSERT_EQ(mesh.coordinates.size(), 5u);
  // OBJ's v grows upwards from the picture's last row.
  EXPECT_EQ(mesh.coordinates[mesh.triangles[0][0]], (Vec2{0, 1}));
  EXPECT_EQ(mesh.coordinates[mesh.triangles[0][2]], (Vec2{1, 0.25f}));
  EXPECT_EQ(mesh.coordinates[mesh.triangles[1][1]], (Vec2{0.5f, 1}));
  EXPECT_EQ(mesh.positions[mesh.triangles[0][2]], mesh.positions[mesh.triangles[1][1]]);
  EXPECT_EQ(mesh.triangles[0][0], mesh.triangles[1][0]);
  // Not all corners have them: there are none.
  EXPECT_TRUE(read(file + "f 1 2 3\n").coordinates.empty());
}

TEST(MeshReader, ReadsTextureCoordinatesOfPly) {
  for (const auto& [u, v] : {std::pair{"u", "v"}, {"s", "t"}}) {
    const std::string header = std::string(
                                   "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                   "property float z\nproperty float ") +
                               u + "\nproperty float " + v +
                               "\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    const TriangleMesh mesh = read(header + "0 0 0 0.5 0.25\n1 0 0 2 -1\n0 1 0 0 1\n3 0 1 2\n");
    ASSERT_EQ(mesh.coordinates.size(), 3u);
    EXPECT_EQ(mesh.coordinates[0], (Vec2{0.5f, 0.25f}));
    EXPECT_EQ(mesh.coordinates[1], (Vec2{2, -1}));
    EXPECT_TRUE(read(header + "0 0 0 0.5 nan\n1 0 0 2 -1\n0 1 0 0 1\n3 0 1 2\n").coordinates.empty());
  }
}

// A square and a pentagon: 2 + 3 triangles whose areas add up to the polygons'.
TEST(MeshReader, PolygonsBecomeFans) {
  const std::string corners = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 3 0\nv 0 2 0\n";
  for (const std::string& file :
       {corners + "f 1 2 3 5\nf 1 2 3 4 5\n",
        std::string(
            "ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n"
            "element face 2\nproperty list uint8 uint vertex_index\nend_header\n0 0 0\n2 0 0\n2 2 0\n1 3 0\n0 2 0\n"
            "4 0 1 2 4\n5 0 1 2 3 4\n")}) {
    const TriangleMesh mesh = read(file);
    ASSERT_EQ(mesh.triangles.size(), 5u);
    double area = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      area += 0.5 * static_cast<double>(
                        length(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a])));
    }
    EXPECT_DOUBLE_EQ(area, 4 + 5);  // the square is 2 x 2, the pentagon has a roof of area 1 on it
  }
}

TEST(MeshReader, FacesMayComeBeforeVertices) {
  const TriangleMesh mesh = read(
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 3\nproperty float "
      "x\n"
      "property float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\nend_header\n"
      "3 0 1 2\n0 0 0 0 0 2\n1 0 0 0 0 0\n0 1 0 0 0 nan\n");
  ASSERT_EQ(mesh.normals.size(), 3u);
  // One is too long, one has no length, one is no number: all become (0, 0, 1), the first's direction and the face's.
  for (const Vec3 normal : mesh.normals) EXPECT_EQ(normal, (Vec3{0, 0, 1}));
}

TEST(MeshReader, ErrorsNameFilePlaceAndReason) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  ASSERT_EQ(mesh_error(vertices + "f 1 2 3\n"), "");
  EXPECT_EQ(mesh_error(vertices + "f 1 2 4\n"), "some.file: line 4: f: vertex 4 is out of range: there are 3 so far");
  EXPECT_EQ(mesh_error(vertices + "f 1 2 0\n"), "some.file: line 4: f: vertex 0 is out of range: there are 3 so far");
  EXPECT_EQ(mesh_error(vertices + "f -1 -2 -4\n"),
            "some.file: line 4: f: vertex -4 is out of range: there are 3 so far");
  EXPECT_EQ(mesh_error(vertices + "f 1//1 2//1 3//1\n"),
            "some.file: line 4: f: normal 1 is out of range: there are 0 so far");
  EXPECT_EQ(mesh_error(vertices + "f 1/2 2/1 3/1\n"),
            "some.file: line 4: f: texture coordinate 2 is out of range: there are 0 so far");
  EXPECT_EQ(mesh_error("vt 0 inf\n"), "some.file: line 1: vt: 'inf' is not a number, or too large");
  EXPECT_EQ(mesh_error(vertices + "f 1 2\n"), "some.file: line 4: f: a face of 2 corners");
  EXPECT_EQ(mesh_error(vertices + "f 1 2 x\n"), "some.file: line 4: f: 'x' is not an index");
  EXPECT_EQ(mesh_error("v 0 0\n"), "some.file: line 1: v: '' is not a number; three are needed");
  EXPECT_EQ(mesh_error("v 0 0 nan\n"), "some.file: line 1: v: (0, 0, nan) is not finite or too far away");
  EXPECT_EQ(mesh_error(vertices), "some.file: line 3: the mesh has no triangles");
  EXPECT_EQ(mesh_error("hello\n"), "some.file: line 1: 'hello' is not an OBJ keyword");

  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
  ASSERT_EQ(mesh_error(header + "3 0 1 2\n"), "");
  EXPECT_EQ(mesh_error(header + "3 0 1 3\n"), "some.file: line 13: face 0: vertex 3 of 3 vertices");
  EXPECT_EQ(mesh_error(header + "3 0 1 -1\n"), "some.file: line 13: face 0: vertex -1 of 3 vertices");
  EXPECT_EQ(mesh_error(header + "2 0 1\n"), "some.file: line 13: face 0: 2 corners");
  EXPECT_EQ(mesh_error(header + "3 0 1\n"),
            "some.file: line 13: property 'vertex_indices' of element 'face': 2 of 3 values");
  EXPECT_EQ(mesh_error("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"),
            "some.file: line 5: header: there is no element \"face\": a mesh is needed here");
  EXPECT_EQ(mesh_error("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                       "element face 1\nproperty list uchar float vertex_indices\nend_header\n0 0 0\n3 0 0 0\n"),
            "some.file: line 10: element 'face': it has no list of integers \"vertex_indices\"");
}

}  // namespace
}  // namespace embrun

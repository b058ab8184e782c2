#include "geometry/surface_coordinates.h"

#include <gtest/gtest.h>

#include <cmath>

namespace embrun {
namespace {

void expect_uv(const SurfaceCoordinates& c, float u, float v) {
  EXPECT_NEAR(c.uv.x, u, 1e-6);
  EXPECT_NEAR(c.uv.y, v, 1e-6);
}

// Longitude from x about z, and the angle from the pole: a quarter turn is a quarter of u, a half of v.
TEST(SurfaceCoordinates, OfABall) {
  expect_uv(ball_coordinates({1, 0, 0}), 0, 0.5f);
  expect_uv(ball_coordinates({0, 1, 0}), 0.25f, 0.5f);
  expect_uv(ball_coordinates({-1, 0, 0}), 0.5f, 0.5f);
  expect_uv(ball_coordinates({0, -1, 0}), 0.75f, 0.5f);
  EXPECT_EQ(ball_coordinates({0, 0, 1}).uv.y, 0);
  EXPECT_NEAR(ball_coordinates({0, 0, -1}).uv.y, 1, 1e-6);
  const float h = std::sqrt(0.5f);
  expect_uv(ball_coordinates({h, 0, h}), 0, 0.25f);
  EXPECT_LT(ball_coordinates({1, -1e-7f, 0}).uv.x, 1.000001f);
  EXPECT_EQ(ball_coordinates({0, 1, 0}).tangent, (Vec3{-1, 0, 0}));
}

TEST(SurfaceCoordinates, OfAPatch) {
  Patch patch;
  patch.center = {1, 2, 3};
  patch.half_u = 2;
  patch.half_v = 0.5f;
  expect_uv(patch_coordinates(patch, {1, 2, 3}), 0.5f, 0.5f);
  expect_uv(patch_coordinates(patch, {3, 2, 3}), 1, 0.5f);
  expect_uv(patch_coordinates(patch, {-1, 2, 3.5f}), 0, 0);  // axis_v is -z
  EXPECT_EQ(patch_coordinates(patch, {1, 2, 3}).tangent, (Vec3{1, 0, 0}));
  patch.half_u = infinity;
  expect_uv(patch_coordinates(patch, {8, 2, 3}), 7, 0.5f);
}

// Mitsuba 3's disk: the share of the radius, and the longitude from the first axis to the second.
TEST(SurfaceCoordinates, OfARoundPatch) {
  Patch disk;
  disk.center = {1, 2, 3};
  disk.half_u = disk.half_v = 2;
  disk.round = true;
  expect_uv(patch_coordinates(disk, {3, 2, 3}), 1, 0);
  expect_uv(patch_coordinates(disk, {1, 2, 2}), 0.5f, 0.25f);  // axis_v is -z
  expect_uv(patch_coordinates(disk, {0, 2, 3}), 0.5f, 0.5f);
  expect_uv(patch_coordinates(disk, {1, 2, 5}), 1, 0.75f);
  EXPECT_EQ(patch_coordinates(disk, {1, 2, 2}).tangent, (Vec3{0, 0, -1}));  // away from the centre
  EXPECT_EQ(patch_coordinates(disk, {1, 2, 3}).uv.x, 0);
  EXPECT_EQ(patch_coordinates(disk, {1, 2, 3}).tangent, (Vec3{1, 0, 0}));
  disk.v_reversed = true;
  expect_uv(patch_coordinates(disk, {1, 2, 2}), 0.5f, 0.75f);
}

TEST(SurfaceCoordinates, OfAMirroredPatch) {
  Patch patch;
  patch.half_u = patch.half_v = 1;
  patch.v_reversed = true;
  expect_uv(patch_coordinates(patch, {1, 0, -1}), 1, 0);  // axis_v is -z
  expect_uv(patch_coordinates(patch, {-1, 0, 0.5f}), 0, 0.75f);
}

// Mitsuba 3's cylinder: the longitude about the axis, and the share of the way.
TEST(SurfaceCoordinates, OfACylinder) {
  Cylinder cylinder;
  cylinder.start = {0, 0, 1};
  cylinder.length = 4;
  cylinder.radius = 0.5f;
  expect_uv(cylinder_coordinates(cylinder, {0.5f, 0, 1}), 0, 0);
  expect_uv(cylinder_coordinates(cylinder, {0, 0.5f, 2}), 0.25f, 0.25f);
  expect_uv(cylinder_coordinates(cylinder, {-0.5f, 0, 5}), 0.5f, 1);
  expect_uv(cylinder_coordinates(cylinder, {0, -0.5f, 3}), 0.75f, 0.5f);
  EXPECT_EQ(normalize(cylinder_coordinates(cylinder, {0, 0.5f, 2}).tangent), (Vec3{-1, 0, 0}));
  cylinder.meridian = {0, 1, 0};
  expect_uv(cylinder_coordinates(cylinder, {0, 0.5f, 2}), 0, 0.25f);
  cylinder.u_reversed = true;
  expect_uv(cylinder_coordinates(cylinder, {0.5f, 0, 2}), 0.25f, 0.25f);
  EXPECT_EQ(normalize(cylinder_coordinates(cylinder, {0, 0.5f, 2}).tangent), (Vec3{1, 0, 0}));
}

// Three corners of each face of Mitsuba 3's cube: where its (u, v) are (0, 1), (1, 1) and (0, 0).
TEST(SurfaceCoordinates, OfABox) {
  struct Face {
    Vec3 normal, top_left, top_right, origin;
  };
  const Face faces[] = {
      {{0, -1, 0}, {1, -1, -1}, {1, -1, 1}, {-1, -1, -1}}, {{0, 1, 0}, {1, 1, -1}, {-1, 1, -1}, {1, 1, 1}},
      {{1, 0, 0}, {1, -1, -1}, {1, 1, -1}, {1, -1, 1}},    {{0, 0, 1}, {1, -1, 1}, {1, 1, 1}, {-1, -1, 1}},
      {{-1, 0, 0}, {-1, -1, 1}, {-1, 1, 1}, {-1, -1, -1}}, {{0, 0, -1}, {1, 1, -1}, {1, -1, -1}, {-1, 1, -1}}};
  const Box3 cube{{-1, -1, -1}, {1, 1, 1}};
  for (const Face& face : faces) {
    expect_uv(box_coordinates(cube, face.top_left, face.normal), 0, 1);
    expect_uv(box_coordinates(cube, face.top_right, face.normal), 1, 1);
    expect_uv(box_coordinates(cube, face.origin, face.normal), 0, 0);
    EXPECT_EQ(box_coordinates(cube, face.origin, face.normal).tangent, 0.5f * (face.top_right - face.top_left));
  }
}

// Coordinates u = 2 x + 1, v = 3 y - x over a triangle in the plane z = 4: everywhere as the formula, and along the tangent
// u alone grows.
TEST(SurfaceCoordinates, OfATriangle) {
  const auto formula = [](Vec3 p) { return Vec2{2 * p.x + 1, 3 * p.y - p.x}; };
  for (const float mirror : {1.0f, -1.0f}) {
    const Vec3 corners[3] = {{0, 0, 4}, {2 * mirror, 0.5f, 4}, {0.25f, 1, 4}};
    const Vec2 uv[3] = {formula(corners[0]), formula(corners[1]), formula(corners[2])};
    const SurfaceCoordinates c = triangle_coordinates(corners, uv, 0.25f, 0.5f);
    const Vec2 expected = formula(0.25f * corners[0] + 0.25f * corners[1] + 0.5f * corners[2]);
    expect_uv(c, expected.x, expected.y);
    const Vec2 before = formula({0, 0, 4}), after = formula(c.tangent);
    EXPECT_GT(after.x, before.x);
    EXPECT_NEAR(after.y, before.y, 1e-6);
    EXPECT_EQ(c.tangent.z, 0);
  }
  const Vec3 corners[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const Vec2 line[3] = {{0, 0}, {1, 1}, {2, 2}};
  EXPECT_EQ(triangle_coordinates(corners, line, 0.3f, 0.3f).tangent, (Vec3{}));
}

}  // namespace
}  // namespace embrun

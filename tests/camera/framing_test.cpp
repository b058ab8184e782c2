#include "camera/framing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"

namespace embrun {
namespace {

struct Extent {
  double left = 1e9, right = -1e9, bottom = 1e9, top = -1e9;  // of the image: -1 to 1 each way
};

/// Where the box's corners fall in the picture; fails when one is behind the camera.
Extent project(const CameraSettings& settings, Vec3d low, Vec3d high, double aspect) {
  const Vec3d forward = normalize(settings.target - settings.eye);
  const Vec3d right = normalize(cross(forward, settings.up));
  const Vec3d up = cross(right, forward);
  const double t = std::tan(settings.vertical_fov * M_PI / 360);
  Extent e;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p{corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y, corner & 4 ? high.z : low.z};
    const Vec3d d = p - settings.eye;
    EXPECT_GT(dot(d, forward), 0);
    const double x = dot(d, right) / dot(d, forward) / (t * aspect), y = dot(d, up) / dot(d, forward) / t;
    e.left = std::fmin(e.left, x), e.right = std::fmax(e.right, x);
    e.bottom = std::fmin(e.bottom, y), e.top = std::fmax(e.top, y);
  }
  return e;
}

constexpr View all_views[] = {View::front, View::side, View::top, View::three_quarter};

// Everything is inside, something comes close to the border, and what is left over is the same on both sides of the
// tighter direction.
TEST(Framing, FillsThePicture) {
  const Vec3d boxes[][2] = {
      {{-1, 0, -2}, {3, 2, 2}},           {{0, 0, 0}, {10, 0.1, 0.1}},   {{-5, -5, -5}, {5, -4.9, 5}},
      {{100, 200, 300}, {101, 203, 302}}, {{0, 0, 0}, {0.001, 0.02, 0}}, {{-1, -1, 0}, {1, 1, 0}},
  };
  for (const auto& box : boxes)
    for (const View view : all_views)
      for (const UpAxis up : {UpAxis::y, UpAxis::z})
        for (const double aspect : {16.0 / 9, 1.0, 0.5}) {
          const CameraSettings s = frame_box(box[0], box[1], view, up, aspect);
          const Extent e = project(s, box[0], box[1], aspect);
          const double reach = std::fmax(std::fmax(e.right, -e.left), std::fmax(e.top, -e.bottom));
          EXPECT_GT(reach, 0.8);
          EXPECT_LT(reach, 0.92);
          const double spread_x = e.right - e.left, spread_y = e.top - e.bottom;
          if (spread_x > spread_y)
            EXPECT_NEAR(e.right, -e.left, 1e-6);
          else
            EXPECT_NEAR(e.top, -e.bottom, 1e-6);
          EXPECT_NO_THROW(make_camera(s, 64, 64));
        }
}

TEST(Framing, ViewsLookFromTheirSides) {
  const Vec3d low{-1, -1, -1}, high{1, 1, 1};
  const auto direction = [&](View view, UpAxis up) {
    const CameraSettings s = frame_box(low, high, view, up, 1);
    return to_float(normalize(s.eye - s.target));
  };
  EXPECT_LT(length(direction(View::front, UpAxis::y) - Vec3{0, 0, 1}), 1e-6);
  EXPECT_LT(length(direction(View::front, UpAxis::z) - Vec3{0, -1, 0}), 1e-6);
  EXPECT_LT(length(direction(View::side, UpAxis::y) - Vec3{1, 0, 0}), 1e-6);
  EXPECT_LT(length(direction(View::side, UpAxis::z) - Vec3{1, 0, 0}), 1e-6);
  EXPECT_LT(length(direction(View::top, UpAxis::y) - Vec3{0, 1, 0}), 1e-6);
  EXPECT_LT(length(direction(View::top, UpAxis::z) - Vec3{0, 0, 1}), 1e-6);
  const Vec3 oblique = direction(View::three_quarter, UpAxis::y);
  EXPECT_LT(oblique.x, -0.3f);
  EXPECT_GT(oblique.y, 0.2f);
  EXPECT_GT(oblique.z, 0.5f);
  const Vec3 oblique_z = direction(View::three_quarter, UpAxis::z);
  EXPECT_LT(length(oblique_z - Vec3{oblique.x, -oblique.z, oblique.y}), 1e-6);
}

// Seen from the top, the front of the scene is at the bottom of the picture and right stays right.
TEST(Framing, TopViewHasTheFrontBelow) {
  for (const UpAxis up : {UpAxis::y, UpAxis::z}) {
    const CameraSettings s = frame_box({-1, -1, -1}, {1, 1, 1}, View::top, up, 1);
    const Camera camera = make_camera(s, 8, 8);
    EXPECT_LT(length(camera.right - up_basis(up).right), 1e-6);
    EXPECT_LT(length(camera.up + up_basis(up).back), 1e-6);
  }
}

TEST(Framing, ASinglePointGetsTheMinimumSize) {
  const CameraSettings s = frame_box({1, 2, 3}, {1, 2, 3}, View::three_quarter, UpAxis::y, 1.5, 35, 0.1);
  const double distance = length(s.eye - s.target);
  EXPECT_GT(distance, 0.1);
  EXPECT_LT(distance, 1);
  EXPECT_NO_THROW(make_camera(s, 10, 10));
}

TEST(Framing, FarFromTheOriginNothingIsLost) {
  const CameraSettings s = frame_box({1e6, 1e6, 1e6}, {1e6 + 0.01, 1e6 + 0.01, 1e6 + 0.01}, View::front, UpAxis::y, 1);
  const Extent e = project(s, {1e6, 1e6, 1e6}, {1e6 + 0.01, 1e6 + 0.01, 1e6 + 0.01}, 1);
  EXPECT_NEAR(e.right, 0.86, 1e-3);
}

TEST(Framing, ParsesNames) {
  EXPECT_EQ(parse_view("front"), View::front);
  EXPECT_EQ(parse_view("side"), View::side);
  EXPECT_EQ(parse_view("top"), View::top);
  EXPECT_EQ(parse_view("three-quarter"), View::three_quarter);
  EXPECT_THROW(parse_view("back"), Error);
}

}  // namespace
}  // namespace embrun

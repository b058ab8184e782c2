#include "camera/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/error.h"

namespace embrun {
namespace {

constexpr CameraSample middle{{0.5f, 0.5f}, {0.5f, 0.5f}, 0};

CameraSettings looking_down_z() {
  CameraSettings s;
  s.eye = {0, 0, 5};
  s.target = {0, 0, 0};
  s.vertical_fov = 90;
  return s;
}

// Vertical field of view 90 degrees: the image plane at distance 1 spans -1 to 1 upwards; with 4 x 2 pixels, each of
// size 1, pixel centres are at x = -1.5 .. 1.5 and y = 0.5, -0.5.
TEST(Camera, PixelCentresByHand) {
  const Camera camera = make_camera(looking_down_z(), 4, 2);
  const auto expect = [&](int x, int y, Vec3 direction) {
    const Ray ray = camera_ray(camera, x, y, middle);
    EXPECT_EQ(ray.origin, (Vec3{0, 0, 5}));
    EXPECT_LT(length(ray.direction - normalize(direction)), 1e-6) << x << " " << y;
  };
  expect(0, 0, {-1.5f, 0.5f, -1});  // upper left
  expect(3, 0, {1.5f, 0.5f, -1});
  expect(0, 1, {-1.5f, -0.5f, -1});
  expect(2, 1, {0.5f, -0.5f, -1});
}

// The field of view is vertical: the middles of the top and bottom edges are 39 degrees apart, whatever the width.
TEST(Camera, FieldOfViewIsVertical) {
  CameraSettings s;
  s.eye = {1, 2, 3};
  s.target = {4, 3, 1};
  s.vertical_fov = 39;
  for (const int width : {16, 512, 2000}) {
    const Camera camera = make_camera(s, width, 512);
    const Vec3 top = normalize(image_plane_direction(camera, 0.5f * static_cast<float>(width), 0));
    const Vec3 bottom = normalize(image_plane_direction(camera, 0.5f * static_cast<float>(width), 512));
    EXPECT_NEAR(std::acos(dot(top, bottom)) * 180 / M_PI, 39, 1e-3);
    EXPECT_GT(top.y, bottom.y);
  }
}

// The image's right is cross(target - eye, up): a point to that side lands right of the middle. Eye, target and up of
// the reference scene drop_small; the target projects to the middle of the image.
TEST(Camera, ReferenceCamera) {
  CameraSettings s;
  s.eye = {1.7, 1.7, 3.1};
  s.target = {-0.06, 0.62, 0.25};
  s.vertical_fov = 40;
  const Camera camera = make_camera(s, 512, 512);
  const Vec3 centre = normalize(image_plane_direction(camera, 256, 256));
  EXPECT_LT(length(centre - to_float(normalize(s.target - s.eye))), 1e-6);
  // By hand: forward = (-1.76, -1.08, -2.85) / 3.519730; right = forward x up = (2.85, 0, -1.76) / 3.349642.
  EXPECT_NEAR(camera.right.x, 2.85 / std::sqrt(2.85 * 2.85 + 1.76 * 1.76), 1e-6);
  EXPECT_NEAR(camera.right.y, 0, 1e-6);
  EXPECT_NEAR(camera.right.z, -1.76 / std::sqrt(2.85 * 2.85 + 1.76 * 1.76), 1e-6);
  EXPECT_NEAR(dot(camera.up, camera.forward), 0, 1e-6);
  EXPECT_GT(camera.up.y, 0.9f);
}

TEST(Camera, RecentresInDouble) {
  CameraSettings s = looking_down_z();
  s.eye = {1e6, 2e6, 1e6 + 0.125};
  s.target = {1e6, 2e6, 1e6};
  const Camera camera = make_camera(s, 4, 4, {1e6, 2e6, 1e6});
  EXPECT_EQ(camera.eye, (Vec3{0, 0, 0.125f}));
  EXPECT_EQ(camera.forward, (Vec3{0, 0, -1}));
}

TEST(Camera, PinholeRaysStartAtTheEyeAndFillThePixel) {
  const Camera camera = make_camera(looking_down_z(), 4, 2);
  const float largest = 1 - 0x1p-24f;
  const Ray low = camera_ray(camera, 1, 0, {{0, 0}, {0.9f, 0.1f}, 0});
  const Ray high = camera_ray(camera, 1, 0, {{largest, largest}, {0.1f, 0.9f}, 0});
  EXPECT_LT(length(low.direction - normalize(Vec3{-1, 1, -1})), 1e-6);
  EXPECT_LT(length(high.direction - normalize(Vec3{0, 0, -1})), 1e-6);
  EXPECT_EQ(low.origin, high.origin);
}

// A thin lens: from wherever on the lens, rays of one film place meet on the plane in focus; they start within the
// radius.
TEST(Camera, LensFocuses) {
  CameraSettings s = looking_down_z();
  s.lens_radius = 0.1;
  s.focus_distance = 3;
  const Camera camera = make_camera(s, 5, 5);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform;
  Vec3 focus;
  float farthest = 0;
  for (int i = 0; i < 200; ++i) {
    const Ray ray = camera_ray(camera, 4, 1, {{0.25f, 0.75f}, {uniform(random), uniform(random)}, 0});
    const Vec3 p = ray.at(3 / -ray.direction.z);  // on the plane z = 2
    if (i == 0) focus = p;
    EXPECT_NEAR(p.z, 2, 1e-5);
    EXPECT_LT(length(p - focus), 1e-5);
    farthest = max_of(farthest, length(ray.origin - camera.eye));
  }
  EXPECT_LE(farthest, 0.1f + 1e-6f);
  EXPECT_GT(farthest, 0.09f);
}

TEST(Camera, FocusIsAtTheTargetUnlessToldOtherwise) {
  EXPECT_EQ(make_camera(looking_down_z(), 4, 4).focus_distance, 5);
}

TEST(Camera, TimeAndFootprint) {
  CameraSettings s = looking_down_z();
  s.shutter_open = 1;
  s.shutter_close = 3;
  const Camera camera = make_camera(s, 8, 100);
  EXPECT_EQ(camera_ray(camera, 0, 0, {{}, {}, 0.25f}).time, 1.5f);
  const Ray ray = camera_ray(camera, 4, 50, middle);
  EXPECT_EQ(ray.cone_width, 0);
  // In the middle of the image, neighbouring pixels are 2 tan(45 deg)/100 = 0.02 apart at distance 1.
  EXPECT_NEAR(ray.cone_spread, 0.02, 1e-7);
}

TEST(Camera, RefusesWhatMakesNoSense) {
  const auto refuses = [](auto change) {
    CameraSettings s = looking_down_z();
    change(s);
    EXPECT_THROW(make_camera(s, 4, 4), Error);
  };
  refuses([](CameraSettings& s) { s.target = s.eye; });
  refuses([](CameraSettings& s) { s.up = {0, 0, 2}; });
  refuses([](CameraSettings& s) { s.up = {}; });
  refuses([](CameraSettings& s) { s.vertical_fov = 0; });
  refuses([](CameraSettings& s) { s.vertical_fov = 180; });
  refuses([](CameraSettings& s) { s.vertical_fov = std::nan(""); });
  refuses([](CameraSettings& s) { s.eye.x = std::nan(""); });
  refuses([](CameraSettings& s) { s.lens_radius = -1; });
  refuses([](CameraSettings& s) { s.shutter_open = 1; });
  EXPECT_THROW(make_camera(looking_down_z(), 0, 4), Error);
}

}  // namespace
}  // namespace embrun

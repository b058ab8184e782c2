// Shapes of the scene that are neither fluids nor meshes, through the compiled scene.

#include <gtest/gtest.h>

#include "backend/cpu/cpu_backend.h"
#include "scene/compile.h"

namespace embrun {
namespace {

struct Answer {
  bool found = false;
  SceneHit hit;
  Vec3 normal;
};

Answer trace(const SceneDescription& scene, Vec3d origin, Vec3d direction, float t_min = 0) {
  const FlatScene flat = compile(scene);
  const CpuBackend backend(flat);
  Ray ray;
  ray.origin = to_float(origin - flat.recentring);
  ray.direction = to_float(normalize(direction));
  ray.t_min = t_min;
  const MediaState media;
  Answer answer;
  backend.kernels().intersect(backend.view(), &ray, &media, 1, &answer.found, &answer.hit);
  return answer;
}

SceneDescription tube() {
  SceneDescription scene;
  CylinderDescription cylinder;
  cylinder.start = {10, 0, 0};
  cylinder.end = {10, 0, 4};
  cylinder.radius = 0.5;
  scene.cylinders.push_back(cylinder);
  return scene;
}

TEST(Cylinders, AreMetFromOutsideAndInside) {
  const Answer outside = trace(tube(), {6, 0.3, 1}, {1, 0, 0});
  ASSERT_TRUE(outside.found);
  // 0.3 off the axis: half a chord of sqrt(0.25 - 0.09) = 0.4.
  EXPECT_NEAR(outside.hit.surface.t, 3.6, 1e-5);
  EXPECT_LT(length(outside.hit.surface.geometric_normal - Vec3{-0.8f, 0.6f, 0}), 1e-5f);
  EXPECT_TRUE(outside.hit.surface.entering);
  const Answer behind = trace(tube(), {6, 0.3, 1}, {1, 0, 0}, 3.7f);
  ASSERT_TRUE(behind.found);
  EXPECT_NEAR(behind.hit.surface.t, 4.4, 1e-5);
  EXPECT_FALSE(behind.hit.surface.entering);
  const Answer inside = trace(tube(), {10, 0, 1}, {0, -1, 0});
  ASSERT_TRUE(inside.found);
  EXPECT_NEAR(inside.hit.surface.t, 0.5, 1e-6);
  EXPECT_FALSE(inside.hit.surface.entering);
}

TEST(Cylinders, HaveNoEnds) {
  EXPECT_FALSE(trace(tube(), {10, 0, -1}, {0, 0, 1}).found);
  EXPECT_FALSE(trace(tube(), {6, 0, -0.1}, {1, 0, 0}).found);
  EXPECT_FALSE(trace(tube(), {6, 0, 4.1}, {1, 0, 0}).found);
  EXPECT_FALSE(trace(tube(), {6, 0.51, 1}, {1, 0, 0}).found);
  // In by the open end, and out through the side: it rises 1 in 2, and the side is 0.5 away after 1.
  const Answer answer = trace(tube(), {10, 0, -0.5}, {0, 1, 2});
  ASSERT_TRUE(answer.found);
  EXPECT_NEAR(answer.hit.surface.t, std::sqrt(0.25 + 1), 1e-5);
}

TEST(Patches, MayBeRound) {
  SceneDescription scene;
  PatchDescription disk;
  disk.axis_u = {1, 0, 0};
  disk.axis_v = {0, 1, 0};
  disk.half_u = 2;
  disk.round = true;
  scene.patches.push_back(disk);
  // (x / 2)^2 + y^2 < 1
  EXPECT_TRUE(trace(scene, {1.7, 0.5, 1}, {0, 0, -1}).found);
  EXPECT_FALSE(trace(scene, {1.75, 0.5, 1}, {0, 0, -1}).found);
  EXPECT_TRUE(trace(scene, {-1.9, 0, 1}, {0, 0, -1}).found);
  EXPECT_FALSE(trace(scene, {1.5, 0.9, 1}, {0, 0, -1}).found);
}

}  // namespace
}  // namespace embrun

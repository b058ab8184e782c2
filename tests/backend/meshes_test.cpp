#include <gtest/gtest.h>

#include "backend/cpu/cpu_backend.h"
#include "scene/compile.h"

namespace embrun {
namespace {

/// A square in the plane z = 0 of its own space, of two triangles, facing +z.
MeshDescription square() {
  MeshDescription description;
  description.mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  description.mesh.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  return description;
}

struct Answer {
  bool found = false;
  SceneHit hit;
};

/// One ray in world coordinates.
Answer trace(const SceneDescription& scene, Vec3d origin, Vec3d direction) {
  const FlatScene flat = compile(scene);
  const CpuBackend backend(flat);
  Ray ray;
  ray.origin = to_float(origin - flat.recentring);
  ray.direction = to_float(normalize(direction));
  const MediaState media;
  Answer answer;
  backend.kernels().intersect(backend.view(), &ray, &media, 1, &answer.found, &answer.hit);
  answer.hit.surface.position += to_float(flat.recentring);
  return answer;
}

TEST(Meshes, AreMetWhereTheyAre) {
  SceneDescription scene;
  scene.meshes.push_back(square());
  const Answer front = trace(scene, {0.3, -0.2, 4}, {0, 0, -1});
  ASSERT_TRUE(front.found);
  EXPECT_NEAR(front.hit.surface.t, 4, 1e-5);
  EXPECT_TRUE(front.hit.surface.entering);
  EXPECT_NEAR(front.hit.surface.geometric_normal.z, 1, 1e-6);
  EXPECT_NEAR(front.hit.surface.position.x, 0.3, 1e-6);
  const Answer back = trace(scene, {0.3, -0.2, -4}, {0, 0, 1});
  ASSERT_TRUE(back.found);
  EXPECT_FALSE(back.hit.surface.entering);
  EXPECT_NEAR(back.hit.surface.geometric_normal.z, 1, 1e-6);
  EXPECT_FALSE(trace(scene, {1.3, -0.2, 4}, {0, 0, -1}).found);
}

// Scaled by (2, 1, 3) after a quarter turn about y that takes z to x, and moved: normals go with the inverse transpose.
TEST(Meshes, ArePlaced) {
  SceneDescription scene;
  MeshDescription mesh = square();
  mesh.placement = {{0, 0, -3}, {0, 1, 0}, {2, 0, 0}, {10, 20, 30}};
  mesh.mesh.normals.assign(4, normalize(Vec3{1, 0, 1}));
  scene.meshes.push_back(mesh);
  const Answer answer = trace(scene, {15, 20.5, 31}, {-1, 0, 0});
  ASSERT_TRUE(answer.found);
  EXPECT_NEAR(answer.hit.surface.t, 5, 1e-5);
  EXPECT_NEAR(answer.hit.surface.geometric_normal.x, 1, 1e-6);
  // Own (1, 0, 1)/sqrt 2 becomes (1/2, 0, -1/3), normalised.
  const Vec3 expected = normalize(Vec3{0.5f, 0, -1.0f / 3});
  EXPECT_LT(length(answer.hit.surface.shading_normal - expected), 1e-5f);
}

TEST(Meshes, InterpolateTheirNormals) {
  SceneDescription scene;
  MeshDescription mesh = square();
  mesh.mesh.normals = {normalize(Vec3{-1, 0, 2}), normalize(Vec3{1, 0, 2}), normalize(Vec3{1, 0, 2}),
                       normalize(Vec3{-1, 0, 2})};
  scene.meshes.push_back(mesh);
  for (const float x : {-0.8f, 0.0f, 0.4f}) {
    const Answer answer = trace(scene, {x, 0.1, 3}, {0, 0, -1});
    ASSERT_TRUE(answer.found);
    const Vec3 expected = normalize(Vec3{x, 0, 2});
    EXPECT_LT(length(answer.hit.surface.shading_normal - expected), 1e-5f) << x;
    EXPECT_NEAR(answer.hit.surface.geometric_normal.z, 1, 1e-6);
  }
}

// Two meshes and their places in the list of instances are not mixed up, with other things between.
TEST(Meshes, KeepTheirMaterials) {
  SceneDescription scene;
  scene.balls.push_back({{{{0, 0, -9}, 0.5}}, diffuse_material(grey(0.1f))});
  scene.meshes.push_back(square());
  scene.meshes.push_back(square());
  scene.meshes[0].material = diffuse_material(grey(0.2f));
  scene.meshes[1].material = diffuse_material(grey(0.3f));
  scene.meshes[1].placement.origin = {0, 0, 2};
  const FlatScene flat = compile(scene);
  const auto reflectance = [&](const Answer& a) { return flat.materials[a.hit.material].reflectance.first.r; };
  EXPECT_EQ(reflectance(trace(scene, {0.1, 0.2, 5}, {0, 0, -1})), 0.3f);
  EXPECT_EQ(reflectance(trace(scene, {0.1, 0.2, 1}, {0, 0, -1})), 0.2f);
  EXPECT_EQ(reflectance(trace(scene, {0.1, 0.2, -1}, {0, 0, -1})), 0.1f);
}

// One mesh in two places: met in both, in the second turned by a half about y and twice as large, and stored once.
TEST(Meshes, StandInSeveralPlaces) {
  SceneDescription scene;
  scene.meshes.push_back(square());
  scene.meshes[0].copies = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -3}},
                            {{-2, 0, 0}, {0, 2, 0}, {0, 0, -2}, {10, 0, 4}}};
  const Answer first = trace(scene, {0.5, 0.5, 0}, {0, 0, -1});
  ASSERT_TRUE(first.found);
  EXPECT_NEAR(first.hit.surface.t, 3, 1e-5);
  EXPECT_NEAR(first.hit.surface.geometric_normal.z, 1, 1e-6);
  const Answer second = trace(scene, {11.5, 1.5, 0}, {0, 0, 1});
  ASSERT_TRUE(second.found);
  EXPECT_NEAR(second.hit.surface.t, 4, 1e-5);
  EXPECT_NEAR(second.hit.surface.geometric_normal.z, -1, 1e-6);
  EXPECT_FALSE(trace(scene, {3, 1.5, 0}, {0, 0, 1}).found);
  const FlatScene flat = compile(scene);
  EXPECT_EQ(flat.instances.size(), 2u);
  EXPECT_EQ(flat.mesh_positions.size(), 4u);
}

}  // namespace
}  // namespace embrun

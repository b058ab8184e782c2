#include "backend/cpu/embree_scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/error.h"

namespace embrun {
namespace {

void check(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE) throw Error("Embree failed to take the scene (error " + std::to_string(error) + ")");
}

RTCScene make_mesh_scene(RTCDevice device, const FlatScene& scene, const MeshRange& range) {
  RTCScene own = rtcNewScene(device);
  rtcSetSceneFlags(own, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(own, RTC_BUILD_QUALITY_HIGH);
  if (range.triangle_count == 0) {
    rtcCommitScene(own);
    return own;
  }
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);

  auto* positions = static_cast<Vec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               sizeof(Vec3), range.position_count));
  auto* triangles = static_cast<MeshTriangle*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(MeshTriangle), range.triangle_count));
  check(device);
  for (std::uint32_t i = 0; i < range.position_count; ++i)
    positions[i] = scene.mesh_positions[range.first_position + i];
  for (std::uint32_t i = 0; i < range.triangle_count; ++i) {
    const MeshTriangle& t = scene.mesh_triangles[range.first_triangle + i];
    triangles[i] = {t.a - range.first_position, t.b - range.first_position, t.c - range.first_position};
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(own, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(own);
  return own;
}

/// Embree's call for the bounds of a block.
void block_bounds(const RTCBoundsFunctionArguments* arguments) {
  const BallSet& set = static_cast<const CpuBallSet*>(arguments->geometryUserPtr)->set;
  const BallBlock& block = set.blocks[arguments->primID];
  // Wider by what makes a start outside a ball count as touching it.
  Ray corner;
  corner.origin = {std::fabs(block.x[0]), std::fabs(block.y[0]), std::fabs(block.z[0])};
  const Box3 bounds = bounds_of(block, 2 * ball_tolerance(corner, 0, set.slack));
  *arguments->bounds_o = {bounds.low.x, bounds.low.y, bounds.low.z, 0, bounds.high.x, bounds.high.y, bounds.high.z, 0};
}

RTCScene make_ball_scene(RTCDevice device, CpuBallSet& balls, const KernelTable& kernels) {
  RTCScene own = rtcNewScene(device);
  rtcSetSceneFlags(own, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, balls.set.count);
  rtcSetGeometryUserData(geometry, &balls);
  rtcSetGeometryBoundsFunction(geometry, block_bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, kernels.meet_balls);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(own, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(own);
  return own;
}

void attach_instance(RTCDevice device, RTCScene top, RTCScene mesh, const Transform& to_world, unsigned id) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, mesh);
  const Transform& m = to_world;
  const float columns[12] = {m.x_axis.x, m.x_axis.y, m.x_axis.z, m.y_axis.x, m.y_axis.y, m.y_axis.z,
                             m.z_axis.x, m.z_axis.y, m.z_axis.z, m.origin.x, m.origin.y, m.origin.z};
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(top, geometry, id);
  rtcReleaseGeometry(geometry);
}

}  // namespace

EmbreeScene::EmbreeScene(const FlatScene& scene, const KernelTable& kernels) {
  if (scene.meshes.empty() && scene.ball_ranges.empty()) return;
  device_ = rtcNewDevice(nullptr);
  if (device_ == nullptr) throw Error("Embree does not start on this machine");
  std::vector<RTCScene> meshes;
  for (const MeshRange& range : scene.meshes) meshes.push_back(make_mesh_scene(device_, scene, range));
  for (const FluidGeometry& fluid : scene.fluids) {
    fluid_meshes_.push_back(fluid.mesh < 0 ? nullptr : meshes[static_cast<std::size_t>(fluid.mesh)]);
    if (fluid_meshes_.back() != nullptr) rtcRetainScene(fluid_meshes_.back());
  }
  ball_sets_.resize(scene.ball_ranges.size());
  const auto in_top = [](const Instance& i) { return i.kind == GeometryKind::mesh || i.kind == GeometryKind::balls; };
  if (std::any_of(scene.instances.begin(), scene.instances.end(), in_top)) build_top(scene, meshes, kernels);
  for (RTCScene mesh : meshes) rtcReleaseScene(mesh);
  check(device_);
}

void EmbreeScene::build_top(const FlatScene& scene, const std::vector<RTCSceneTy*>& meshes,
                            const KernelTable& kernels) {
  top_ = rtcNewScene(device_);
  rtcSetSceneFlags(top_, RTC_SCENE_FLAG_ROBUST);
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const auto id = static_cast<unsigned>(i);
    if (instance.kind == GeometryKind::mesh)
      attach_instance(device_, top_, meshes[instance.geometry], instance.to_world, id);
    if (instance.kind != GeometryKind::balls) continue;
    const BallRange& range = scene.ball_ranges[instance.geometry];
    CpuBallSet& balls = ball_sets_[instance.geometry];
    balls.set = {scene.ball_blocks.data() + range.first, range.count, range.slack, instance.solid >= 0};
    balls.step = range.step;
    balls.instance = static_cast<int>(i);
    balls.solid = instance.solid;
    balls.scene = make_ball_scene(device_, balls, kernels);
    attach_instance(device_, top_, balls.scene, Transform{}, id);
  }
  rtcCommitScene(top_);
}

EmbreeScene::~EmbreeScene() {
  for (const CpuBallSet& balls : ball_sets_)
    if (balls.scene != nullptr) rtcReleaseScene(balls.scene);
  for (RTCScene mesh : fluid_meshes_)
    if (mesh != nullptr) rtcReleaseScene(mesh);
  if (top_ != nullptr) rtcReleaseScene(top_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

}  // namespace embrun

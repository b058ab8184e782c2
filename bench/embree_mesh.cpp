#include "embree_mesh.h"

#include <utility>

#include "base/error.h"

namespace embrun::bench {

bool EmbreeMesh::count_memory(void* counter, ssize_t bytes, bool) {
  *static_cast<std::size_t*>(counter) += static_cast<std::size_t>(bytes);
  return true;
}

EmbreeMesh::EmbreeMesh(TriangleMesh mesh) : mesh_(std::move(mesh)), device_(rtcNewDevice("threads=1")) {
  EMBRUN_CHECK(device_ != nullptr);
  rtcSetDeviceMemoryMonitorFunction(device_, count_memory, &embree_bytes_);
  scene_ = rtcNewScene(device_);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
  // Embree may read four bytes past the last vertex.
  mesh_.positions.reserve(mesh_.positions.size() + 1);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh_.positions.data(), 0,
                             sizeof(Vec3), mesh_.positions.size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh_.triangles.data(), 0,
                             sizeof(mesh_.triangles[0]), mesh_.triangles.size());
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  EMBRUN_CHECK(rtcGetDeviceError(device_) == RTC_ERROR_NONE);
}

EmbreeMesh::~EmbreeMesh() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

bool EmbreeMesh::intersect(const Ray& ray, float t_min, SurfaceHit& hit) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query;
  query.ray.org_x = ray.origin.x;
  query.ray.org_y = ray.origin.y;
  query.ray.org_z = ray.origin.z;
  query.ray.dir_x = ray.direction.x;
  query.ray.dir_y = ray.direction.y;
  query.ray.dir_z = ray.direction.z;
  query.ray.tnear = t_min;
  query.ray.tfar = ray.t_max;
  query.ray.time = 0;
  query.ray.mask = 0xffffffffu;
  query.ray.flags = 0;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  const auto& corners = mesh_.triangles[query.hit.primID];
  hit.t = query.ray.tfar;
  hit.shading_normal = normalize(mesh_.normals[corners[0]] * (1.0f - query.hit.u - query.hit.v) +
                                 mesh_.normals[corners[1]] * query.hit.u + mesh_.normals[corners[2]] * query.hit.v);
  return true;
}

std::size_t EmbreeMesh::bytes() const {
  return embree_bytes_ + mesh_.positions.size() * 2 * sizeof(Vec3) +
         mesh_.triangles.size() * sizeof(mesh_.triangles[0]);
}

}  // namespace embrun::bench

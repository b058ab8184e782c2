#include "backend/cpu/embree_mesh.h"

#include <array>
#include <utility>

#include "base/error.h"

namespace embrun {

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

namespace {

RTCRayHit query_of(const Ray& ray, float t_min) {
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
  return query;
}

/// Sixteen queries side by side.
void set_lane(RTCRayHit16& packet, int lane, const RTCRayHit& query) {
  packet.ray.org_x[lane] = query.ray.org_x;
  packet.ray.org_y[lane] = query.ray.org_y;
  packet.ray.org_z[lane] = query.ray.org_z;
  packet.ray.dir_x[lane] = query.ray.dir_x;
  packet.ray.dir_y[lane] = query.ray.dir_y;
  packet.ray.dir_z[lane] = query.ray.dir_z;
  packet.ray.tnear[lane] = query.ray.tnear;
  packet.ray.tfar[lane] = query.ray.tfar;
  packet.ray.time[lane] = 0;
  packet.ray.mask[lane] = query.ray.mask;
  packet.ray.flags[lane] = 0;
  packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
  packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
}
RTCRayHit lane_of(const RTCRayHit16& packet, int lane) {
  RTCRayHit query;
  query.ray.tfar = packet.ray.tfar[lane];
  query.hit.u = packet.hit.u[lane];
  query.hit.v = packet.hit.v[lane];
  query.hit.primID = packet.hit.primID[lane];
  query.hit.geomID = packet.hit.geomID[lane];
  return query;
}

}  // namespace

const char* name_of(EmbreeMode mode) {
  switch (mode) {
    case EmbreeMode::single: return "rtcIntersect1";
    case EmbreeMode::packets: return "rtcIntersect16";
    case EmbreeMode::stream: return "rtcIntersect1M";
  }
  return "";
}

bool EmbreeMesh::take(const RTCRayHit& query, SurfaceHit& hit) const {
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  const auto& corners = mesh_.triangles[query.hit.primID];
  hit.t = query.ray.tfar;
  hit.shading_normal = normalize(mesh_.normals[corners[0]] * (1.0f - query.hit.u - query.hit.v) +
                                 mesh_.normals[corners[1]] * query.hit.u + mesh_.normals[corners[2]] * query.hit.v);
  return true;
}

bool EmbreeMesh::intersect(const Ray& ray, float t_min, SurfaceHit& hit) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query = query_of(ray, t_min);
  rtcIntersect1(scene_, &context, &query);
  return take(query, hit);
}

void EmbreeMesh::intersect(EmbreeMode mode, const SidedRay* rays, int count, float surface_start, SurfaceHit* hits,
                           bool* found) const {
  EMBRUN_CHECK(count <= max_rays);
  const auto start_of = [&](int i) { return rays[i].side == Side::unknown ? 0.0f : surface_start; };
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (mode == EmbreeMode::single) {
    for (int i = 0; i < count; ++i) found[i] = intersect(rays[i].ray, start_of(i), hits[i]);
  } else if (mode == EmbreeMode::packets) {
    for (int first = 0; first < count; first += 16) {
      alignas(64) RTCRayHit16 packet;
      alignas(64) int valid[16];
      for (int lane = 0; lane < 16; ++lane) {
        valid[lane] = first + lane < count ? -1 : 0;
        const int i = first + lane < count ? first + lane : first;
        set_lane(packet, lane, query_of(rays[i].ray, start_of(i)));
      }
      rtcIntersect16(valid, scene_, &context, &packet);
      for (int lane = 0; lane < 16 && first + lane < count; ++lane)
        found[first + lane] = take(lane_of(packet, lane), hits[first + lane]);
    }
  } else {
    std::array<RTCRayHit, max_rays> queries;
    for (int i = 0; i < count; ++i) queries[static_cast<std::size_t>(i)] = query_of(rays[i].ray, start_of(i));
    rtcIntersect1M(scene_, &context, queries.data(), static_cast<unsigned>(count), sizeof(RTCRayHit));
    for (int i = 0; i < count; ++i) found[i] = take(queries[static_cast<std::size_t>(i)], hits[i]);
  }
}

std::size_t EmbreeMesh::bytes() const {
  return embree_bytes_ + mesh_.positions.size() * 2 * sizeof(Vec3) +
         mesh_.triangles.size() * sizeof(mesh_.triangles[0]);
}

}  // namespace embrun

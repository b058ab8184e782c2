#include "backend/cpu/embree_discs.h"

#include <embree3/rtcore.h>

#include <string>

#include "base/error.h"

namespace embrun {

EmbreeDiscs::EmbreeDiscs(const PackedSplats& packed) {
  device_ = rtcNewDevice(nullptr);
  if (device_ == nullptr) throw Error("Embree does not start on this machine");
  scene_ = rtcNewScene(device_);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
  struct CenterAndRadius {
    Vec3 center;
    float radius;
  };
  const std::size_t count = packed.splats.size();
  auto* discs = static_cast<CenterAndRadius*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, sizeof(CenterAndRadius), count));
  auto* normals = static_cast<Vec3*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3), count));
  if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE)
    throw Error("Embree failed to take the splats (error " + std::to_string(error) + ")");
  for (std::size_t i = 0; i < count; ++i) {
    discs[i] = {packed.splats[i].center, packed.splats[i].radius};
    normals[i] = packed.splats[i].normal;
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
}

EmbreeDiscs::~EmbreeDiscs() {
  if (scene_ != nullptr) rtcReleaseScene(scene_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

}  // namespace embrun

#pragma once

#include "scene/flat_scene.h"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace embrun {

/// The triangle meshes of a compiled scene in Embree: one scene per mesh, and a top one of instances whose ids are
/// indices of FlatScene::instances.
class EmbreeMeshes {
 public:
  /// The scene must outlive this object. Throws Error when Embree fails (out of memory).
  explicit EmbreeMeshes(const FlatScene& scene);
  ~EmbreeMeshes();
  EmbreeMeshes(const EmbreeMeshes&) = delete;
  EmbreeMeshes& operator=(const EmbreeMeshes&) = delete;

  /// Null when there is no mesh.
  RTCSceneTy* scene() const { return top_; }

 private:
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* top_ = nullptr;
};

}  // namespace embrun

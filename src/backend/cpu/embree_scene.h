#pragma once

#include <vector>

#include "backend/cpu/cpu_scene.h"
#include "backend/cpu/kernel_table.h"

struct RTCDeviceTy;

namespace embrun {

/// The triangle meshes and the balls of a compiled scene in Embree: one scene per mesh and per set of balls, and a top
/// one of instances whose ids are indices of FlatScene::instances. Meshes of fluids are not in that one.
class EmbreeScene {
 public:
  /// The scene must outlive this object. Throws Error when Embree fails (out of memory).
  EmbreeScene(const FlatScene& scene, const KernelTable& kernels);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  /// Null when there is neither.
  RTCSceneTy* top() const { return top_; }
  /// One entry a fluid, null when it is no mesh.
  const std::vector<RTCSceneTy*>& fluid_meshes() const { return fluid_meshes_; }
  const std::vector<CpuBallSet>& ball_sets() const { return ball_sets_; }

 private:
  void build_top(const FlatScene& scene, const std::vector<RTCSceneTy*>& meshes, const KernelTable& kernels);

  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* top_ = nullptr;
  std::vector<RTCSceneTy*> fluid_meshes_;
  std::vector<CpuBallSet> ball_sets_;  ///< Embree holds their addresses
};

}  // namespace embrun

#pragma once

#include "scene/flat_scene.h"

struct RTCSceneTy;

namespace embrun {

/// A compiled scene as the CPU's rays see it: the flat arrays, and Embree's scene of the triangle meshes, whose geometry
/// ids are indices of instances (null when there is no mesh).
struct CpuSceneView {
  SceneView flat;
  RTCSceneTy* meshes = nullptr;
};

}  // namespace embrun

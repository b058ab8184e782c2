#pragma once

#include "geometry/ball_set.h"
#include "scene/flat_scene.h"

struct RTCSceneTy;

namespace embrun {

/// A set of balls in Embree.
struct CpuBallSet {
  BallSet set;
  RTCSceneTy* scene = nullptr;  ///< one primitive per block
  float step = 0;               ///< metres ahead worth looking for the way out of the solid at a time
  int instance = 0;             ///< its index in the flat scene
  int solid = -1;               ///< its number in MediaState, or -1
};

/// A compiled scene as the CPU's rays see it: the flat arrays, and Embree's scene of the triangle meshes and balls, whose
/// instance ids are indices of instances (null when there is neither).
struct CpuSceneView {
  SceneView flat;
  RTCSceneTy* const* fluid_meshes = nullptr;  ///< by Instance::geometry of fluids; null for those that are no mesh
  RTCSceneTy* top = nullptr;
  const CpuBallSet* ball_sets = nullptr;  ///< by Instance::geometry
  int ball_set_count = 0;
  bool has_meshes = false;  ///< besides those of fluids
};

}  // namespace embrun

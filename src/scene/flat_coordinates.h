#pragma once

#include "geometry/surface_coordinates.h"
#include "scene/flat_scene.h"

namespace embrun {

EMBRUN_FN SurfaceCoordinates mesh_coordinates(const SceneView& scene, const MeshRange& range, const SurfaceHit& hit) {
  const MeshTriangle& t = scene.mesh_triangles[range.first_triangle + hit.triangle];
  const Vec3 corners[3] = {scene.mesh_positions[t.a], scene.mesh_positions[t.b], scene.mesh_positions[t.c]};
  if (!range.has_coordinates) {
    const Vec2 own[3] = {{0, 0}, {1, 0}, {0, 1}};
    return triangle_coordinates(corners, own, hit.weight_b, hit.weight_c);
  }
  const Vec2 uv[3] = {scene.mesh_coordinates[t.a], scene.mesh_coordinates[t.b], scene.mesh_coordinates[t.c]};
  return triangle_coordinates(corners, uv, hit.weight_b, hit.weight_c);
}

/// The coordinates of a hit on an instance, the tangent in the scene. A fluid's surface and splats have none.
EMBRUN_LOCAL_FN SurfaceCoordinates coordinates_of(const SceneView& scene, const Instance& instance,
                                                  const SurfaceHit& hit) {
  SurfaceCoordinates own;
  switch (instance.kind) {
    case GeometryKind::fluid:
    case GeometryKind::splats: break;
    case GeometryKind::cylinder: return cylinder_coordinates(scene.cylinders[instance.geometry], hit.position);
    case GeometryKind::balls: own = ball_coordinates(instance.to_object.vector(hit.geometric_normal)); break;
    case GeometryKind::box: return box_coordinates(scene.boxes[instance.geometry], hit.position, hit.geometric_normal);
    case GeometryKind::patch: return patch_coordinates(scene.patches[instance.geometry], hit.position);
    case GeometryKind::mesh: own = mesh_coordinates(scene, scene.meshes[instance.geometry], hit); break;
  }
  own.tangent = instance.to_world.vector(own.tangent);
  return own;
}

}  // namespace embrun

#pragma once

#include "backend/cpu/embree_ray.h"
#include "geometry/surface_hit.h"
#include "math/next_float.h"
#include "scene/flat_scene.h"

// Points of triangle meshes, and a mesh that stands for a fluid's surface.

namespace embrun::EMBRUN_ISA_NAMESPACE {

/// A point of a triangle, in the mesh's own space.
struct MeshPoint {
  Vec3 position;
  Vec3 across;  ///< at right angles to the triangle, outwards; not normalised
  Vec3 smooth;  ///< the corners' normals between them, not normalised; 0 where the mesh has none
};

EMBRUN_FN MeshPoint mesh_point(const SceneView& scene, const MeshRange& mesh, std::uint32_t primitive, float u,
                               float v) {
  const MeshTriangle& triangle = scene.mesh_triangles[mesh.first_triangle + primitive];
  const Vec3 a = scene.mesh_positions[triangle.a], ab = scene.mesh_positions[triangle.b] - a,
             ac = scene.mesh_positions[triangle.c] - a;
  MeshPoint point{a + u * ab + v * ac, cross(ab, ac), {}};
  if (mesh.smooth) {
    const Vec3* normals = scene.mesh_normals;
    point.smooth = (1.0f - u - v) * normals[triangle.a] + u * normals[triangle.b] + v * normals[triangle.c];
  }
  return point;
}

/// A mesh's own normals may point either way; sides are those of the triangles.
EMBRUN_FN void set_shading_normal(Vec3 smooth, SurfaceHit& hit) {
  hit.shading_normal = hit.geometric_normal;
  if (length_squared(smooth) > 0.0f)
    hit.shading_normal = normalize(dot(smooth, hit.geometric_normal) < 0.0f ? -smooth : smooth);
}

/// A closed mesh in place of an implicit surface, in the fluid's own space.
struct FluidMesh {
  const SceneView& scene;
  const MeshRange& range;
  RTCSceneTy* embree;

  /// First triangle with t in (t_min, t_max) that leads off the side the ray is on. Those that lead to it are passed
  /// over: rounding has put the start of a ray that leaves the surface behind a triangle next to its own.
  EMBRUN_FN bool intersect(const Ray& ray, Side side, SurfaceHit& hit) const {
    float near = max_of(next_float(ray.t_min), 1e-30f);
    for (;;) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      RTCRayHit answer = embree_ray(ray, near, ray.t_max);
      rtcIntersect1(embree, &context, &answer);
      if (answer.hit.geomID == RTC_INVALID_GEOMETRY_ID || !(answer.ray.tfar < ray.t_max)) return false;
      const MeshPoint point = mesh_point(scene, range, answer.hit.primID, answer.hit.u, answer.hit.v);
      const bool entering = dot(ray.direction, point.across) < 0.0f;
      if (side == Side::unknown || entering == (side == Side::outside)) {
        hit = {};
        hit.t = answer.ray.tfar;
        hit.position = point.position;
        hit.entering = entering;
        hit.geometric_normal = normalize(point.across);
        set_shading_normal(point.smooth, hit);
        hit.triangle = answer.hit.primID;
        hit.weight_b = answer.hit.u;
        hit.weight_c = answer.hit.v;
        return true;
      }
      near = next_float(answer.ray.tfar);
    }
  }

  /// What is met first from inside is met from behind.
  EMBRUN_FN bool contains(Vec3 point) const {
    Ray ray;
    ray.origin = point;
    // No special direction, so that edges and coordinate planes are missed.
    ray.direction = normalize(Vec3{0.3713906f, 0.7427813f, 0.5570860f});
    SurfaceHit hit;
    return intersect(ray, Side::unknown, hit) && !hit.entering;
  }
};

}  // namespace embrun::EMBRUN_ISA_NAMESPACE

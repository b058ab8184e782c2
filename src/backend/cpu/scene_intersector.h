#pragma once

#include <embree3/rtcore.h>

#include "backend/cpu/cpu_scene.h"
#include "geometry/clipped_surface.h"
#include "geometry/implicit_surface_trace.h"
#include "integrators/scene_hit.h"
#include "media/media_state.h"

namespace embrun {

/// The fluid of a FluidGeometry as intersect_clipped wants it.
struct FluidBody {
  const FluidGeometry& fluid;

  EMBRUN_FN bool intersect(const Ray& ray, Side side, SurfaceHit& hit) const {
    if (fluid.thesis != nullptr) return fluid.thesis->intersect(ray, side, hit);
    return intersect_implicit_surface(fluid.surface, ray, side, hit);
  }
  EMBRUN_FN bool contains(Vec3 point) const {
    return fluid.thesis != nullptr ? fluid.thesis->contains(point) : implicit_surface_contains(fluid.surface, point);
  }
};

EMBRUN_LOCAL_FN bool intersect_fluid(const FluidGeometry& fluid, const Ray& ray, Side side, SurfaceHit& hit) {
  const FluidBody body{fluid};
  return fluid.clipped ? intersect_clipped(body, fluid.clip, ray, side, hit) : body.intersect(ray, side, hit);
}

EMBRUN_LOCAL_FN bool fluid_contains(const FluidGeometry& fluid, Vec3 point) {
  return !(fluid.clipped && !fluid.clip.contains(point)) && FluidBody{fluid}.contains(point);
}

/// Whether the ray comes near enough to a box within its extent to have to look into it.
EMBRUN_FN bool may_meet(const Box3& box, const Ray& ray) {
  const BoxSpan span = clip_line(box, ray);
  return !span.empty() && span.exit >= ray.t_min && span.enter <= ray.t_max;
}

/// The nearest crossing of a set of balls; shortens the ray's extent to it.
EMBRUN_LOCAL_FN bool intersect_balls(const SceneView& scene, const BallRange& range, Ray& ray, SurfaceHit& hit) {
  if (!may_meet(range.bounds, ray)) return false;
  bool found = false;
  for (std::uint32_t i = 0; i < range.count; ++i) {
    if (!intersect_ball(scene.balls[range.first + i], ray, hit)) continue;
    ray.t_max = hit.t;
    found = true;
  }
  return found;
}

// What follows has linkage, so it lives in the namespace of the instruction set it is compiled for.
namespace EMBRUN_ISA_NAMESPACE {

/// The path tracer's intersector on a CPU (see path_stages.h).
struct CpuIntersector {
  const CpuSceneView& scene;

  /// Nearest crossing with t in (t_min, t_max).
  bool intersect(const Ray& ray, const MediaState& media, SceneHit& hit) const {
    Ray rest = ray;
    int nearest = -1;
    // The fluids come last, as they cost most and gain from a short extent.
    if (scene.meshes != nullptr) nearest = intersect_meshes(rest, hit.surface);
    for (int i = 0; i < scene.flat.instance_count; ++i) {
      const Instance& instance = scene.flat.instances[i];
      if (instance.kind == GeometryKind::fluid || instance.kind == GeometryKind::mesh) continue;
      if (!intersect_shape(instance, rest, hit.surface)) continue;
      nearest = i;
      rest.t_max = hit.surface.t;
    }
    for (int i = 0; i < scene.flat.instance_count; ++i) {
      const Instance& instance = scene.flat.instances[i];
      if (instance.kind != GeometryKind::fluid) continue;
      const Side side = media.inside_fluid(instance.fluid) ? Side::inside : Side::outside;
      if (!intersect_placed_fluid(instance, rest, side, hit.surface)) continue;
      nearest = i;
      rest.t_max = hit.surface.t;
    }
    if (nearest < 0) return false;
    describe(scene.flat.instances[nearest], hit);
    return true;
  }

  /// Calls for what the ray will read first, if it is near a fluid's surface.
  template <PrefetchStage stage>
  EMBRUN_FN void prefetch(const Ray& ray) const {
    for (int i = 0; i < scene.flat.instance_count; ++i) {
      const Instance& instance = scene.flat.instances[i];
      if (instance.kind != GeometryKind::fluid || !instance.identity) continue;
      const FluidGeometry& fluid = scene.flat.fluids[instance.geometry];
      if (fluid.thesis == nullptr) prefetch_surface<stage>(fluid.surface, ray);
    }
  }

  /// Which bodies hold a point. Ordinary code: it is asked at the start and when something went wrong.
  MediaState media_at(Vec3 point) const {
    MediaState media;
    for (int i = 0; i < scene.flat.instance_count; ++i) {
      const Instance& instance = scene.flat.instances[i];
      if (instance.media_class == 0 && instance.fluid < 0) continue;
      const Vec3 own = instance.identity ? point : instance.to_object.point(point);
      int count = 0;
      switch (instance.kind) {
        case GeometryKind::fluid: count = fluid_contains(scene.flat.fluids[instance.geometry], own) ? 1 : 0; break;
        case GeometryKind::balls: count = balls_that_contain(scene.flat.ball_ranges[instance.geometry], own); break;
        case GeometryKind::box: count = scene.flat.boxes[instance.geometry].contains(own) ? 1 : 0; break;
        case GeometryKind::mesh: count = meshes_left_behind(i, point); break;
        case GeometryKind::patch: break;
      }
      if (instance.fluid >= 0 && count > 0) media.inside_fluids |= 1u << instance.fluid;
      if (instance.media_class == 0) continue;
      const int total = min_of(count, max_crossings - media.count(instance.media_class));
      media.counts += static_cast<std::uint64_t>(total) << (8 * instance.media_class);
    }
    return media;
  }

 private:
  EMBRUN_FN bool intersect_shape(const Instance& instance, Ray& ray, SurfaceHit& hit) const {
    switch (instance.kind) {
      case GeometryKind::balls: return intersect_balls(scene.flat, scene.flat.ball_ranges[instance.geometry], ray, hit);
      case GeometryKind::box: return intersect_box(scene.flat.boxes[instance.geometry], ray, hit);
      case GeometryKind::patch: return intersect_patch(scene.flat.patches[instance.geometry], ray, hit);
      case GeometryKind::fluid:
      case GeometryKind::mesh: break;
    }
    return false;
  }

  bool intersect_placed_fluid(const Instance& instance, const Ray& ray, Side side, SurfaceHit& hit) const {
    const FluidGeometry& fluid = scene.flat.fluids[instance.geometry];
    SurfaceHit met;
    if (instance.identity) {
      Ray own = ray;
      if (ray.clearance.instance != instance.fluid) own.clearance = {};
      if (!intersect_fluid(fluid, own, side, met)) return false;
      hit = met;
      return true;
    }
    float scale;
    Ray own = transform_ray(instance.to_object, ray, scale);
    own.clearance = {};  // in the wrong unit
    if (!intersect_fluid(fluid, own, side, met)) return false;
    hit = met;
    hit.t *= 1.0f / scale;
    hit.position = instance.to_world.point(hit.position);
    hit.geometric_normal = normalize(instance.to_object.transposed(hit.geometric_normal));
    hit.shading_normal = normalize(instance.to_object.transposed(hit.shading_normal));
    return true;
  }

  /// The nearest triangle: the instance's index, or -1. Shortens the ray's extent to it.
  int intersect_meshes(Ray& ray, SurfaceHit& hit) const {
    RTCRayHit query;
    query.ray.org_x = ray.origin.x;
    query.ray.org_y = ray.origin.y;
    query.ray.org_z = ray.origin.z;
    // Embree counts the start of the extent in: the last crossing must not be met again.
    query.ray.tnear = ray.t_min * (1.0f + 2.5e-7f);
    query.ray.dir_x = ray.direction.x;
    query.ray.dir_y = ray.direction.y;
    query.ray.dir_z = ray.direction.z;
    query.ray.time = ray.time;
    query.ray.tfar = ray.t_max;
    query.ray.mask = ~0u;
    query.ray.id = 0;
    query.ray.flags = 0;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene.meshes, &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return -1;

    const int index = static_cast<int>(query.hit.instID[0]);
    fill_mesh_hit(scene.flat.instances[index], query.hit.primID, query.hit.u, query.hit.v, ray, hit);
    hit.t = query.ray.tfar;
    ray.t_max = hit.t;
    return index;
  }

  EMBRUN_FN void fill_mesh_hit(const Instance& instance, std::uint32_t primitive, float u, float v, const Ray& ray,
                               SurfaceHit& hit) const {
    const MeshRange& range = scene.flat.meshes[instance.geometry];
    const MeshTriangle& triangle = scene.flat.mesh_triangles[range.first_triangle + primitive];
    const Vec3 a = scene.flat.mesh_positions[triangle.a], b = scene.flat.mesh_positions[triangle.b],
               c = scene.flat.mesh_positions[triangle.c];
    hit.position = instance.to_world.point(a + u * (b - a) + v * (c - a));
    hit.geometric_normal = normalize(instance.to_object.transposed(cross(b - a, c - a)));
    hit.shading_normal = hit.geometric_normal;
    if (range.smooth) {
      const Vec3* normals = scene.flat.mesh_normals;
      const Vec3 smooth = instance.to_object.transposed((1.0f - u - v) * normals[triangle.a] + u * normals[triangle.b] +
                                                        v * normals[triangle.c]);
      // A mesh's own normals may point either way; sides are those of the triangles.
      if (length_squared(smooth) > 0.0f)
        hit.shading_normal = normalize(dot(smooth, hit.geometric_normal) < 0.0f ? -smooth : smooth);
    }
    hit.entering = dot(ray.direction, hit.geometric_normal) < 0.0f;
  }

  EMBRUN_FN void describe(const Instance& instance, SceneHit& hit) const {
    hit.material = instance.material;
    hit.media_class = instance.media_class;
    hit.fluid = instance.fluid;
    hit.light = instance.light;
    // Rounding of the position grows with its coordinates.
    const Vec3 p = hit.surface.position;
    const float reach = max_of(fabsf(p.x), max_of(fabsf(p.y), fabsf(p.z)));
    hit.offset = instance.offset + 1e-6f * reach;
  }

  int balls_that_contain(const BallRange& range, Vec3 point) const {
    int count = 0;
    for (std::uint32_t i = 0; i < range.count; ++i)
      count += ball_contains(scene.flat.balls[range.first + i], point) ? 1 : 0;
    return count;
  }

  /// How often a ray to infinity leaves a mesh more than it enters it: the number of its shells round the point.
  int meshes_left_behind(int index, Vec3 point) const {
    // No special direction, so that edges and coordinate planes are missed.
    const Vec3 direction = normalize(Vec3{0.3713906f, 0.7427813f, 0.5570860f});
    Ray ray;
    ray.origin = point;
    ray.direction = direction;
    int count = 0;
    for (int crossings = 0; crossings < 10000; ++crossings) {
      SurfaceHit hit;
      ray.t_max = infinity;
      const int met = intersect_meshes(ray, hit);
      if (met < 0) break;
      if (met == index) count += hit.entering ? -1 : 1;
      ray.t_min = hit.t * (1.0f + 1e-6f) + 1e-7f;
    }
    return max_of(count, 0);
  }
};

}  // namespace EMBRUN_ISA_NAMESPACE
}  // namespace embrun

#pragma once

#include "backend/cpu/ball_query.h"
#include "backend/cpu/fluid_mesh.h"
#include "backend/cpu/kernel_table.h"
#include "geometry/clipped_surface.h"
#include "geometry/implicit_surface_batch.h"
#include "geometry/mls_surface.h"
#include "integrators/scene_hit.h"
#include "media/media_state.h"
#include "scene/flat_coordinates.h"

namespace embrun {

// What follows has linkage, so it lives in the namespace of the instruction set it is compiled for.
namespace EMBRUN_ISA_NAMESPACE {

/// The fluid `index` of a scene as intersect_clipped wants it.
struct FluidBody {
  const CpuSceneView& scene;
  std::uint32_t index;
  int level;  ///< of detail

  EMBRUN_FN const FluidGeometry& fluid() const { return scene.flat.fluids[index]; }
  EMBRUN_FN bool intersect(const Ray& ray, Side side, SurfaceHit& hit) const {
    if (fluid().thesis != nullptr) return fluid().thesis->intersect(ray, side, hit);
    if (fluid().mesh >= 0) return mesh().intersect(ray, side, hit);
    if (level > 0) return intersect_coarse_surface(coarse(), ray, side, hit);
    return intersect_implicit_surface(fluid().surface, ray, side, hit);
  }
  EMBRUN_FN bool contains(Vec3 point) const {
    if (fluid().thesis != nullptr) return fluid().thesis->contains(point);
    if (fluid().mesh >= 0) return mesh().contains(point);
    if (level > 0) return coarse_surface_contains(coarse(), point);
    return implicit_surface_contains(fluid().surface, point);
  }

 private:
  EMBRUN_FN const CoarseSurfaceView& coarse() const { return scene.flat.coarse_surfaces[fluid().levels.index(level)]; }
  EMBRUN_FN FluidMesh mesh() const { return {scene.flat, scene.flat.meshes[fluid().mesh], scene.fluid_meshes[index]}; }
};

EMBRUN_LOCAL_FN bool intersect_fluid(const FluidBody& body, const Ray& ray, Side side, SurfaceHit& hit) {
  const FluidGeometry& fluid = body.fluid();
  return fluid.clipped ? intersect_clipped(body, fluid.clip, ray, side, hit) : body.intersect(ray, side, hit);
}

EMBRUN_LOCAL_FN bool fluid_contains(const FluidBody& body, Vec3 point) {
  return !(body.fluid().clipped && !body.fluid().clip.contains(point)) && body.contains(point);
}

/// The path tracer's intersector on a CPU (see path_stages.h).
struct CpuIntersector {
  const CpuSceneView& scene;

  /// Nearest crossing with t in (t_min, t_max).
  bool intersect(const Ray& ray, const MediaState& media, SceneHit& hit) const {
    Ray rest = ray;
    int nearest = intersect_all_but_fluids(rest, media, hit.surface);
    // The fluids come last, as they cost most and gain from a short extent.
    for (int i = 0; i < scene.flat.instance_count; ++i) {
      if (scene.flat.instances[i].kind == GeometryKind::fluid)
        intersect_fluid_too(i, media, rest, nearest, hit.surface);
    }
    if (nearest < 0) return false;
    describe(scene.flat.instances[nearest], hit);
    return true;
  }

  /// The same for many rays at once, which is faster where there are fluids. `Queries` has
  ///   int count() const;
  ///   const Ray& ray(int i) const;           // i in [0, count)
  ///   const MediaState& media(int i) const;
  ///   SceneHit& hit(int i);
  ///   bool& found(int i);
  ///   Ray& rest(int i);                      // room for what is left of the ray, and below for the
  ///   int& nearest(int i);                   // instance that was met so far
  template <class Queries>
  void intersect_all(Queries& queries) const {
    for (int i = 0; i < queries.count(); ++i) {
      queries.rest(i) = queries.ray(i);
      queries.nearest(i) = intersect_all_but_fluids(queries.rest(i), queries.media(i), queries.hit(i).surface);
    }
    for (int k = 0; k < scene.flat.instance_count; ++k) {
      const Instance& instance = scene.flat.instances[k];
      if (instance.kind != GeometryKind::fluid) continue;
      const FluidGeometry& fluid = scene.flat.fluids[instance.geometry];
      if (instance.identity && !fluid.clipped && fluid.thesis == nullptr && fluid.mesh < 0) {
        FluidQueries<Queries> rays{queries, k, instance.fluid};
        rays.keep_own_clearances();
        if (fluid.levels.footprints == 0.0f) {
          intersect_implicit_surface_batch(fluid.surface, rays);
        } else {
          intersect_levels(rays, fluid);
        }
      } else {
        for (int i = 0; i < queries.count(); ++i) {
          intersect_fluid_too(k, queries.media(i), queries.rest(i), queries.nearest(i), queries.hit(i).surface);
        }
      }
    }
    for (int i = 0; i < queries.count(); ++i) {
      queries.found(i) = queries.nearest(i) >= 0;
      if (queries.found(i)) describe(scene.flat.instances[queries.nearest(i)], queries.hit(i));
    }
  }

  /// Which bodies hold a point, for rays of that Ray::detail. Ordinary code: it is asked at the start and when something
  /// went wrong.
  MediaState media_at(Vec3 point, float detail) const {
    MediaState media;
    for (int i = 0; i < scene.flat.instance_count; ++i) {
      const Instance& instance = scene.flat.instances[i];
      if (instance.media_class == 0 && instance.solid < 0) continue;
      const Vec3 own = instance.identity ? point : instance.to_object.point(point);
      int count = 0;
      switch (instance.kind) {
        case GeometryKind::fluid: {
          const int level = scene.flat.fluids[instance.geometry].levels.level(detail);
          count = fluid_contains({scene, instance.geometry, level}, own) ? 1 : 0;
          break;
        }
        case GeometryKind::balls: count = in_balls(scene.ball_sets[instance.geometry], own) ? 1 : 0; break;
        case GeometryKind::box: count = scene.flat.boxes[instance.geometry].contains(own) ? 1 : 0; break;
        case GeometryKind::mesh: count = meshes_left_behind(i, point); break;
        case GeometryKind::splats: {
          const SplatGeometry& splats = scene.flat.splats[instance.geometry];
          const bool contains =
              splats.mls ? mls_contains(splats.set, splats.tree, own) : splats_contain(splats.set, splats.tree, own);
          count = contains ? 1 : 0;
          break;
        }
        case GeometryKind::patch:
        case GeometryKind::cylinder: break;
      }
      if (instance.solid >= 0 && count > 0) media.inside_solids |= solid_bit(instance.solid);
      if (instance.media_class == 0) continue;
      const int total = min_of(count, max_crossings - media.count(instance.media_class));
      media.counts += static_cast<std::uint64_t>(total) << (8 * instance.media_class);
    }
    return media;
  }

 private:
  /// What is left of the queries' rays, as intersect_implicit_surface_batch wants rays.
  template <class Queries>
  struct FluidQueries {
    Queries& queries;
    int instance, fluid;

    /// A clearance is of one fluid's surface and means nothing to another.
    void keep_own_clearances() {
      for (int i = 0; i < queries.count(); ++i) {
        const Clearance& clearance = queries.ray(i).clearance;
        queries.rest(i).clearance = clearance.instance == fluid ? clearance : Clearance{};
      }
    }
    EMBRUN_FN int count() const { return queries.count(); }
    EMBRUN_FN const Ray& ray(int i) const { return queries.rest(i); }
    EMBRUN_FN Side side(int i) const { return queries.media(i).inside_fluid(fluid) ? Side::inside : Side::outside; }
    EMBRUN_FN SurfaceHit& hit(int i) { return queries.hit(i).surface; }
    EMBRUN_FN void settle(int i, bool found) {
      if (!found) return;
      queries.nearest(i) = instance;
      queries.rest(i).t_max = queries.hit(i).surface.t;
    }
  };

  /// Some of them.
  template <class Queries>
  struct SomeFluidQueries {
    FluidQueries<Queries>& all;
    std::uint16_t index[batch_size];
    int number = 0;

    EMBRUN_FN int count() const { return number; }
    EMBRUN_FN const Ray& ray(int i) const { return all.ray(index[i]); }
    EMBRUN_FN Side side(int i) const { return all.side(index[i]); }
    EMBRUN_FN SurfaceHit& hit(int i) { return all.hit(index[i]); }
    EMBRUN_FN void settle(int i, bool found) { all.settle(index[i], found); }
  };

  /// Meets a fluid with levels of detail, level by level. What is searched for particle by particle is for many rays at
  /// once.
  template <class Queries>
  void intersect_levels(FluidQueries<Queries>& rays, const FluidGeometry& fluid) const {
    Queries& queries = rays.queries;
    for (int level = fluid.levels.finest; level <= fluid.levels.coarsest; ++level) {
      const CoarseSurfaceView* coarse = level > 0 ? scene.flat.coarse_surfaces + fluid.levels.index(level) : nullptr;
      if (coarse == nullptr) {
        intersect_some(rays, fluid.levels, level, fluid.surface, [](int) { return true; });
      } else {
        intersect_some(rays, fluid.levels, level, coarse->spray, [&](int i) {
          const bool inside = rays.side(i) == Side::inside;
          if (inside) {
            intersect_fluid_too(rays.instance, queries.media(i), queries.rest(i), queries.nearest(i),
                                queries.hit(i).surface);
          } else {
            SurfaceHit met;
            if (intersect_lattice_surface(coarse->bulk, queries.rest(i), Side::outside, met)) {
              queries.hit(i).surface = met;
              rays.settle(i, true);
            }
          }
          return !inside && coarse->has_spray;
        });
      }
    }
  }

  /// Searches the rays of one level for which `wants` says so; it is asked once for each ray of the level.
  template <class Queries, class Wants>
  static void intersect_some(FluidQueries<Queries>& rays, const FluidLevels& levels, int level,
                             const ImplicitSurfaceView& surface, const Wants& wants) {
    SomeFluidQueries<Queries> some{rays, {}};
    for (int begin = 0; begin < rays.count(); begin += batch_size) {
      some.number = 0;
      for (int i = begin; i < min_of(begin + batch_size, rays.count()); ++i)
        if (levels.level(rays.ray(i).detail) == level && wants(i))
          some.index[some.number++] = static_cast<std::uint16_t>(i);
      if (some.number > 0) intersect_implicit_surface_batch(surface, some);
    }
  }

  /// The instance that is met first but for fluids, or -1; shortens the ray's extent to it.
  int intersect_all_but_fluids(Ray& rest, const MediaState& media, SurfaceHit& hit) const {
    int nearest = -1;
    if (scene.top != nullptr) nearest = intersect_in_embree(rest, media, hit);
    for (int i = 0; i < scene.flat.instance_count; ++i) {
      if (!intersect_shape(scene.flat.instances[i], rest, media, hit)) continue;
      nearest = i;
      rest.t_max = hit.t;
    }
    return nearest;
  }

  /// Meets instance `index`, a fluid, if it is nearer than what was met so far.
  void intersect_fluid_too(int index, const MediaState& media, Ray& rest, int& nearest, SurfaceHit& hit) const {
    const Instance& instance = scene.flat.instances[index];
    const Side side = media.inside_fluid(instance.fluid) ? Side::inside : Side::outside;
    if (!intersect_placed_fluid(instance, rest, side, hit)) return;
    nearest = index;
    rest.t_max = hit.t;
  }

  EMBRUN_FN bool intersect_shape(const Instance& instance, Ray& ray, const MediaState& media, SurfaceHit& hit) const {
    switch (instance.kind) {
      case GeometryKind::box: return intersect_box(scene.flat.boxes[instance.geometry], ray, hit);
      case GeometryKind::patch: return intersect_patch(scene.flat.patches[instance.geometry], ray, hit);
      case GeometryKind::cylinder: return intersect_cylinder(scene.flat.cylinders[instance.geometry], ray, hit);
      case GeometryKind::splats: return intersect_placed_splats(instance, ray, media, hit);
      case GeometryKind::fluid:
      case GeometryKind::balls:
      case GeometryKind::mesh: break;
    }
    return false;
  }

  bool intersect_placed_fluid(const Instance& instance, const Ray& ray, Side side, SurfaceHit& hit) const {
    const FluidBody fluid{scene, instance.geometry, scene.flat.fluids[instance.geometry].levels.level(ray.detail)};
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

  static bool intersect_cloud(const SplatGeometry& cloud, const Ray& ray, bool inside, const SplatStart& start,
                              SurfaceHit& hit) {
    if (cloud.mls) return intersect_mls(cloud.set, cloud.tree, ray, inside, start, hit);
    return intersect_splats(cloud.set, cloud.tree, ray, inside, start, hit);
  }

  bool intersect_placed_splats(const Instance& instance, const Ray& ray, const MediaState& media,
                               SurfaceHit& hit) const {
    const SplatGeometry& splats = scene.flat.splats[instance.geometry];
    const bool inside = instance.solid >= 0 && media.inside_solid(instance.solid);
    SplatStart start = splat_start_of(ray, instance.splats);
    if (instance.identity) return intersect_cloud(splats, ray, inside, start, hit);
    float scale;
    const Ray own = transform_ray(instance.to_object, ray, scale);
    if (start.radius > 0.0f) {
      start.normal = normalize(instance.to_world.transposed(start.normal));
      start.radius *= scale;
    }
    if (!intersect_cloud(splats, own, inside, start, hit)) return false;
    hit.t *= 1.0f / scale;
    hit.splat_radius *= 1.0f / scale;
    hit.position = instance.to_world.point(hit.position);
    hit.geometric_normal = normalize(instance.to_object.transposed(hit.geometric_normal));
    hit.shading_normal = normalize(instance.to_object.transposed(hit.shading_normal));
    return true;
  }

  /// The nearest triangle or ball: the instance's index, or -1. Shortens the ray's extent to it.
  int intersect_in_embree(Ray& ray, const MediaState& media, SurfaceHit& hit) const {
    int nearest = -1;
    BallQuery query(ray);
    query.tolerance = ball_tolerance(ray, ray.t_min, 0.0f);
    // First the way out of solids of balls that the ray is inside: mostly near, so the rest has a short extent.
    for (int i = 0; i < scene.ball_set_count; ++i) {
      const CpuBallSet& balls = scene.ball_sets[i];
      if (balls.solid < 0 || !media.inside_solid(balls.solid)) continue;
      const WayOut way = leave_balls(balls, ray, hit);
      if (way == WayOut::lost) continue;
      query.ignored |= solid_bit(balls.solid);
      if (way == WayOut::beyond) continue;
      nearest = balls.instance;
      ray.t_max = hit.t;
    }
    const int nearer = ask_embree(query, ray, hit);
    return nearer >= 0 ? nearer : nearest;
  }

  /// The nearest triangle, or ball as the query wants them: the instance's index, or -1. Shortens the ray's extent to it.
  int ask_embree(BallQuery& query, Ray& ray, SurfaceHit& hit) const {
    // Embree counts the start of the extent in: the last crossing must not be met again. The next number will do, and
    // more would lose a face that is as good as at the same place as what was crossed last.
    RTCRayHit answer = embree_ray(ray, max_of(next_float(ray.t_min), 1e-30f), ray.t_max);
    rtcIntersect1(scene.top, &query.embree, &answer);
    if (answer.hit.geomID == RTC_INVALID_GEOMETRY_ID) return -1;
    const int index = static_cast<int>(answer.hit.instID[0]);
    const Instance& instance = scene.flat.instances[index];
    if (instance.kind == GeometryKind::balls) {
      const Ball ball = scene.ball_sets[instance.geometry].set.ball(answer.hit.primID);
      fill_ball_hit(ball, ray, answer.ray.tfar, answer.hit.u > 0.5f, hit);
    } else {
      fill_mesh_hit(instance, answer.hit.primID, answer.hit.u, answer.hit.v, ray, hit);
      hit.t = answer.ray.tfar;
    }
    ray.t_max = hit.t;
    return index;
  }

  EMBRUN_FN void fill_mesh_hit(const Instance& instance, std::uint32_t primitive, float u, float v, const Ray& ray,
                               SurfaceHit& hit) const {
    const MeshPoint point = mesh_point(scene.flat, scene.flat.meshes[instance.geometry], primitive, u, v);
    hit.position = instance.to_world.point(point.position);
    hit.geometric_normal = normalize(instance.to_object.transposed(point.across));
    set_shading_normal(instance.to_object.transposed(point.smooth), hit);
    hit.entering = dot(ray.direction, hit.geometric_normal) < 0.0f;
    hit.triangle = primitive;
    hit.weight_b = u;
    hit.weight_c = v;
  }

  EMBRUN_FN void describe(const Instance& instance, SceneHit& hit) const {
    hit.material = instance.material;
    hit.media_class = instance.media_class;
    hit.fluid = instance.fluid;
    hit.splats = instance.splats;
    hit.solid = instance.solid;
    hit.light = instance.light;
    SurfaceCoordinates coordinates;
    if (instance.needs_coordinates) coordinates = coordinates_of(scene.flat, instance, hit.surface);
    hit.uv = coordinates.uv;
    hit.tangent = coordinates.tangent;
    // Rounding of the position grows with its coordinates.
    const Vec3 p = hit.surface.position;
    const float reach = max_of(fabsf(p.x), max_of(fabsf(p.y), fabsf(p.z)));
    hit.offset = instance.offset + 1e-6f * reach;
    if (instance.kind == GeometryKind::fluid || instance.kind == GeometryKind::balls ||
        (instance.kind == GeometryKind::splats && instance.media_class != 0))
      keep_off_others(hit);
  }

  /// Shortens the offset so far that the step off the surface goes through no face of a mesh or a box near by, which do
  /// not tell on which side of them a ray starts.
  EMBRUN_FN void keep_off_others(SceneHit& hit) const {
    const Vec3 p = hit.surface.position;
    float room = hit.offset;
    for (int i = 0; i < scene.flat.instance_count; ++i) {
      const Instance& instance = scene.flat.instances[i];
      if (instance.kind != GeometryKind::box) continue;
      const Box3& box = scene.flat.boxes[instance.geometry];
      for (int axis = 0; axis < 3; ++axis)
        room = min_of(room, min_of(fabsf(p[axis] - box.low[axis]), fabsf(p[axis] - box.high[axis])));
    }
    if (scene.has_meshes) {
      for (const float side : {-1.0f, 1.0f}) {
        Ray step;
        step.origin = p;
        step.direction = side * hit.surface.geometric_normal;
        step.t_max = room;
        BallQuery query(step);
        query.question = BallQuestion::none;
        RTCRayHit answer = embree_ray(step, 0.0f, room);
        rtcIntersect1(scene.top, &query.embree, &answer);
        room = min_of(room, answer.ray.tfar);
      }
    }
    if (room < hit.offset) hit.offset = 0.5f * room;
  }

  static bool in_balls(const CpuBallSet& balls, Vec3 point) {
    Ray at;
    at.origin = point;
    return touched_ball(balls, at, 0.0f).found();
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
      BallQuery query(ray);
      query.question = BallQuestion::none;
      const int met = ask_embree(query, ray, hit);
      if (met < 0) break;
      if (met == index) count += hit.entering ? -1 : 1;
      ray.t_min = hit.t * (1.0f + 1e-6f) + 1e-7f;
    }
    return max_of(count, 0);
  }
};

}  // namespace EMBRUN_ISA_NAMESPACE
}  // namespace embrun

// Compiled by nvcc in CI and never run: shows that the per-ray code is fit for the device. The kernel
// traces a whole path through the integrator's stages, past a fluid, balls, splats and a box, so that every
// template and inline function on the way is really compiled.
#include "geometry/ball_set.h"
#include "geometry/clipped_surface.h"
#include "geometry/implicit_surface_trace.h"
#include "geometry/mls_surface.h"
#include "geometry/splat_tree.h"
#include "geometry/surface_coordinates.h"
#include "integrators/ambient_occlusion.h"
#include "integrators/gauss.h"
#include "integrators/medium_scatter.h"
#include "integrators/path_stages.h"
#include "integrators/whitted.h"

// The large pieces, compiled once each rather than into every caller: it is the compile time that counts here.
#define EMBRUN_DEVICE_CALL __noinline__ __host__ __device__

namespace embrun {
namespace {

/// A fluid as intersect_clipped wants a body.
struct FluidBody {
  ImplicitSurfaceView surface;

  EMBRUN_DEVICE_CALL bool intersect(const Ray& ray, Side side, SurfaceHit& hit) const {
    return intersect_implicit_surface(surface, ray, side, hit);
  }
  EMBRUN_DEVICE_CALL bool contains(Vec3 point) const { return implicit_surface_contains(surface, point); }
};

/// The least scene that has one of everything: what the stages ask of an intersector.
struct DeviceIntersector {
  FluidBody fluid;
  Box3 container;
  BallSet balls;
  SplatSet splats;
  SplatTreeView tree;

  EMBRUN_DEVICE_CALL bool intersect(const Ray& ray, const MediaState& media, SceneHit& hit) const {
    const Side side = media.inside_fluid(0) ? Side::inside : Side::outside;
    hit.fluid = 0;
    hit.solid = 0;
    hit.media_class = 1;
    bool found = intersect_clipped(fluid, container, ray, side, hit.surface);
    Ray nearer = ray;
    if (found) nearer.t_max = hit.surface.t;
    if (intersect_each_ball(balls, nearer, media.inside_solid(1), hit.surface)) {
      hit.fluid = -1;
      hit.solid = 1;
      hit.media_class = 2;
      const SurfaceCoordinates coordinates = ball_coordinates(hit.surface.geometric_normal);
      hit.uv = coordinates.uv;
      hit.tangent = coordinates.tangent;
      found = true;
    }
    if (found) nearer.t_max = hit.surface.t;
    if (intersect_splats(splats, tree, nearer, media.inside_solid(2), splat_start_of(nearer, 0), hit.surface)) {
      hit.fluid = -1;
      hit.splats = 0;
      hit.solid = 2;
      hit.media_class = 3;
      found = true;
    }
    return found;
  }
  EMBRUN_FN MediaState media_at(Vec3 point, float) const {
    const MediaBoundary surface{1, 0, true};
    return container.contains(point) && fluid.contains(point) ? cross_boundary({}, surface) : MediaState{};
  }
};

/// The stages of a path in their order, as a backend runs them.
EMBRUN_FN Rgb trace_path(const PathScene& scene, const DeviceIntersector& intersector, int x, int y,
                         PathCounters& counters) {
  PathState path = generate_path(scene, x, y, 0);
  while (path.alive) {
    SceneHit hit;
    const bool found = intersector.intersect(path.ray, path.media, hit);
    MediaState behind;
    ShadowRay shadow;
    PathFlight flight;
    MediumCollision collision;
    const bool flies = begin_flight_to_boundary(scene, path, found, hit, flight, counters);
    if (flies && sample_on_the_way(scene, path, flight, shadow, counters))
      add_scattered_light(scene, path, trace_shadow_ray(scene, intersector, shadow, counters));
    if (flies && fly_path(scene, path, flight, collision, counters)) {
      if (scatter_in_medium(scene, path, collision, shadow, counters))
        add_scattered_light(scene, path, trace_shadow_ray(scene, intersector, shadow, counters));
      continue;
    }
    if (advance_path(scene, intersector, path, found, hit, behind, counters) != Advance::scatters) continue;
    if (scatter_path(scene, path, hit, behind, shadow, counters))
      add_scattered_light(scene, path, trace_shadow_ray(scene, intersector, shadow, counters));
  }
  return path.radiance;
}

/// The stages of Whitted's ray tracing.
EMBRUN_FN Rgb trace_whitted(const PathScene& scene, const DeviceIntersector& intersector, int x, int y,
                            PathCounters& counters) {
  PathState path = generate_path(scene, x, y, 0);
  while (path.alive) {
    SceneHit hit;
    const bool found = intersector.intersect(path.ray, path.media, hit);
    MediaState behind;
    ShadowRay shadow;
    if (advance_path(scene, intersector, path, found, hit, behind, counters) != Advance::scatters) continue;
    const SurfaceEvent event = meet_surface(scene, path, hit, behind);
    for (int light = 0; light < scene.lights.count && !event.specular; ++light) {
      const LightSample sample = draw_light_of(scene, path, light, leave_surface(hit, event.wo));
      if (light_surface(scene, path, hit, event, behind, sample, true, shadow))
        add_scattered_light(scene, path, trace_shadow_ray(scene, intersector, shadow, counters));
    }
    follow_mirror(scene, path, hit, event, behind, counters);
  }
  return path.radiance;
}

/// The stages of ambient occlusion.
EMBRUN_FN Rgb trace_occlusion(const PathScene& scene, const DeviceIntersector& intersector, int x, int y,
                              PathCounters& counters) {
  PathState path = generate_path(scene, x, y, 0);
  while (path.alive) {
    SceneHit hit;
    const bool found = intersector.intersect(path.ray, path.media, hit);
    MediaState behind;
    ShadowRay shadow;
    if (advance_unlit(scene, intersector, path, found, hit, behind, counters) != Advance::scatters) continue;
    if (start_occlusion_ray(scene, path, hit, behind, shadow, counters))
      path.radiance += trace_occlusion_ray(scene, intersector, shadow, counters);
  }
  return path.radiance;
}

/// The stages of Gauss's quadrature, where there are no media.
EMBRUN_FN Rgb trace_gauss(const PathScene& scene, const DeviceIntersector& intersector, int x, int y,
                          PathCounters& counters) {
  PathState path = generate_path(scene, x, y, 0);
  while (path.alive) {
    SceneHit hit;
    const bool found = intersector.intersect(path.ray, path.media, hit);
    MediaState behind;
    ShadowRay shadow;
    if (advance_path(scene, intersector, path, found, hit, behind, counters) != Advance::scatters) continue;
    if (scatter_by_rule(scene, path, hit, behind, shadow, counters))
      add_scattered_light(scene, path, trace_shadow_ray(scene, intersector, shadow, counters));
  }
  return path.radiance;
}

}  // namespace

__global__ void device_check(const PathScene* scene, const DeviceIntersector* intersector, Rgb* pixels,
                             PathCounters* counters, int count) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= count) return;
  const int x = i % scene->camera.width, y = i / scene->camera.width;
  switch (scene->settings.integrator) {
    case IntegratorKind::path: pixels[i] = trace_path(*scene, *intersector, x, y, counters[i]); break;
    case IntegratorKind::whitted: pixels[i] = trace_whitted(*scene, *intersector, x, y, counters[i]); break;
    case IntegratorKind::ambient_occlusion: pixels[i] = trace_occlusion(*scene, *intersector, x, y, counters[i]); break;
    case IntegratorKind::gauss: pixels[i] = trace_gauss(*scene, *intersector, x, y, counters[i]); break;
  }
}

/// The other surface of points, by itself.
__global__ void device_check_mls(const SplatSet* set, const SplatTreeView* tree, const Ray* rays, SurfaceHit* hits,
                                 bool* found, int count) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= count) return;
  const bool inside = mls_contains(*set, *tree, rays[i].origin);
  found[i] = intersect_mls(*set, *tree, rays[i], inside, splat_start_of(rays[i], 0), hits[i]);
}

}  // namespace embrun

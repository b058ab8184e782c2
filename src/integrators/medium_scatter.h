#pragma once

#include "integrators/path_stages.h"

// The stages of path_stages.h for what happens between boundaries.

namespace embrun {

/// Begins the path's flight to what its ray met, if there is anything on the way to collide with: `found` and `hit` are the
/// intersector's answer.
EMBRUN_LOCAL_FN bool begin_flight_to_boundary(const PathScene& scene, const PathState& path, bool found,
                                              const SceneHit& hit, PathFlight& flight, PathCounters& counters) {
  if (!may_collide(scene, path.media)) return false;
  Ray to_boundary = path.ray;
  to_boundary.t_max = found ? hit.surface.t : infinity;
  const LightHit lamp = meet_lamp(scene, path, to_boundary);
  flight = begin_flight(scene, path, lamp.light >= 0 ? lamp.distance : to_boundary.t_max, counters);
  return true;
}

/// Takes a path alone to a collision on the way to what its ray met. True: on to scatter_in_medium; false: on to
/// advance_path.
EMBRUN_LOCAL_FN bool fly_to_boundary(const PathScene& scene, PathState& path, bool found, const SceneHit& hit,
                                     MediumCollision& collision, PathCounters& counters) {
  PathFlight flight;
  if (!begin_flight_to_boundary(scene, path, found, hit, flight, counters)) return false;
  FlightQuery& query = flight.query;
  const Flight met = next_collision(scene.density, query.ray, scene.settings.flights, query.channel, query.u,
                                    query.random, counters.majorants);
  return end_flight(scene, path, flight, met, collision);
}

/// Scatters the path at the collision that fly_to_boundary found. True when `shadow` is to be traced.
EMBRUN_LOCAL_FN bool scatter_in_medium(const PathScene& scene, PathState& path, const MediumCollision& collision,
                                       ShadowRay& shadow, PathCounters& counters) {
  Ray& ray = path.ray;
  const Vec3 point = ray.at(collision.t), wo = -ray.direction;
  add_light(scene, path, path.throughput * collision.emission);

  // Features of the picture; a medium has no normal.
  if (!path.has_normal) {
    path.has_normal = true;
    path.first_distance = collision.t;
  }
  if (!path.has_albedo) {
    path.has_albedo = true;
    path.albedo = collision.albedo;
  }

  path.throughput *= collision.albedo;
  if (path.depth >= scene.settings.max_depth || is_black(path.throughput)) {
    path.alive = false;
    return false;
  }
  path.key.bounce = static_cast<std::uint32_t>(path.depth) + 1;
  ++counters.scatterings;
  ++counters.collisions;

  const LightSample light = draw_light(scene, path, point);
  bool lit = light.valid;
  if (lit) {
    const float value = eval_phase(collision.phase, wo, light.direction);
    lit = start_shadow_ray(scene, path, light, point, path.media, grey(value), value, shadow);
  }

  const PhaseSample next =
      sample_phase(collision.phase, wo, sample_2d(scene.settings.sampler, path.key, Dimension::phase_direction));
  path.scatter_pdf = next.pdf;
  path.left_medium = true;
  note_event(scene.settings, path, false, false);
  ray.cone_width += ray.cone_spread * collision.t;
  ray.origin = point;
  ray.direction = next.wi;
  ray.clearance = {};
  ray.t_min = 0.0f;
  ray.t_max = infinity;
  path.passed = 0;
  ++path.depth;
  play_roulette(scene, path);
  return lit;
}

}  // namespace embrun

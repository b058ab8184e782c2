#pragma once

#include "integrators/equiangular.h"
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

/// Takes a path alone along its flight. True: it collides, on to scatter_in_medium; false: on to advance_path.
EMBRUN_LOCAL_FN bool fly_path(const PathScene& scene, PathState& path, PathFlight& flight, MediumCollision& collision,
                              PathCounters& counters) {
  FlightQuery& query = flight.query;
  const Flight met = next_collision(scene.density, query.ray, scene.settings.flights, query.channel, query.u,
                                    query.random, counters.majorants);
  return end_flight(scene, path, flight, met, collision);
}

/// The path's way through a medium as the light sees it that `u` chooses.
EMBRUN_LOCAL_FN LampView view_of_way(const PathScene& scene, const PathState& path, float way_end, float u) {
  const Light& light = scene.lights.lights[sample_discrete(scene.lights.choice, u).index];
  const Medium& medium = scene.media[path.media.current()];
  return view_from_lamp(scene, light, path.ray, way_end, medium.grid >= 0 || !is_black(medium.scattering));
}

/// Mean of what scatters on the path's way, per metre.
EMBRUN_FN float mean_extinction(const PathScene& scene, const MediaState& media) {
  const Medium& medium = scene.media[media.current()];
  return mean(medium.scattering) + (medium.grid >= 0 ? scene.grids[medium.grid].mean_extinction : 0.0f) +
         (fluids_within(scene, media) != 0 ? scene.density.mean_extinction : 0.0f);
}

/// Draws what scatters at a point: its phase function, and its scattering over the chance that it is drawn.
EMBRUN_LOCAL_FN Rgb draw_scatterer(const PathScene& scene, const MediaState& media, Vec3 point, float u,
                                   PhaseFunction& phase) {
  const Medium& medium = scene.media[media.current()];
  ScatterChoice choice;
  choice.u = u;
  Rgb scattering;
  if (choice.offer(mean(medium.scattering))) {
    scattering = medium.scattering;
    phase = medium.phase;
  }
  if (medium.grid >= 0) {
    const GridMedium& grid = scene.grids[medium.grid];
    const Rgb own = scattering_at(grid, point);
    if (choice.offer(mean(own))) {
      scattering = own;
      phase = grid.phase;
    }
  }
  const std::uint32_t fluids = fluids_within(scene, media);
  const DensityCell* cell = fluids != 0 ? cell_holding(scene.density, point) : nullptr;
  LocalMedium local;
  if (cell != nullptr && offer_fluids(scene.density, *cell, point, fluids, choice, local)) {
    scattering = local.extinction * local.albedo;
    phase = scene.density.fluids[local.fluid].phase;
  }
  return choice.total > 0.0f ? scattering * (choice.total / choice.chosen) : Rgb{};
}

/// Draws a point on the flight's way by where a lamp is, and light from the lamp for it. True when `shadow` is to be traced:
/// it brings what scatter_in_medium leaves out.
EMBRUN_LOCAL_FN bool sample_on_the_way(const PathScene& scene, const PathState& path, const PathFlight& flight,
                                       ShadowRay& shadow, PathCounters& counters) {
  const PathSettings& settings = scene.settings;
  if (!settings.equiangular || settings.lights == LightStrategy::bsdf_only || path.depth >= settings.max_depth)
    return false;
  RandomStream random(path.key, Dimension::on_the_way, path.passed);
  const Sample2 u = random.next_pair();
  const LampView view = view_of_way(scene, path, flight.way_end, u.x);
  if (!view.useful) return false;
  const float t = view.draw(u.y);
  const Vec3 point = path.ray.at(t);
  const LightSample light = sample_lights(scene.lights, point, u.x, random.next_pair());
  if (!light.valid || !(light.pdf > 0.0f)) return false;

  PhaseFunction phase;
  const Rgb scattering = draw_scatterer(scene, path.media, point, random.next_pair().x, phase);
  if (is_black(scattering)) return false;
  const float value = eval_phase(phase, -path.ray.direction, light.direction);
  const float share = lamp_share(view, t, path.ray.t_min, mean_extinction(scene, path.media));
  const Rgb through = stretch_transmittance(scene, path.media, path.ray, t, random, counters);
  if (!start_shadow_ray(scene, path, light, point, path.media, scattering * through * (value * share / view.pdf(t)),
                        value, shadow))
    return false;
  shadow.random = random;
  return true;
}

/// Begins the path's next event, at the collision that its flight found, and notes the features of the picture. False: the
/// path is over.
EMBRUN_LOCAL_FN bool meet_collision(const PathScene& scene, PathState& path, const MediumCollision& collision,
                                    PathCounters& counters) {
  add_light(scene, path, path.throughput * collision.emission);

  // A medium has no normal.
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
  return true;
}

/// As light_surface, for light drawn for the point of a collision.
EMBRUN_LOCAL_FN bool light_collision(const PathScene& scene, const PathState& path, const MediumCollision& collision,
                                     const LightSample& light, bool alone, ShadowRay& shadow) {
  if (!light.valid) return false;
  const float value = eval_phase(collision.phase, -path.ray.direction, light.direction);
  return start_shadow_ray(scene, path, light, path.ray.at(collision.t), path.media, grey(value), alone ? 0.0f : value,
                          shadow);
}

/// Scatters the path at the collision that its flight found. True when `shadow` is to be traced.
EMBRUN_LOCAL_FN bool scatter_in_medium(const PathScene& scene, PathState& path, const MediumCollision& collision,
                                       ShadowRay& shadow, PathCounters& counters) {
  if (!meet_collision(scene, path, collision, counters)) return false;
  Ray& ray = path.ray;
  const Vec3 point = ray.at(collision.t), wo = -ray.direction;
  const bool lit = light_collision(scene, path, collision, draw_light(scene, path, point), false, shadow);
  if (lit && scene.settings.equiangular) {
    // What sample_on_the_way brought already.
    const LampView view = view_of_way(scene, path, collision.way_end,
                                      sample_1d(scene.settings.sampler, path.key, Dimension::light_choice));
    shadow.contribution *= 1.0f - lamp_share(view, collision.t, ray.t_min, mean_extinction(scene, path.media));
  }

  const PhaseSample next =
      sample_phase(collision.phase, wo, sample_2d(scene.settings.sampler, path.key, Dimension::phase_direction));
  path.scatter_pdf = next.pdf;
  path.left_medium = true;
  note_event(scene.settings, path, false, false);
  ray.cone_width += ray.cone_spread * collision.t;
  ray.cone_spread = max_of(ray.cone_spread, spread_of_density(next.pdf));
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

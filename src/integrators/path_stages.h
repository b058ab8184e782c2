#pragma once

#include "geometry/splat_start.h"
#include "integrators/medium_flight.h"
#include "integrators/path_scene.h"
#include "integrators/path_state.h"
#include "integrators/ray_spread.h"
#include "integrators/scene_hit.h"
#include "lights/mis.h"

// The stages of a unidirectional path tracer with next-event estimation [Kajiya1986, Veach1995]. A path is
//
//   generate_path
//   repeat while alive:
//     (the intersector finds the next crossing)
//     begin_flight      through media on the way, if there are any: then
//       sample_on_the_way   light that they scatter from a lamp, as a shadow ray
//       fly_path            a collision: scatter_in_medium, the same as scatter_path; else
//     advance_path      absorption, light met on the way, boundaries that do nothing; else on to
//     scatter_path      a light sample as a shadow ray, a new direction, Russian roulette
//     trace_shadow_ray
//   film_sample (backend)
//
// An intersector is any type with
//   bool intersect(const Ray&, const MediaState&, SceneHit&) const;  // nearest crossing with t in (t_min, t_max)
//   MediaState media_at(Vec3 point, float detail) const;             // which bodies hold a point; see Ray::detail
// and is asked for neither in generate_path nor in scatter_path, so that a backend may batch the stages as it likes.

namespace embrun {

/// Boundaries that a path may cross straight on before it counts as stuck.
inline constexpr int max_passes = 2000;

/// A light sample under way: adds `contribution` to the path's radiance as far as the ray gets through.
struct ShadowRay {
  Ray ray;
  MediaState media;
  Rgb contribution;
  float weight = 1;       ///< of multiple importance sampling, in `contribution`
  RandomStream random;    ///< for the transmittance of media
  bool straight = false;  ///< every interface is crossed straight on (see PathSettings::max_refractions)
};

// ---- generate ----------------------------------------------------------------------------------------------------

/// The path of one sample of pixel (x, y) of the full frame.
EMBRUN_LOCAL_FN PathState generate_path(const PathScene& scene, int x, int y, std::uint32_t sample) {
  PathState path;
  path.key.seed = scene.settings.seed;
  path.key.pixel =
      static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(scene.camera.width) + static_cast<std::uint32_t>(x);
  path.key.sample = sample;
  const SamplerKind kind = scene.settings.sampler;
  CameraSample numbers;
  numbers.film = sample_2d(kind, path.key, Dimension::camera_film);
  if (scene.camera.lens_radius > 0.0f) numbers.lens = sample_2d(kind, path.key, Dimension::camera_lens);
  if (scene.camera.shutter_close > scene.camera.shutter_open) numbers.time = sample_1d(kind, path.key, Dimension::time);
  path.ray = camera_ray(scene.camera, x, y, numbers);
  path.ray.detail = footprint_at_blocks(scene.detail, path.ray);
  path.throughput = grey(1.0f);
  path.media = scene.camera_media;
  path.alive = true;
  return path;
}

// ---- advance -----------------------------------------------------------------------------------------------------

/// True when the path goes through interfaces as if they were not there.
EMBRUN_FN bool goes_straight(const PathSettings& settings, const PathState& path) {
  return settings.max_refractions >= 0 && path.refractions >= settings.max_refractions;
}

/// Factor on the radiance seen across a boundary between two media, whether the ray is bent or not.
EMBRUN_FN float radiance_factor(const PathScene& scene, int from, int into) {
  return square(scene.media[from].ior / scene.media[into].ior);
}

/// Adds light that the path found at or after an event.
EMBRUN_FN void add_scattered_light(const PathScene& scene, PathState& path, Rgb light) {
  const float most = scene.settings.clamp;
  path.radiance += Rgb{min_of(light.r, most), min_of(light.g, most), min_of(light.b, most)};
}

/// Adds light that the path met.
EMBRUN_FN void add_light(const PathScene& scene, PathState& path, Rgb light) {
  if (path.depth > 0)
    add_scattered_light(scene, path, light);
  else
    path.radiance += light;
}

/// Share of light that the path met by following its direction, where light sampling would have drawn it with
/// `light_pdf`.
EMBRUN_FN float met_light_weight(const PathSettings& settings, const PathState& path, float light_pdf) {
  // Straight shadow rays brought it already.
  if (settings.straight_shadows && path.since == SinceLightSample::refracted && light_pdf > 0.0f) return 0.0f;
  if (path.scatter_pdf == 0.0f || settings.lights == LightStrategy::bsdf_only) return 1.0f;
  if (settings.lights == LightStrategy::lights_only) return light_pdf > 0.0f ? 0.0f : 1.0f;
  return power_heuristic(path.scatter_pdf, light_pdf);
}

/// True before the first event of a path that is not to see lights.
EMBRUN_FN bool sees_no_lights(const PathScene& scene, const PathState& path) {
  return scene.settings.hide_emitters && path.depth == 0;
}

/// The nearest lamp without geometry that the path meets on the ray.
EMBRUN_FN LightHit meet_lamp(const PathScene& scene, const PathState& path, const Ray& ray) {
  return sees_no_lights(scene, path) ? LightHit{} : intersect_lights(scene.lights, ray);
}

/// Ends a path that left the scene; its throughput is then that of light from infinity.
EMBRUN_FN void leave_scene(const PathScene& scene, PathState& path, PathCounters& counters) {
  path.alive = false;
  const int medium = path.media.current();
  // Every body is closed, so only a contradiction gets here from within one. It is taken for crossed.
  if (path.media.counts != 0) ++counters.contradictions;
  if (medium != 0) path.throughput *= radiance_factor(scene, medium, 0);
  if (path.has_normal && !path.has_albedo) path.albedo = grey(1.0f);
}

/// The path left the scene: adds the light from infinity and ends it.
EMBRUN_LOCAL_FN void escape(const PathScene& scene, PathState& path, PathCounters& counters) {
  leave_scene(scene, path, counters);
  if (sees_no_lights(scene, path)) return;
  const EscapedLight light = escaped_light(scene.lights, path.ray.direction);
  add_light(scene, path, path.throughput * light.radiance * met_light_weight(scene.settings, path, light.pdf));
}

/// Light of an emitter that the path met.
EMBRUN_FN void add_met_light(const PathScene& scene, PathState& path, const LightHit& light) {
  add_light(scene, path, path.throughput * light.radiance * met_light_weight(scene.settings, path, light.pdf));
}

/// A boundary as the media counters see it; class 0 (an opaque surface, a hole) is none.
EMBRUN_FN MediaBoundary boundary_of(const SceneHit& hit) { return {hit.media_class, hit.solid, hit.surface.entering}; }

/// The media behind a boundary as they are, once the path's own are put right if they contradict it.
template <class Intersector>
EMBRUN_LOCAL_FN MediaState media_behind(const Intersector& intersector, const Ray& ray, const SceneHit& hit,
                                        MediaState& media, PathCounters& counters) {
  const MediaBoundary boundary = boundary_of(hit);
  if (contradicts(media, boundary)) {
    ++counters.contradictions;
    const float back = dot(ray.direction, hit.surface.geometric_normal) < 0.0f ? hit.offset : -hit.offset;
    media = reconcile(intersector.media_at(hit.surface.position + back * hit.surface.geometric_normal, ray.detail),
                      boundary);
  }
  return cross_boundary(media, boundary);
}

/// Lets a ray that goes straight on start behind a crossing, its `passes`-th. One that rounding has put where the ray starts is
/// left behind by a little of the offset, and by more the longer that goes on: two sheets that meet could be crossed in
/// turn for ever.
EMBRUN_FN void go_on_behind(Ray& ray, const SceneHit& hit, int passes) {
  const float share = 0.1f * static_cast<float>(passes < 100 ? passes + 1 : 100);
  ray.t_min = hit.surface.t > ray.t_min ? hit.surface.t : ray.t_min + share * hit.offset;
}

/// True where a surface is not there for a ray that comes along `direction`.
EMBRUN_FN bool is_hole(const Material& material, const SceneHit& hit, Vec3 direction) {
  return material.kind == BsdfKind::null || (material.one_sided && dot(direction, hit.surface.geometric_normal) > 0.0f);
}

enum class Advance : std::uint8_t {
  ended,     ///< the path is over
  passed,    ///< nothing there that bends light: intersect on from where it is
  scatters,  ///< on to scatter_path
};

/// Takes the path through the surface that it met, if it goes straight on there; else Advance::scatters, and `behind`
/// receives the media beyond.
template <class Intersector>
EMBRUN_LOCAL_FN Advance pass_straight(const PathScene& scene, const Intersector& intersector, PathState& path,
                                      const SceneHit& hit, MediaState& behind, PathCounters& counters) {
  Ray& ray = path.ray;
  const Material& material = scene.materials[hit.material];
  bool passes = is_hole(material, hit, ray.direction) || (hit.light >= 0 && sees_no_lights(scene, path));
  behind = path.media;
  if (hit.media_class != 0) {
    behind = media_behind(intersector, ray, hit, path.media, counters);
    const int here = path.media.current(), beyond = behind.current();
    const bool matched = scene.media[here].ior == scene.media[beyond].ior;
    passes = passes || (is_interface(material.kind) && (matched || goes_straight(scene.settings, path)));
    if (passes && !matched) path.throughput *= radiance_factor(scene, here, beyond);
  }
  if (!passes) return Advance::scatters;
  path.media = behind;
  go_on_behind(ray, hit, path.passed);
  if (++path.passed <= max_passes) return Advance::passed;
  ++counters.stuck;
  path.alive = false;
  path.failed = true;
  return Advance::ended;
}

/// Takes the path to what its ray met: `found` and `hit` are the intersector's answer. `behind` receives the media
/// beyond the boundary for Advance::scatters.
template <class Intersector>
EMBRUN_LOCAL_FN Advance advance_path(const PathScene& scene, const Intersector& intersector, PathState& path,
                                     bool found, const SceneHit& hit, MediaState& behind, PathCounters& counters) {
  Ray& ray = path.ray;
  const float t_surface = found ? hit.surface.t : infinity;

  // Lamps without geometry are met first if they are nearer.
  Ray to_surface = ray;
  to_surface.t_max = t_surface;
  const LightHit lamp = meet_lamp(scene, path, to_surface);
  const float t = lamp.light >= 0 ? lamp.distance : t_surface;

  // Absorption on the way.
  if (t < infinity)
    path.throughput *= absorption_transmittance(scene.media[path.media.current()].absorption, t - ray.t_min);
  if (lamp.light >= 0) {
    add_met_light(scene, path, lamp);
    if (!path.has_normal) path.first_distance = t;
    path.alive = false;
    return Advance::ended;
  }
  if (!found) {
    escape(scene, path, counters);
    return Advance::ended;
  }

  const Advance straight = pass_straight(scene, intersector, path, hit, behind, counters);
  if (straight != Advance::scatters) return straight;
  if (hit.light >= 0)
    add_met_light(scene, path, emissive_shape_hit(scene.lights, hit.light, ray, t, hit.surface.geometric_normal));
  if (path.depth >= scene.settings.max_depth) {
    path.alive = false;
    return Advance::ended;
  }
  return Advance::scatters;
}

// ---- scatter -----------------------------------------------------------------------------------------------------

/// What a path meets at a surface, ready to scatter.
struct SurfaceEvent {
  Bsdf bsdf;
  SurfaceNormals normals;
  Vec3 wo;                ///< unit, to where the path came from
  bool specular = false;  ///< scatters into single directions only
};

/// Begins the path's next event, at the hit that advance_path took it to, and notes the features of the picture.
EMBRUN_LOCAL_FN SurfaceEvent meet_surface(const PathScene& scene, PathState& path, const SceneHit& hit,
                                          const MediaState& behind) {
  SurfaceEvent event;
  event.wo = -path.ray.direction;
  event.normals = {hit.surface.geometric_normal, hit.surface.shading_normal};
  const bool from_front = dot(event.wo, event.normals.geometric) >= 0.0f;
  const float relative_index = scene.media[behind.current()].ior / scene.media[path.media.current()].ior;
  event.bsdf = bsdf_at(material_seen(scene.materials, hit.material, from_front),
                       {hit.surface.position, hit.uv, hit.tangent, hit.surface.color}, from_front, relative_index);
  event.specular = is_specular(event.bsdf);
  path.key.bounce = static_cast<std::uint32_t>(path.depth) + 1;
  if (!path.has_normal) {
    path.has_normal = true;
    path.first_distance = hit.surface.t;
    path.first_normal = from_front ? event.normals.shading : -event.normals.shading;
  }
  if (!path.has_albedo && !event.specular) {
    path.has_albedo = true;
    path.albedo = albedo_of(event.bsdf);
  }
  return event;
}

/// A point off the surface on the side that `direction` leads to.
EMBRUN_FN Vec3 leave_surface(const SceneHit& hit, Vec3 direction) {
  const float side = dot(direction, hit.surface.geometric_normal) < 0.0f ? -hit.offset : hit.offset;
  return hit.surface.position + side * hit.surface.geometric_normal;
}

/// What a ray along `direction` knows of the surface that it leaves.
EMBRUN_FN Clearance leaving_clearance(const SceneHit& hit, Vec3 direction) {
  if (hit.fluid >= 0) return clearance_after(hit.surface, direction, hit.fluid);
  return hit.splats >= 0 ? clearance_of_splats(hit.surface, hit.splats) : Clearance{};
}

/// The table that guides directions at a point of the path, or null: diffuse surfaces alone have one.
EMBRUN_FN const Distribution2D* guide_of(const PathScene& scene, const PathState& path, const Bsdf& bsdf) {
  if (!(scene.guide.share > 0.0f) || bsdf.kind != BsdfKind::diffuse) return nullptr;
  return &scene.guide.cells[path.media.counts != 0 ? 1 : 0];
}

/// Density with which sample_direction draws `wi`, where the surface's own choice has density `own_pdf`.
EMBRUN_FN float direction_pdf(const PathScene& scene, const Distribution2D* guide, float own_pdf, Vec3 wi) {
  if (guide == nullptr) return own_pdf;
  return (1.0f - scene.guide.share) * own_pdf + scene.guide.share * guide_pdf(*guide, wi);
}

/// As sample_bsdf, some of the directions being drawn from the guide if there is one.
EMBRUN_LOCAL_FN BsdfSample sample_direction(const PathScene& scene, PathState& path, const Bsdf& bsdf,
                                            const SurfaceNormals& normals, Vec3 wo) {
  const SamplerKind kind = scene.settings.sampler;
  const Distribution2D* guide = guide_of(scene, path, bsdf);
  const bool chooses = bsdf.kind != BsdfKind::diffuse || guide != nullptr;
  const float u_lobe = chooses ? sample_1d(kind, path.key, Dimension::bsdf_lobe) : 0.0f;
  const Sample2 u = is_specular(bsdf) ? Sample2{} : sample_2d(kind, path.key, Dimension::bsdf_direction);
  if (guide == nullptr) return sample_bsdf(bsdf, normals, wo, u_lobe, u);

  BsdfSample next;
  if (u_lobe < scene.guide.share) {
    next.wi = sample_guide(*guide, u);
    next.pdf = pdf_bsdf(bsdf, normals, wo, next.wi);
    next.weight = bsdf.reflectance;
    next.valid = next.pdf > 0.0f;  // not for directions under the surface
  } else {
    next = sample_bsdf(bsdf, normals, wo, 0.0f, u);
  }
  if (!next.valid) return next;
  const float pdf = direction_pdf(scene, guide, next.pdf, next.wi);
  path.guide_factor *= next.pdf / pdf;
  next.weight *= next.pdf / pdf;
  next.pdf = pdf;
  return next;
}

/// Notes what the event that the path goes on from means for light that it meets next.
EMBRUN_FN void note_event(const PathSettings& settings, PathState& path, bool specular, bool transmitted) {
  if (!specular) {
    path.since = settings.lights == LightStrategy::bsdf_only ? SinceLightSample::none : SinceLightSample::nothing;
  } else if (path.since != SinceLightSample::none && path.since != SinceLightSample::reflected) {
    path.since = transmitted ? SinceLightSample::refracted : SinceLightSample::reflected;
  }
}

/// Draws light for a point; not valid where there is none.
EMBRUN_LOCAL_FN LightSample draw_light(const PathScene& scene, const PathState& path, Vec3 point) {
  const PathSettings& settings = scene.settings;
  if (settings.lights == LightStrategy::bsdf_only || scene.lights.count == 0) return {};
  LightSample light = sample_lights(scene.lights, point, sample_1d(settings.sampler, path.key, Dimension::light_choice),
                                    sample_2d(settings.sampler, path.key, Dimension::light_position));
  light.valid = light.valid && light.pdf > 0.0f;
  return light;
}

/// Sends the shadow ray of a light sample from `origin`, in `media`. `value` per steradian is what the path's event makes of
/// the light, `other_pdf` the density with which it would have drawn that direction itself. False: nothing can arrive.
EMBRUN_LOCAL_FN bool start_shadow_ray(const PathScene& scene, const PathState& path, const LightSample& light,
                                      Vec3 origin, const MediaState& media, Rgb value, float other_pdf,
                                      ShadowRay& shadow) {
  const PathSettings& settings = scene.settings;
  shadow.straight = goes_straight(settings, path);
  // No light from infinity gets into a refracting medium but by refraction, which shadow rays don't do.
  const bool enclosed = scene.media[media.current()].ior != scene.media[0].ior;
  if (enclosed && !shadow.straight && !settings.straight_shadows && !(light.distance < infinity)) return false;
  // Nothing else finds lights without extent.
  shadow.weight = settings.lights == LightStrategy::mis && !light.delta ? power_heuristic(light.pdf, other_pdf) : 1.0f;
  shadow.contribution = path.throughput * value * light.radiance * (shadow.weight / light.pdf);
  shadow.media = media;
  shadow.random = RandomStream(path.key, Dimension::shadow_tracking);
  shadow.ray = path.ray;
  shadow.ray.cone_width += path.ray.cone_spread * length(origin - path.ray.origin);
  if (!light.delta) shadow.ray.cone_spread = max_of(path.ray.cone_spread, spread_of_density(light.pdf));
  shadow.ray.origin = origin;
  shadow.ray.direction = light.direction;
  shadow.ray.clearance = {};
  shadow.ray.t_min = 0.0f;
  // Stops short of a lamp, which is not in its own way.
  shadow.ray.t_max = light.delta ? light.distance : light.distance * (1.0f - 1e-4f);
  return !is_black(shadow.contribution);
}

/// Fills in the ray that finds out whether light drawn for leave_surface(hit, event.wo) arrives at the event. `behind` are
/// the media across the surface. `alone`: nothing else than light samples finds this light. False: it does not arrive.
EMBRUN_LOCAL_FN bool light_surface(const PathScene& scene, const PathState& path, const SceneHit& hit,
                                   const SurfaceEvent& event, const MediaState& behind, const LightSample& light,
                                   bool alone, ShadowRay& shadow) {
  if (!light.valid) return false;
  const Vec3 geometric = event.normals.geometric;
  const BsdfValue scatter = evaluate_bsdf(event.bsdf, event.normals, event.wo, light.direction);
  if (!(scatter.pdf > 0.0f)) return false;
  // Rough glass is lit from across as well.
  const bool across = dot(event.wo, geometric) * dot(light.direction, geometric) < 0.0f;
  const float other_pdf =
      alone ? 0.0f : direction_pdf(scene, guide_of(scene, path, event.bsdf), scatter.pdf, light.direction);
  const bool started = start_shadow_ray(scene, path, light, leave_surface(hit, across ? light.direction : event.wo),
                                        across ? behind : path.media, scatter.value, other_pdf, shadow);
  if (hit.splats >= 0) shadow.ray.clearance = clearance_of_splats(hit.surface, hit.splats);
  return started;
}

/// Russian roulette: a path goes on with the probability that its light counts in the picture, freed of the
/// factor that refraction puts on radiance (in water the throughput is smaller by n^2, the light larger).
EMBRUN_FN void play_roulette(const PathScene& scene, PathState& path) {
  if (path.depth < scene.settings.roulette_depth) return;
  const float share =
      max_component(path.throughput) * radiance_factor(scene, path.media.current(), 0) / path.guide_factor;
  if (!(share < 1.0f)) return;
  const float survival = max_of(share, 0.02f);
  if (sample_1d(scene.settings.sampler, path.key, Dimension::roulette) >= survival)
    path.alive = false;
  else
    path.throughput *= 1.0f / survival;
}

/// Sends the path on from an event in the direction of a sample of its bsdf, or ends it.
EMBRUN_LOCAL_FN void follow_sample(const PathScene& scene, PathState& path, const SceneHit& hit,
                                   const SurfaceEvent& event, const BsdfSample& next, const MediaState& behind,
                                   PathCounters& counters) {
  counters.bends += next.bent;
  ++counters.scatterings;
  if (!next.valid || is_black(next.weight)) {
    path.alive = false;
    return;
  }

  path.throughput *= next.weight;
  path.scatter_pdf = next.specular ? 0.0f : next.pdf;
  path.left_medium = false;
  // Straight shadow rays cross smooth interfaces alone.
  note_event(scene.settings, path, next.specular, next.transmitted && event.bsdf.kind == BsdfKind::dielectric);
  path.ray.cone_width += path.ray.cone_spread * hit.surface.t;
  if (!next.specular) path.ray.cone_spread = max_of(path.ray.cone_spread, spread_of_density(next.pdf));
  path.ray.origin = leave_surface(hit, next.wi);
  path.ray.direction = next.wi;
  path.ray.clearance = leaving_clearance(hit, next.wi);
  path.ray.t_min = 0.0f;
  path.ray.t_max = infinity;
  path.passed = 0;
  ++path.depth;
  if (next.transmitted) {
    path.media = behind;
    ++path.refractions;
  }
  play_roulette(scene, path);
}

/// Sends the path on from an event in a new direction, or ends it.
EMBRUN_LOCAL_FN void bounce_path(const PathScene& scene, PathState& path, const SceneHit& hit,
                                 const SurfaceEvent& event, const MediaState& behind, PathCounters& counters) {
  const BsdfSample next = sample_direction(scene, path, event.bsdf, event.normals, event.wo);
  follow_sample(scene, path, hit, event, next, behind, counters);
}

/// Samples light at an event of a surface. True when `shadow` is to be traced.
EMBRUN_LOCAL_FN bool light_event(const PathScene& scene, const PathState& path, const SceneHit& hit,
                                 const SurfaceEvent& event, const MediaState& behind, ShadowRay& shadow) {
  return !event.specular && light_surface(scene, path, hit, event, behind,
                                          draw_light(scene, path, leave_surface(hit, event.wo)), false, shadow);
}

/// Scatters the path at the hit that advance_path took it to. True when `shadow` is to be traced.
EMBRUN_LOCAL_FN bool scatter_path(const PathScene& scene, PathState& path, const SceneHit& hit,
                                  const MediaState& behind, ShadowRay& shadow, PathCounters& counters) {
  const SurfaceEvent event = meet_surface(scene, path, hit, behind);
  const bool lit = light_event(scene, path, hit, event, behind, shadow);
  bounce_path(scene, path, hit, event, behind, counters);
  return lit;
}

// ---- shadow ------------------------------------------------------------------------------------------------------

/// What a boundary lets through of a shadow ray's light, which goes straight on into the media `behind` it. Interfaces block
/// it but where PathSettings::straight_shadows has them let through what Fresnel's formulas say; as then no other way of
/// finding this light counts, the weight that allowed for one is taken back at the first of them (`crossed`).
EMBRUN_LOCAL_FN Rgb cross_in_shadow(const PathScene& scene, const ShadowRay& shadow, const SceneHit& hit,
                                    const MediaState& behind, bool& crossed) {
  const Material& material = scene.materials[hit.material];
  const bool hole = is_hole(material, hit, shadow.ray.direction);
  if (hit.media_class == 0) return grey(hole ? 1.0f : 0.0f);
  const int here = shadow.media.current(), beyond = behind.current();
  const float relative_index = scene.media[beyond].ior / scene.media[here].ior;
  if (relative_index == 1.0f && (hole || is_interface(material.kind))) return grey(1.0f);
  const Rgb factor = grey(radiance_factor(scene, here, beyond));
  if (hole || (shadow.straight && is_interface(material.kind))) return factor;
  // Rough ones are lit by light samples of their own.
  if (!scene.settings.straight_shadows || material.kind != BsdfKind::dielectric) return {};
  // As the light meets it, and as a flux: refraction packs what gets through a flat surface into a smaller solid angle and
  // raises its radiance by as much, so that the irradiance behind is what it would be without either.
  const float cosine = fabsf(dot(shadow.ray.direction, hit.surface.shading_normal));
  const float through = 1.0f - fresnel_dielectric(min_of(cosine, 1.0f), 1.0f / relative_index).reflectance;
  const float weight = crossed ? 1.0f : 1.0f / shadow.weight;
  crossed = true;
  const Rgb tint = material.parameters ? material.constants.specular_transmittance : grey(1.0f);
  return tint * (through * weight);
}

/// What gets through of a shadow ray's light: 0 behind anything opaque or refracting (unless interfaces are crossed straight
/// on); index-matched boundaries let it pass, media on the way absorb and scatter.
template <class Intersector>
EMBRUN_LOCAL_FN Rgb trace_shadow_ray(const PathScene& scene, const Intersector& intersector, ShadowRay& shadow,
                                     PathCounters& counters) {
  Ray& ray = shadow.ray;
  const Ray whole = ray;
  Rgb light = shadow.contribution;
  bool crossed = false;
  if (intersect_lights(scene.lights, whole).light >= 0) return {};
  for (int passes = 0; passes <= max_passes; ++passes) {
    ++counters.shadow.rays;
    SceneHit hit;
    const bool found = intersector.intersect(ray, shadow.media, hit);
    const float t = found ? hit.surface.t : ray.t_max;
    MediaState behind = shadow.media;
    Rgb boundary = grey(1.0f);
    if (found) {
      if (hit.media_class != 0) behind = media_behind(intersector, ray, hit, shadow.media, counters);
      boundary = cross_in_shadow(scene, shadow, hit, behind, crossed);
      if (is_black(boundary)) return {};
    } else if (shadow.media.current() != 0 && !(t < infinity)) {
      // From within a body to infinity: the same contradiction, taken the same way, as in escape().
      boundary = grey(radiance_factor(scene, shadow.media.current(), 0));
    }
    light *= boundary * stretch_transmittance(scene, shadow.media, ray, t, shadow.random, counters);
    if (!found || is_black(light)) return light;
    shadow.media = behind;
    go_on_behind(ray, hit, passes);
  }
  ++counters.stuck;
  return {};
}

}  // namespace embrun

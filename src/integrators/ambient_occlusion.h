#pragma once

#include "integrators/path_stages.h"

// Ambient occlusion [Zhukov1998]: of the surface that is seen, whatever it is made of, the share of the hemisphere above it,
// weighted by the cosine, in which no surface is within a distance. That is what a white surface would reflect in
// surroundings of radiance 1, if all else were black. Water, glass and mirrors are surfaces like all others; boundaries that
// do not bend light, and media, are not there. Surfaces that shine are white and hide nothing: light comes from them.
//
//   generate_path
//   repeat while alive:
//     (the intersector finds the next crossing)
//     advance_unlit         holes, boundaries that do nothing; surroundings end the path; else on to
//     start_occlusion_ray, trace_occlusion_ray    and the path is over

namespace embrun {

/// Takes the path to the surface that its ray met, or through it if it is not there: `found` and `hit` are the intersector's
/// answer. `behind` receives the media beyond.
template <class Intersector>
EMBRUN_LOCAL_FN Advance advance_unlit(const PathScene& scene, const Intersector& intersector, PathState& path,
                                      bool found, const SceneHit& hit, MediaState& behind, PathCounters& counters) {
  if (found) return pass_straight(scene, intersector, path, hit, behind, counters);
  leave_scene(scene, path, counters);
  path.radiance = grey(1.0f);
  return Advance::ended;
}

/// A direction above the surface, drawn by the cosine to its shading normal. One that this normal sends under the true
/// surface is mirrored to above it: nothing is lost, so a body without hollows is white, however crooked its normals.
EMBRUN_LOCAL_FN Vec3 occlusion_direction(const SurfaceNormals& surface, Vec3 wo, Sample2 u, bool& bent) {
  const FacingNormals normals = face_towards(surface, wo);
  const Vec3 wi = normalize(Frame(normals.shading).to_world(sample_cosine_hemisphere(u)));
  const float above = dot(wi, normals.geometric);
  bent = normals.bent || above < 0.0f;
  return above < 0.0f ? normalize(wi - (2.0f * above) * normals.geometric) : wi;
}

/// Ends the path at the surface that advance_unlit took it to, and notes the features of the picture. True when `shadow` is to
/// be traced.
EMBRUN_LOCAL_FN bool start_occlusion_ray(const PathScene& scene, PathState& path, const SceneHit& hit,
                                         const MediaState& behind, ShadowRay& shadow, PathCounters& counters) {
  const SurfaceEvent event = meet_surface(scene, path, hit, behind);
  path.albedo = grey(1.0f);
  path.alive = false;
  ++counters.scatterings;
  if (hit.light >= 0) {
    path.radiance = grey(1.0f);
    return false;
  }
  bool bent = false;
  const Vec3 wi = occlusion_direction(event.normals, event.wo,
                                      sample_2d(scene.settings.sampler, path.key, Dimension::bsdf_direction), bent);
  counters.bends += bent;
  shadow.media = path.media;
  shadow.contribution = grey(1.0f);
  shadow.ray = path.ray;
  shadow.ray.origin = leave_surface(hit, wi);
  shadow.ray.direction = wi;
  shadow.ray.clearance = leaving_clearance(hit, wi);
  shadow.ray.t_min = 0.0f;
  shadow.ray.t_max = scene.settings.occlusion_distance;
  return true;
}

/// The ray's contribution, or black where it meets a surface that does not shine.
template <class Intersector>
EMBRUN_LOCAL_FN Rgb trace_occlusion_ray(const PathScene& scene, const Intersector& intersector, ShadowRay& shadow,
                                        PathCounters& counters) {
  for (int passes = 0; passes <= max_passes; ++passes) {
    ++counters.shadow.rays;
    SceneHit hit;
    if (!intersector.intersect(shadow.ray, shadow.media, hit)) return shadow.contribution;
    const Material& material = scene.materials[hit.material];
    bool there = !is_hole(material, hit, shadow.ray.direction);
    if (there && hit.light >= 0) return shadow.contribution;
    MediaState behind = shadow.media;
    if (hit.media_class != 0) {
      behind = media_behind(intersector, shadow.ray, hit, shadow.media, counters);
      const bool matched = scene.media[shadow.media.current()].ior == scene.media[behind.current()].ior;
      there = there && !(matched && is_interface(material.kind));
    }
    if (there) return {};
    shadow.media = behind;
    go_on_behind(shadow.ray, hit, passes);
  }
  ++counters.stuck;
  return {};
}

}  // namespace embrun

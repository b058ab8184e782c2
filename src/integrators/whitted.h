#pragma once

#include "integrators/medium_scatter.h"
#include "integrators/path_stages.h"

// Whitted's ray tracing [Whitted1980] by the path tracer's stages: what reflects or refracts into single directions is
// followed, and where light scatters in any other way (at matt and glossy surfaces, in media) every light is sampled once
// and the path ends. No light gets to a surface by way of another one that is not a mirror.
//
//   generate_path
//   repeat while alive:
//     (the intersector finds the next crossing)
//     begin_flight, fly_path    as in path tracing: a collision leads to meet_collision; else
//     advance_path              on to
//     meet_surface
//     for each light: draw_light_of, light_surface or light_collision, trace_shadow_ray
//     follow_mirror
//
// A path is one way through Whitted's tree of rays: at glass it follows either the reflected or the refracted ray, drawn by
// Fresnel's share, so that the mean over the samples is the tree's sum. His lights are points; those with an extent are
// sampled over it, so that their shadows are soft.

namespace embrun {

/// Draws light from one light for a point, from lights[index]; not valid where none comes from there.
EMBRUN_LOCAL_FN LightSample draw_light_of(const PathScene& scene, const PathState& path, int index, Vec3 point) {
  // The lights of one point have numbers of their own each.
  SampleKey key = path.key;
  key.seed ^= static_cast<std::uint32_t>(index) * 0x9e3779b9u;
  LightSample light =
      sample_light_of(scene.lights, index, point, sample_2d(scene.settings.sampler, key, Dimension::light_position));
  light.valid = light.valid && light.pdf > 0.0f;
  return light;
}

/// Goes on from a surface in a single direction, or ends the path there.
EMBRUN_LOCAL_FN void follow_mirror(const PathScene& scene, PathState& path, const SceneHit& hit,
                                   const SurfaceEvent& event, const MediaState& behind, PathCounters& counters) {
  bounce_path(scene, path, hit, event, behind, counters);
  // Of a surface that does both, such as plastic, the choice of what is matt ends it.
  if (path.scatter_pdf != 0.0f) path.alive = false;
}

}  // namespace embrun

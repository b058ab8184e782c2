#pragma once

#include "integrators/path_stages.h"

// The rendering equation by Gauss's quadrature instead of chance, which the thesis [Beddiaf2018] tried and left: the path
// tracer, but for the direction in which a path leaves its first event that is not specular. If that is at a diffuse
// surface, the pixel's samples take the nodes of a rule of the hemisphere (sampling/gauss_rule.h) there, one each in turn,
// the same in every pixel: what the rule gets wrong comes out as bands, not as noise. Glossy surfaces and media have no such
// rule, and there, as on all the rest of the way, paths are as in path tracing:
//
//   generate_path
//   repeat while alive:
//     (the intersector finds the next crossing)
//     begin_flight, sample_on_the_way, fly_path, scatter_in_medium    as in path tracing; or
//     advance_path          on to
//     scatter_by_rule       in place of scatter_path
//     trace_shadow_ray
//
// Light is sampled at that event as well. The weights of multiple importance sampling are those of a direction drawn by the
// cosine, of whose density the nodes are the counterpart: with them, sampled light and the rule's integrand add up to the
// whole, so that there is no error but the rule's own.

namespace embrun {

/// As scatter_path.
EMBRUN_LOCAL_FN bool scatter_by_rule(const PathScene& scene, PathState& path, const SceneHit& hit,
                                     const MediaState& behind, ShadowRay& shadow, PathCounters& counters) {
  // An event that is not specular gives the path its albedo.
  const bool first = !path.has_albedo;
  const SurfaceEvent event = meet_surface(scene, path, hit, behind);
  const bool lit = light_event(scene, path, hit, event, behind, shadow);
  if (first && event.bsdf.kind == BsdfKind::diffuse) {
    const HemisphereNode& node = scene.rule.node_of(path.key.sample);
    BsdfSample next = diffuse_sample(event.bsdf, face_towards(event.normals, event.wo), node.direction);
    next.weight *= node.weight;
    follow_sample(scene, path, hit, event, next, behind, counters);
  } else {
    bounce_path(scene, path, hit, event, behind, counters);
  }
  return lit;
}

}  // namespace embrun

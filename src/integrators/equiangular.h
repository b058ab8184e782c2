#pragma once

#include "integrators/path_scene.h"
#include "sampling/distribution.h"

// Light that a medium scatters towards the path on its way, sampled by where the light is: free flights find the bright
// surroundings of a small lamp by chance alone. Points are drawn on the ray with a density that falls with the squared
// distance from the lamp's middle, so that they are seen from there under all angles alike [Kulla2012].
//
// Both ways of getting to a point, this and the flight, share its light by the balance heuristic. The density of flights at a
// point is not known, but any weights do that depend on the point alone and add up to 1, so a flight in a medium of the mean
// extinction stands for it.

namespace embrun {

/// A stretch of a ray as a lamp sees it.
struct LampView {
  float nearest = 0, distance = 0;  ///< where the ray comes nearest to the lamp's middle, and how near
  float begin = 0, end = 0;         ///< of the stretch; ray parameters
  float low = 0, high = 0;          ///< angles under which its ends are seen
  bool useful = false;              ///< false: the lamp is far from the stretch, or everywhere

  EMBRUN_FN float draw(float u) const { return clamp(nearest + distance * tanf(low + u * (high - low)), begin, end); }
  /// Per metre.
  EMBRUN_FN float pdf(float t) const { return distance / ((high - low) * (square(distance) + square(t - nearest))); }
};

/// The middle of a lamp and how far it reaches from there. False for lights that are no lamp at one place.
EMBRUN_FN bool lamp_middle(const Light& light, Vec3& middle, float& reach) {
  switch (light.kind) {
    case LightKind::rectangle:
      middle = light.position + 0.5f * (light.edge_u + light.edge_v);
      reach = 0.5f * length(light.edge_u + light.edge_v);
      return true;
    case LightKind::disk:
    case LightKind::sphere:
    case LightKind::point:
      middle = light.position;
      reach = light.radius;
      return true;
    case LightKind::cylinder:
      middle = light.position + 0.5f * light.edge_u;
      reach = 0.5f * length(light.edge_u) + light.radius;
      return true;
    case LightKind::environment:
    case LightKind::distant:
    case LightKind::directional:
    case LightKind::triangles: break;
  }
  return false;
}

/// The stretch of a ray up to `end` (which may be infinite) as a light sees it. `fluids`: the particles that count on it;
/// `everywhere`: what is between them scatters, too.
EMBRUN_LOCAL_FN LampView view_from_lamp(const PathScene& scene, const Light& light, const Ray& ray, float end,
                                        bool everywhere) {
  LampView view;
  Vec3 middle;
  float reach = 0.0f;
  if (!lamp_middle(light, middle, reach)) return view;
  view.begin = ray.t_min;
  view.end = end;
  if (!everywhere) {
    // Particles are only in their grid.
    const CellGrid& grid = scene.density.grid;
    const Vec3 high = grid.high();
    for (int axis = 0; axis < 3; ++axis) {
      const float d = ray.direction[axis];
      if (d == 0.0f) continue;
      const float a = (grid.low[axis] - ray.origin[axis]) / d, b = (high[axis] - ray.origin[axis]) / d;
      view.begin = max_of(view.begin, min_of(a, b));
      view.end = min_of(view.end, max_of(a, b));
    }
  }
  if (!(view.begin < view.end) || !(view.end < infinity)) return view;
  view.nearest = dot(middle - ray.origin, ray.direction);
  // Inside the lamp nothing is lit, so points are not crowded there.
  view.distance = max_of(length(middle - ray.origin - view.nearest * ray.direction),
                         max_of(reach, 1e-5f * (view.end - view.begin)));
  view.low = atanf((view.begin - view.nearest) / view.distance);
  view.high = atanf((view.end - view.nearest) / view.distance);
  // From far off the whole stretch is seen alike: there is nothing to gain.
  view.useful = view.high - view.low > 0.5f;
  return view;
}

/// Share of the light at ray parameter `t` of the stretch that these points bring; the flights' is the rest. `extinction`: the
/// mean one on the stretch, per metre.
EMBRUN_FN float lamp_share(const LampView& view, float t, float begin, float extinction) {
  if (!view.useful || t < view.begin || t > view.end) return 0.0f;
  const float own = view.pdf(t), flights = extinction * expf(-extinction * (t - begin));
  return own / (own + flights);
}

}  // namespace embrun

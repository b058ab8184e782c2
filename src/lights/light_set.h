#pragma once

#include "lights/area_light.h"
#include "lights/environment.h"

namespace embrun {

/// All the lights of a scene, as a view of arrays that a LightSetBuilder owns.
struct LightSet {
  const Light* lights = nullptr;
  int count = 0;
  Distribution1D choice;  ///< which light to sample, in proportion to power
  const LightTriangle* triangles = nullptr;
  const float* triangle_cdf = nullptr;
  Environment environment;
  int environment_index = -1;  ///< of the light that stands for the environment; -1: there is none
};

/// What a ray that leaves the scene sees, and the density with which sample_lights draws its direction.
struct EscapedLight {
  Rgb radiance;
  float pdf = 0;  ///< per steradian
};

/// A ray's nearest meeting with an area light that is not part of the scene's geometry.
struct LightHit {
  int light = -1;  ///< -1: none
  float distance = infinity;
  Rgb radiance;   ///< towards the ray's origin; 0 from behind a one-sided light, which is opaque there
  float pdf = 0;  ///< per steradian: of sample_lights for this direction and light
};

/// Draws light from one light, set.lights[index], towards `point`. The pdf is 1 for lights without extent.
/// Directions behind a one-sided light and lights of radiance 0 give samples that are not valid.
EMBRUN_LOCAL_FN LightSample sample_light_of(const LightSet& set, int index, Vec3 point, Sample2 u) {
  const Light& light = set.lights[index];
  LightSample s;
  switch (light.kind) {
    case LightKind::environment: s = sample_environment(set.environment, u); break;
    case LightKind::distant:
      s.direction = normalize(Frame(light.normal).to_world(sample_cone(u, light.one_minus_cos)));
      s.distance = infinity;
      s.radiance = light.radiance;
      s.pdf = cone_pdf(light.one_minus_cos);
      s.valid = true;
      break;
    case LightKind::rectangle:
      s = flat_light_sample(light, point, light.position + light.edge_u * u.x + light.edge_v * u.y, light.normal);
      break;
    case LightKind::disk: {
      const Sample2 d = sample_disk(u);
      const Frame frame(light.normal);
      s = flat_light_sample(light, point, light.position + (frame.s * d.x + frame.t * d.y) * light.radius,
                            light.normal);
      break;
    }
    case LightKind::sphere: s = sample_sphere_light(light, point, u); break;
    case LightKind::point: s = sample_point_light(light, point); break;
    case LightKind::directional:
      s = {light.normal, infinity, light.radiance, 1.0f, true, !is_black(light.radiance)};
      break;
    case LightKind::cylinder: {
      const Vec3 out = Frame(normalize(light.edge_u)).to_world({cosf(2.0f * pi * u.y), sinf(2.0f * pi * u.y), 0.0f});
      s = flat_light_sample(light, point, light.position + light.edge_u * u.x + out * light.radius, out);
      break;
    }
    case LightKind::triangles: {
      const Distribution1D by_area{set.triangle_cdf + light.first_cdf, light.triangle_count};
      const DiscreteSample pick = sample_discrete(by_area, u.x);
      const LightTriangle& tri = set.triangles[light.first_triangle + pick.index];
      const Sample2 b = sample_triangle({pick.remainder, u.y});
      const Vec3 target = tri.vertex + tri.edge_1 * b.x + tri.edge_2 * b.y;
      s = flat_light_sample(light, point, target, normalize(cross(tri.edge_1, tri.edge_2)));
      break;
    }
  }
  return s;
}

/// Draws one light in proportion to its power, then light from it as sample_light_of does. The pdf includes the choice (and
/// is nothing but the choice for lights without extent).
EMBRUN_LOCAL_FN LightSample sample_lights(const LightSet& set, Vec3 point, float u_choice, Sample2 u) {
  if (set.count == 0) return {};
  const DiscreteSample chosen = sample_discrete(set.choice, u_choice);
  LightSample s = sample_light_of(set, chosen.index, point, u);
  s.pdf *= chosen.probability;
  return s;
}

/// Light from infinity along an escaped ray: the environment and every distant light that covers `direction`.
/// The pdf sums over all lights that could have drawn the direction, as the balance heuristic wants it.
EMBRUN_LOCAL_FN EscapedLight escaped_light(const LightSet& set, Vec3 direction) {
  EscapedLight result;
  for (int i = 0; i < set.count; ++i) {
    const Light& light = set.lights[i];
    if (light.kind == LightKind::environment) {
      result.radiance += environment_radiance(set.environment, direction);
      result.pdf += probability_of(set.choice, i) * environment_pdf(set.environment, direction);
    } else if (light.kind == LightKind::distant) {
      // |d - n|^2 = 2 (1 - cos) keeps its precision for a narrow cone.
      if (0.5f * length_squared(direction - light.normal) > light.one_minus_cos) continue;
      result.radiance += light.radiance;
      result.pdf += probability_of(set.choice, i) * cone_pdf(light.one_minus_cos);
    }
  }
  return result;
}

/// Nearest light on the ray within its extent that is not part of the scene. These lights are opaque and belong to no
/// geometry, so every ray has to be tested, shadow rays too.
EMBRUN_LOCAL_FN LightHit intersect_lights(const LightSet& set, const Ray& ray) {
  LightHit hit;
  for (int i = 0; i < set.count; ++i) {
    if (set.lights[i].in_scene) continue;
    const EmitterHit found = intersect_area_light(set.lights[i], ray);
    if (!(found.distance < hit.distance)) continue;
    hit.light = i;
    hit.distance = found.distance;
    hit.radiance = emitted_radiance(set.lights[i], found.normal, ray.direction);
    hit.pdf = probability_of(set.choice, i) *
              area_light_pdf(set.lights[i], ray.origin, ray.direction, found.distance, found.normal);
  }
  return hit;
}

/// The same for a hit that the scene's own intersector found on a shape that is light `index`.
EMBRUN_FN LightHit emissive_shape_hit(const LightSet& set, int index, const Ray& ray, float distance, Vec3 normal) {
  const Light& light = set.lights[index];
  return {index, distance, emitted_radiance(light, normal, ray.direction),
          probability_of(set.choice, index) * area_light_pdf(light, ray.origin, ray.direction, distance, normal)};
}

}  // namespace embrun

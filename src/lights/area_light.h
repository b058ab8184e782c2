#pragma once

#include <cstdint>

#include "lights/light_sample.h"
#include "math/ray.h"
#include "sampling/distribution.h"
#include "sampling/warp.h"

namespace embrun {

enum class LightKind : uint8_t {
  environment,  ///< light from infinity; its data is LightSet::environment
  distant,      ///< uniform cone of directions from infinity: a sun
  rectangle,
  disk,
  sphere,       ///< emits outwards
  triangles,    ///< of a mesh
  cylinder,     ///< the side of one, emits outwards
  point,        ///< without extent, the same in all directions
  directional,  ///< without extent, from infinity: one direction
};

struct LightTriangle {
  Vec3 vertex, edge_1, edge_2;
};

/// One light. Rectangles span position + [0,1] edge_u + [0,1] edge_v (perpendicular edges) and emit to the side of
/// cross(edge_u, edge_v); disks emit to the side of `normal`; `two_sided` to both. Made by the make_ functions below.
/// Those that are part of the scene's geometry are met there: intersect_lights leaves them out.
struct Light {
  LightKind kind = LightKind::environment;
  bool two_sided = false;
  bool in_scene = false;    ///< the shape is part of the scene's geometry
  Rgb radiance;             ///< emitted, the same in every direction; see the kinds without extent
  Vec3 position;            ///< corner of a rectangle, centre of a disk or sphere, start of a cylinder's axis, a point
  Vec3 edge_u, edge_v;      ///< of a rectangle; edge_u: axis of a cylinder, of its length
  Vec3 normal;              ///< unit: emitting side; of a distant or directional light, the direction towards it
  float radius = 0;         ///< of a disk, sphere or cylinder
  float area = 0;           ///< m^2 of emitting surface, one side
  float one_minus_cos = 0;  ///< of a distant light's half angle
  int first_triangle = 0;   ///< into LightSet::triangles
  int triangle_count = 0;
  int first_cdf = 0;  ///< into LightSet::triangle_cdf: triangle_count + 1 entries, by area
};

/// `towards` points to the light; `half_angle` in radians, in (0, pi/2].
Light make_distant_light(Vec3 towards, float half_angle, Rgb radiance);
Light make_rectangle_light(Vec3 corner, Vec3 edge_u, Vec3 edge_v, Rgb radiance, bool two_sided = false);
Light make_disk_light(Vec3 centre, Vec3 normal, float radius, Rgb radiance, bool two_sided = false);
Light make_sphere_light(Vec3 centre, float radius, Rgb radiance);
/// The side from `start` to `start + axis`; always in the scene.
Light make_cylinder_light(Vec3 start, Vec3 axis, float radius, Rgb radiance);

/// Sends `intensity` (power per steradian) into every direction. Light::radiance holds it.
Light make_point_light(Vec3 position, Rgb intensity);
/// Parallel light of `irradiance` on a surface that faces it. Light::radiance holds it.
Light make_directional_light(Vec3 towards, Rgb irradiance);

/// True for lights without extent, which are found by light samples alone.
EMBRUN_FN bool is_delta(LightKind kind) { return kind == LightKind::point || kind == LightKind::directional; }

/// Radiance that a surface of `light` with the given emitting normal sends along -direction (`direction` is the
/// path's, towards the light).
EMBRUN_FN Rgb emitted_radiance(const Light& light, Vec3 normal, Vec3 direction) {
  return light.two_sided || dot(normal, direction) < 0.0f ? light.radiance : Rgb{};
}

/// Converts the density 1/area of a point on a surface to solid angle: distance^2 / (|cos| area).
EMBRUN_FN float area_pdf_to_solid_angle(float area, float distance, float abs_cosine) {
  return distance * distance / (abs_cosine * area);
}

/// Cone under which a sphere of the given radius is seen from `distance2` (squared, to its centre), as 1 - cos of
/// the half angle.
EMBRUN_FN float sphere_cone(float radius, float distance2) {
  return one_minus_cos_from_sin2(radius * radius / distance2);
}

/// A point inside a sphere light, or on it, sees nothing: it emits outwards.
EMBRUN_LOCAL_FN LightSample sample_sphere_light(const Light& light, Vec3 point, Sample2 u) {
  const Vec3 to_centre = light.position - point;
  const float distance2 = length_squared(to_centre);
  if (!(distance2 > light.radius * light.radius)) return {};
  const float h = sphere_cone(light.radius, distance2);
  const Vec3 local = sample_cone(u, h);
  const float centre_distance = sqrtf(distance2);
  // Nearer root of |t d - c| = r; (sin of the angle to the centre) times its distance is the chord's offset.
  const float offset2 = distance2 * (local.x * local.x + local.y * local.y);
  const float half_chord = sqrtf(max_of(0.0f, light.radius * light.radius - offset2));
  LightSample s;
  s.direction = normalize(Frame(to_centre / centre_distance).to_world(local));
  s.distance = centre_distance * local.z - half_chord;
  s.radiance = light.radiance;
  s.pdf = cone_pdf(h);
  s.valid = true;
  return s;
}

EMBRUN_LOCAL_FN LightSample sample_point_light(const Light& light, Vec3 point) {
  const Vec3 offset = light.position - point;
  const float distance = length(offset);
  if (!(distance > 0.0f)) return {};
  LightSample s;
  s.direction = offset * (1.0f / distance);
  s.distance = distance;
  s.radiance = light.radiance * (1.0f / (distance * distance));
  s.pdf = 1.0f;
  s.delta = true;
  s.valid = is_finite(s.radiance) && !is_black(s.radiance);
  return s;
}

/// The sample that leads from `point` to `target` on a flat emitter.
EMBRUN_FN LightSample flat_light_sample(const Light& light, Vec3 point, Vec3 target, Vec3 normal) {
  const Vec3 offset = target - point;
  const float distance = length(offset);
  if (!(distance > 0.0f)) return {};
  LightSample s;
  s.direction = offset * (1.0f / distance);
  const float cosine = dot(s.direction, normal);
  if (cosine == 0.0f) return {};
  s.distance = distance;
  s.radiance = emitted_radiance(light, normal, s.direction);
  s.pdf = area_pdf_to_solid_angle(light.area, distance, fabsf(cosine));
  s.valid = !is_black(s.radiance);
  return s;
}

/// A hit on an emitter: distance along the ray and the normal of its emitting side; distance infinite for none.
struct EmitterHit {
  float distance = infinity;
  Vec3 normal;
};

/// Nearest point of a rectangle, disk or sphere light on the ray within its extent; none for the other kinds.
EMBRUN_LOCAL_FN EmitterHit intersect_area_light(const Light& light, const Ray& ray) {
  if (light.kind == LightKind::sphere) {
    const Vec3 to_centre = light.position - ray.origin;
    const float along = dot(to_centre, ray.direction);
    const Vec3 perpendicular = to_centre - ray.direction * along;
    const float discriminant = light.radius * light.radius - length_squared(perpendicular);
    if (discriminant < 0.0f) return {};
    const float half_chord = sqrtf(discriminant);
    float t = along - half_chord;
    if (t < ray.t_min) t = along + half_chord;
    if (!(t >= ray.t_min && t <= ray.t_max)) return {};
    return {t, (ray.at(t) - light.position) * (1.0f / light.radius)};
  }
  if (light.kind != LightKind::rectangle && light.kind != LightKind::disk) return {};
  const float cosine = dot(ray.direction, light.normal);
  if (cosine == 0.0f) return {};
  const float t = dot(light.position - ray.origin, light.normal) / cosine;
  if (!(t >= ray.t_min && t <= ray.t_max)) return {};
  const Vec3 p = ray.at(t) - light.position;
  if (light.kind == LightKind::disk)
    return length_squared(p) <= light.radius * light.radius ? EmitterHit{t, light.normal} : EmitterHit{};
  const float a = dot(p, light.edge_u) / length_squared(light.edge_u);
  const float b = dot(p, light.edge_v) / length_squared(light.edge_v);
  return a >= 0.0f && a <= 1.0f && b >= 0.0f && b <= 1.0f ? EmitterHit{t, light.normal} : EmitterHit{};
}

/// Density, per steradian round `point`, with which this light alone is sampled in `direction`, for a ray from `point`
/// that meets its surface at `distance` with unit normal `normal` (either way round). Area lights only.
EMBRUN_FN float area_light_pdf(const Light& light, Vec3 point, Vec3 direction, float distance, Vec3 normal) {
  if (light.kind == LightKind::sphere) {
    const float distance2 = length_squared(light.position - point);
    return distance2 > light.radius * light.radius ? cone_pdf(sphere_cone(light.radius, distance2)) : 0.0f;
  }
  const float cosine = fabsf(dot(direction, normal));
  return cosine > 0.0f ? area_pdf_to_solid_angle(light.area, distance, cosine) : 0.0f;
}

}  // namespace embrun

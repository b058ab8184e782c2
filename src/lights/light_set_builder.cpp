#include "lights/light_set_builder.h"

#include <cmath>
#include <string>

#include "base/error.h"

namespace embrun {
namespace {

void check_radiance(Rgb radiance, const char* what) {
  for (int c = 0; c < 3; ++c)
    if (!(radiance[c] >= 0) || !is_finite(radiance[c]))
      throw Error(std::string(what) + ": radiance " + std::to_string(radiance[c]) + " is not 0 or more");
}

Light flat_light(LightKind kind, Vec3 position, Vec3 normal, float area, Rgb radiance, bool two_sided) {
  Light light;
  light.kind = kind;
  light.position = position;
  light.normal = normal;
  light.area = area;
  light.radiance = radiance;
  light.two_sided = two_sided;
  return light;
}

/// Luminous power in relative units; light from infinity is what crosses a disk of `scene_radius`.
double power_of(const Light& light, Rgb environment_mean, double scene_radius) {
  const double disk = M_PI * scene_radius * scene_radius;
  switch (light.kind) {
    case LightKind::environment: return 4 * M_PI * disk * luminance(environment_mean);
    case LightKind::distant: return 2 * M_PI * light.one_minus_cos * disk * luminance(light.radiance);
    case LightKind::point: return 4 * M_PI * luminance(light.radiance);
    case LightKind::directional: return disk * luminance(light.radiance);
    case LightKind::rectangle:
    case LightKind::disk:
    case LightKind::sphere:
    case LightKind::cylinder:
    case LightKind::triangles: break;
  }
  return M_PI * light.area * luminance(light.radiance) * (light.two_sided ? 2 : 1);
}

}  // namespace

Light make_distant_light(Vec3 towards, float half_angle, Rgb radiance) {
  if (!(half_angle > 0 && half_angle <= 0.5f * pi))
    throw Error("distant light: half angle " + std::to_string(half_angle) + " is not within 0 and pi/2 radians");
  if (!is_finite(towards) || length_squared(towards) == 0) throw Error("distant light: it has no direction");
  Light light;
  light.kind = LightKind::distant;
  light.normal = normalize(towards);
  light.radiance = radiance;
  light.one_minus_cos = one_minus_cos_from_sin2(square(sinf(half_angle)));
  return light;
}

Light make_rectangle_light(Vec3 corner, Vec3 edge_u, Vec3 edge_v, Rgb radiance, bool two_sided) {
  const Vec3 product = cross(edge_u, edge_v);
  const float area = length(product);
  if (!(area > 0)) throw Error("rectangle light: its edges span no area");
  if (std::fabs(dot(edge_u, edge_v)) > 1e-4f * length(edge_u) * length(edge_v))
    throw Error("rectangle light: its edges are not perpendicular");
  Light light = flat_light(LightKind::rectangle, corner, product * (1 / area), area, radiance, two_sided);
  light.edge_u = edge_u;
  light.edge_v = edge_v;
  return light;
}

Light make_disk_light(Vec3 centre, Vec3 normal, float radius, Rgb radiance, bool two_sided) {
  if (!is_finite(normal) || length_squared(normal) == 0) throw Error("disk light: it has no normal");
  Light light = flat_light(LightKind::disk, centre, normalize(normal), pi * radius * radius, radiance, two_sided);
  light.radius = radius;
  return light;
}

Light make_sphere_light(Vec3 centre, float radius, Rgb radiance) {
  Light light = flat_light(LightKind::sphere, centre, {0, 0, 1}, 4 * pi * radius * radius, radiance, false);
  light.radius = radius;
  return light;
}

Light make_cylinder_light(Vec3 start, Vec3 axis, float radius, Rgb radiance) {
  Light light = flat_light(LightKind::cylinder, start, {0, 0, 1}, 2 * pi * radius * length(axis), radiance, false);
  light.edge_u = axis;
  light.radius = radius;
  light.in_scene = true;
  return light;
}

Light make_point_light(Vec3 position, Rgb intensity) {
  Light light;
  light.kind = LightKind::point;
  light.position = position;
  light.radiance = intensity;
  return light;
}

Light make_directional_light(Vec3 towards, Rgb irradiance) {
  if (!is_finite(towards) || length_squared(towards) == 0) throw Error("directional light: it has no direction");
  Light light;
  light.kind = LightKind::directional;
  light.normal = normalize(towards);
  light.radiance = irradiance;
  return light;
}

void LightSetBuilder::set_constant_environment(Rgb radiance) {
  check_radiance(radiance, "constant environment");
  environment_ = {};
  environment_.kind = EnvironmentKind::constant;
  environment_.constant = environment_mean_ = radiance;
  if (environment_index_ < 0) {
    environment_index_ = static_cast<int>(lights_.size());
    lights_.emplace_back();
  }
}

void LightSetBuilder::set_environment(const EnvironmentImage& image, UpAxis up, float turn) {
  environment_ = image.view(up, turn);
  environment_mean_ = image.mean_radiance();
  if (environment_index_ < 0) {
    environment_index_ = static_cast<int>(lights_.size());
    lights_.emplace_back();
  }
}

int LightSetBuilder::add(const Light& light) {
  EMBRUN_CHECK(light.kind != LightKind::environment && light.kind != LightKind::triangles);
  check_radiance(light.radiance, "light");
  const bool extended = light.kind == LightKind::distant ? light.one_minus_cos > 0 : light.area > 0;
  if ((!extended && !is_delta(light.kind)) || !is_finite(light.area) || !is_finite(light.position))
    throw Error("light: its place or size is not finite and above 0");
  lights_.push_back(light);
  return static_cast<int>(lights_.size()) - 1;
}

int LightSetBuilder::add_triangles(std::span<const LightTriangle> triangles, Rgb radiance, bool two_sided) {
  check_radiance(radiance, "mesh light");
  std::vector<float> areas;
  areas.reserve(triangles.size());
  for (const LightTriangle& t : triangles) areas.push_back(0.5f * length(cross(t.edge_1, t.edge_2)));
  double total = 0;
  for (const float a : areas) total += a;
  if (!(total > 0) || !std::isfinite(total)) throw Error("mesh light: its triangles have no finite area above 0");

  Light light = flat_light(LightKind::triangles, {}, {0, 0, 1}, static_cast<float>(total), radiance, two_sided);
  light.in_scene = true;
  light.first_triangle = static_cast<int>(triangles_.size());
  light.triangle_count = static_cast<int>(triangles.size());
  light.first_cdf = static_cast<int>(triangle_cdf_.size());
  triangles_.insert(triangles_.end(), triangles.begin(), triangles.end());
  const std::vector<float> cdf = build_cdf(areas);
  triangle_cdf_.insert(triangle_cdf_.end(), cdf.begin(), cdf.end());
  lights_.push_back(light);
  return static_cast<int>(lights_.size()) - 1;
}

void LightSetBuilder::finish(float scene_radius) {
  EMBRUN_CHECK(scene_radius > 0 && is_finite(scene_radius));
  if (lights_.empty()) return;
  std::vector<double> power;
  double total = 0;
  for (const Light& light : lights_) {
    power.push_back(power_of(light, environment_mean_, scene_radius));
    total += power.back();
  }
  const double least = 0.1 * total / static_cast<double>(lights_.size());
  std::vector<float> weights;
  for (const double p : power)
    weights.push_back(total > 0 && p > 0 ? static_cast<float>(std::fmax(p, least) / total) : 0.0f);
  choice_cdf_ = build_cdf(weights);
}

LightSet LightSetBuilder::view() const {
  EMBRUN_CHECK(lights_.empty() || choice_cdf_.size() == lights_.size() + 1);
  LightSet set;
  set.lights = lights_.data();
  set.count = static_cast<int>(lights_.size());
  set.choice = {choice_cdf_.data(), set.count};
  set.triangles = triangles_.data();
  set.triangle_cdf = triangle_cdf_.data();
  set.environment = environment_;
  set.environment_index = environment_index_;
  return set;
}

}  // namespace embrun

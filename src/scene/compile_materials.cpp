#include "scene/compile_materials.h"

#include <algorithm>
#include <cmath>

namespace embrun {
namespace {

Texture compile_texture(const TextureDescription& description, const FlatScene& flat) {
  Texture texture;
  texture.kind = description.kind;
  texture.wrap = description.wrap;
  texture.filter = description.filter;
  texture.first = description.first;
  texture.second = description.second;
  texture.axis_u = static_cast<std::uint8_t>(description.axis_u);
  texture.axis_v = static_cast<std::uint8_t>(description.axis_v);
  texture.cell = static_cast<float>(description.cell);
  // The pattern repeats every two cells: the corner nearest to the middle keeps the precision far from the origin.
  const double period = 2 * description.cell;
  const Vec3d corner = description.origin - flat.recentring;
  const auto near_middle = [&](double c) { return c - period * std::round(c / period); };
  texture.origin = to_float({near_middle(corner.x), near_middle(corner.y), near_middle(corner.z)});
  const auto& m = description.to_uv;
  texture.u_axis = to_float({m[0], m[1], m[2]});
  texture.v_axis = to_float({m[3], m[4], m[5]});
  if (description.kind == TextureKind::bitmap) {
    const Image& image = flat.pictures[static_cast<std::size_t>(description.picture)];
    texture.picture = {image.pixels.data(), image.width, image.height, image.channels};
  }
  return texture;
}

BsdfParameters compile_parameters(const MaterialDescription& description) {
  BsdfParameters p;
  p.distribution = description.distribution;
  p.nonlinear = description.nonlinear;
  p.specular_reflectance = description.specular_reflectance;
  p.specular_transmittance = description.specular_transmittance;
  p.eta = description.eta;
  p.k = description.k;
  if (description.kind == BsdfKind::plastic)
    p.inner_reflectance = static_cast<float>(inner_diffuse_reflectance(description.ior));
  const PrincipledDescription& d = description.principled;
  p.principled = {static_cast<float>(d.metallic),   static_cast<float>(d.spec_trans),
                  static_cast<float>(d.spec_tint),  static_cast<float>(d.sheen),
                  static_cast<float>(d.sheen_tint), static_cast<float>(d.flatness),
                  static_cast<float>(d.clearcoat),  static_cast<float>(d.clearcoat_gloss)};
  return p;
}

bool uses_coordinates(const Texture& texture) {
  return texture.kind == TextureKind::uv_checker || texture.kind == TextureKind::bitmap;
}

Material compile_material(const MaterialDescription& description, const FlatScene& flat) {
  const Rgb one{1, 1, 1};
  Material material;
  material.kind = description.kind;
  material.one_sided = description.one_sided;
  material.reflectance = compile_texture(description.reflectance, flat);
  material.roughness = compile_texture(description.roughness, flat);
  // A clear dielectric does without, as it is met most often.
  const bool plain = description.kind == BsdfKind::null || description.kind == BsdfKind::diffuse ||
                     (description.kind == BsdfKind::dielectric && description.specular_reflectance == one &&
                      description.specular_transmittance == one);
  material.parameters = !plain;
  material.constants = compile_parameters(description);
  if (!has_inside(description)) material.own_index = static_cast<float>(description.ior);
  if (description.roughness_v) material.alpha_v = std::max(static_cast<float>(*description.roughness_v), min_alpha);
  material.stretch = static_cast<float>(1 / std::sqrt(1 - 0.9 * description.principled.anisotropic));
  const bool directed = description.roughness_v.has_value() || description.principled.anisotropic > 0;
  material.needs_coordinates =
      directed || uses_coordinates(material.reflectance) || uses_coordinates(material.roughness);
  return material;
}

}  // namespace

std::uint32_t add_material(const MaterialDescription& description, FlatScene& flat) {
  const auto index = static_cast<std::uint32_t>(flat.materials.size());
  flat.materials.push_back(compile_material(description, flat));
  if (!description.back.empty()) {
    flat.materials.push_back(compile_material(description.back.front(), flat));
    flat.materials[index].back = static_cast<std::int32_t>(index + 1);
    flat.materials[index].needs_coordinates |= flat.materials[index + 1].needs_coordinates;
  }
  return index;
}

double inner_diffuse_reflectance(double index) {
  constexpr int steps = 20000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double cosine = (i + 0.5) / steps;
    sum +=
        2 * cosine *
        static_cast<double>(fresnel_dielectric(static_cast<float>(cosine), static_cast<float>(1 / index)).reflectance);
  }
  return sum / steps;
}

}  // namespace embrun

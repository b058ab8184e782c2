#pragma once

#include "materials/bsdf.h"
#include "materials/texture.h"

namespace embrun {

/// What a surface is made of, wherever it is hit.
struct Material {
  BsdfKind kind = BsdfKind::diffuse;
  bool one_sided = false;          ///< seen only from where the geometric normal points; from behind nothing is there
  bool parameters = false;         ///< `constants` matter
  bool needs_coordinates = false;  ///< uv and tangent matter, of this or what is on the back
  /// Index of what is there instead when seen from behind, or -1.
  std::int32_t back = -1;
  Texture reflectance;
  /// Index relative to what is round it, where no media on the two sides decide it; else 0.
  float own_index = 0;
  float alpha_v = 0;  ///< across the tangent, where it is another; else 0
  /// Ratio of a principled material's alpha along the tangent to the square of its roughness; that across is divided.
  float stretch = 1;
  Texture roughness;  ///< the mean of its channels counts
  BsdfParameters constants;
};

/// A point of a surface as textures want it.
struct TexturePoint {
  Vec3 position;     ///< in the scene
  Vec2 uv;           ///< the geometry's coordinates
  Vec3 tangent;      ///< where u grows; zero where it is not known
  Rgb own{1, 1, 1};  ///< the surface's own colour
};

EMBRUN_FN void set_roughness(const Material& material, const TexturePoint& point, Bsdf& bsdf) {
  const float value =
      clamp(mean(evaluate_texture(material.roughness, point.position, point.uv, point.own)), 0.0f, 1.0f);
  bsdf.roughness = value;
  bsdf.alpha_u = value;
  bsdf.alpha_v = material.alpha_v > 0.0f ? material.alpha_v : value;
  if (material.kind == BsdfKind::principled) {
    bsdf.alpha_u = value * value * material.stretch;
    bsdf.alpha_v = value * value / material.stretch;
  }
  bsdf.alpha_u = max_of(bsdf.alpha_u, min_alpha);
  bsdf.alpha_v = max_of(bsdf.alpha_v, min_alpha);
  bsdf.tangent = point.tangent;
}

/// The material at a point, seen from the front (where the geometric normal points) or from behind; `material` is what
/// lies on that side. `relative_index` is n_far / n_near as the viewer meets the surface; the media on its two sides
/// decide it, so the caller does.
EMBRUN_FN Bsdf bsdf_at(const Material& material, const TexturePoint& point, bool from_front, float relative_index) {
  if (material.one_sided && !from_front) return {};
  Bsdf bsdf;
  bsdf.kind = material.kind;
  bsdf.relative_index = relative_index;
  if (!is_interface(material.kind) && material.kind != BsdfKind::thin_dielectric)
    bsdf.reflectance = evaluate_texture(material.reflectance, point.position, point.uv, point.own);
  if (!material.parameters) return bsdf;
  bsdf.parameters = &material.constants;
  if (material.own_index > 0.0f) bsdf.relative_index = material.own_index;
  const bool rough = material.kind == BsdfKind::rough_conductor || material.kind == BsdfKind::rough_dielectric ||
                     material.kind == BsdfKind::principled;
  if (rough) set_roughness(material, point, bsdf);
  return bsdf;
}

/// What lies on the side of the surface that is seen.
EMBRUN_FN const Material& material_seen(const Material* materials, std::uint32_t index, bool from_front) {
  const Material& front = materials[index];
  return from_front || front.back < 0 ? front : materials[front.back];
}

}  // namespace embrun

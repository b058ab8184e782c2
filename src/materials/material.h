#pragma once

#include "materials/bsdf.h"
#include "materials/texture.h"

namespace embrun {

/// What a surface is made of, wherever it is hit.
struct Material {
  BsdfKind kind = BsdfKind::diffuse;
  bool one_sided = false;  ///< seen only from where the geometric normal points; from behind nothing is there
  Texture reflectance;     ///< of diffuse and conductor
};

/// The material at `point`, seen from the front (where the geometric normal points) or from behind. `relative_index` is
/// n_far / n_near as the viewer meets the surface; the media on its two sides decide it, so the caller does.
EMBRUN_FN Bsdf bsdf_at(const Material& material, Vec3 point, bool from_front, float relative_index) {
  if (material.one_sided && !from_front) return {};
  Bsdf bsdf;
  bsdf.kind = material.kind;
  bsdf.relative_index = relative_index;
  if (material.kind == BsdfKind::diffuse || material.kind == BsdfKind::conductor)
    bsdf.reflectance = evaluate_texture(material.reflectance, point);
  return bsdf;
}

}  // namespace embrun

#pragma once

#include "materials/smooth_bsdf.h"

// A diffuse base under a smooth coat of a dielectric. Light that gets through the coat is scattered by the base; part of
// it is reflected back to the base by the coat's inner side, again and again, until it gets out. `nonlinear` takes the
// base's colour to every one of these turns, else only the loss of the first is made up for, so that the colour stays
// as given.

namespace embrun {

struct PlasticLobes {
  float reflectance;  ///< of the coat, for wo
  float coat;         ///< probability of the mirror direction
};

EMBRUN_FN PlasticLobes plastic_lobes(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo) {
  const float fresnel = fresnel_dielectric(min_of(dot(wo, normals.shading), 1.0f), bsdf.relative_index).reflectance;
  const float coat = fresnel * mean(bsdf.parameters->specular_reflectance);
  const float base = (1.0f - fresnel) * mean(bsdf.reflectance);
  return {fresnel, coat + base > 0.0f ? coat / (coat + base) : 1.0f};
}

/// What the base adds, without the cosine's density: value = this times cos / pi.
EMBRUN_FN Rgb plastic_base(const Bsdf& bsdf, const PlasticLobes& lobes, float cos_in) {
  const Rgb a = bsdf.reflectance;
  const float inner = bsdf.parameters->inner_reflectance;
  const float once = 1.0f / (1.0f - inner);
  const Rgb base = bsdf.parameters->nonlinear
                       ? Rgb{a.r / (1.0f - a.r * inner), a.g / (1.0f - a.g * inner), a.b / (1.0f - a.b * inner)}
                       : a * once;
  const float through = (1.0f - lobes.reflectance) *
                        (1.0f - fresnel_dielectric(min_of(cos_in, 1.0f), bsdf.relative_index).reflectance) *
                        refraction_radiance_factor(bsdf.relative_index);
  return base * through;
}

EMBRUN_LOCAL_FN BsdfValue evaluate_plastic(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo, Vec3 wi) {
  if (!scatter_side(normals, wi).reflects) return {};
  const PlasticLobes lobes = plastic_lobes(bsdf, normals, wo);
  const float diffuse = lambert_pdf(normals, wi);
  return {plastic_base(bsdf, lobes, dot(wi, normals.shading)) * diffuse, (1.0f - lobes.coat) * diffuse};
}

EMBRUN_LOCAL_FN BsdfSample sample_plastic(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo, float u_lobe,
                                          Sample2 u) {
  const PlasticLobes lobes = plastic_lobes(bsdf, normals, wo);
  if (u_lobe < lobes.coat)
    return mirror_sample(normals, wo, bsdf.parameters->specular_reflectance * (lobes.reflectance / lobes.coat),
                         lobes.coat);
  BsdfSample s = sample_diffuse(bsdf, normals, u);
  if (!s.valid) return s;
  s.weight = plastic_base(bsdf, lobes, dot(s.wi, normals.shading)) * (1.0f / (1.0f - lobes.coat));
  s.pdf *= 1.0f - lobes.coat;
  return s;
}

}  // namespace embrun

#pragma once

#include "materials/bsdf_types.h"
#include "materials/fresnel.h"

// BSDFs of a perfectly smooth surface: everything goes into single directions. And the diffuse one.

namespace embrun {

/// The mirror direction, on the viewer's side of the true surface.
EMBRUN_FN BsdfSample mirror_sample(const FacingNormals& normals, Vec3 wo, Rgb weight, float probability) {
  const BentVector out = bend_reflection(normalize(reflect_about(wo, normals.shading)), wo, normals);
  BsdfSample s;
  s.valid = s.specular = true;
  s.wi = out.v;
  s.weight = weight;
  s.pdf = probability;
  s.bent = normals.bent || out.bent;
  return s;
}

/// Reflects with the Fresnel reflectance as probability, else refracts: both weights are 1 (but for the radiance
/// factor and the material's own), whatever the normals.
EMBRUN_FN BsdfSample sample_dielectric(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo, float u_lobe) {
  const float cos_i = min_of(dot(wo, normals.shading), 1.0f);
  const FresnelResult fresnel = fresnel_dielectric(cos_i, bsdf.relative_index);
  BsdfSample s;
  if (u_lobe < fresnel.reflectance) {
    s = mirror_sample(normals, wo, grey(1.0f), fresnel.reflectance);
  } else {
    const Vec3 wi = refract_through(wo, normals.shading, cos_i, fresnel.cos_transmitted, bsdf.relative_index);
    const BentVector out = bend_transmission(normalize(wi), wo, bsdf.relative_index, normals);
    s.valid = s.specular = s.transmitted = true;
    s.weight = grey(refraction_radiance_factor(bsdf.relative_index));
    s.pdf = 1.0f - fresnel.reflectance;
    s.wi = out.v;
    s.bent = normals.bent || out.bent;
  }
  if (bsdf.parameters != nullptr)
    s.weight *= s.transmitted ? bsdf.parameters->specular_transmittance : bsdf.parameters->specular_reflectance;
  return s;
}

/// Both faces of a sheet together, with all reflections between them: R + T R T + T R^3 T + ... = 2 R / (1 + R).
EMBRUN_FN BsdfSample sample_thin_dielectric(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo, float u_lobe) {
  const float one_face = fresnel_dielectric(min_of(dot(wo, normals.shading), 1.0f), bsdf.relative_index).reflectance;
  const float reflectance = 2.0f * one_face / (1.0f + one_face);
  if (u_lobe < reflectance) return mirror_sample(normals, wo, bsdf.parameters->specular_reflectance, reflectance);
  BsdfSample s;
  s.valid = s.specular = s.transmitted = true;
  s.wi = -wo;
  s.weight = bsdf.parameters->specular_transmittance;
  s.pdf = 1.0f - reflectance;
  return s;
}

EMBRUN_FN BsdfSample sample_conductor(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo) {
  const float cosine = min_of(dot(wo, normals.shading), 1.0f);
  const Rgb fresnel = fresnel_conductor(cosine, bsdf.parameters->eta, bsdf.parameters->k);
  return mirror_sample(normals, wo, bsdf.reflectance * fresnel, 1.0f);
}

/// The sample whose direction is `local` in the shading normal's frame. Directions that the shading normal sends under the
/// true surface are not valid: they carry nothing, in eval and pdf alike.
EMBRUN_FN BsdfSample diffuse_sample(const Bsdf& bsdf, const FacingNormals& normals, Vec3 local) {
  BsdfSample s;
  s.wi = normalize(Frame(normals.shading).to_world(local));
  if (dot(s.wi, normals.geometric) <= 0.0f) return {};
  s.valid = true;
  s.weight = bsdf.reflectance;
  s.pdf = cosine_hemisphere_pdf(local.z);
  s.bent = normals.bent;
  return s;
}

/// Cosine-distributed about the shading normal.
EMBRUN_FN BsdfSample sample_diffuse(const Bsdf& bsdf, const FacingNormals& normals, Sample2 u) {
  return diffuse_sample(bsdf, normals, sample_cosine_hemisphere(u));
}

EMBRUN_FN float lambert_pdf(const FacingNormals& normals, Vec3 wi) {
  return dot(wi, normals.geometric) > 0.0f ? cosine_hemisphere_pdf(dot(wi, normals.shading)) : 0.0f;
}

}  // namespace embrun

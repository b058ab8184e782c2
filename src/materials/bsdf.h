#pragma once

#include "materials/bsdf_types.h"
#include "materials/plastic_bsdf.h"
#include "materials/principled_bsdf.h"
#include "materials/rough_bsdf.h"
#include "materials/smooth_bsdf.h"

// The closed set of BSDFs: sampling, value and density of each. bsdf_types.h states the conventions.

namespace embrun {

/// Draws the direction in which the path goes on. `u_lobe` chooses between lobes and between reflection and refraction,
/// `u` the direction within a lobe.
EMBRUN_LOCAL_FN BsdfSample sample_bsdf(const Bsdf& bsdf, const SurfaceNormals& surface, Vec3 wo, float u_lobe,
                                       Sample2 u) {
  const FacingNormals normals = face_towards(surface, wo);
  switch (bsdf.kind) {
    case BsdfKind::null: break;
    case BsdfKind::diffuse: return sample_diffuse(bsdf, normals, u);
    case BsdfKind::dielectric: return sample_dielectric(bsdf, normals, wo, u_lobe);
    case BsdfKind::conductor: return sample_conductor(bsdf, normals, wo);
    case BsdfKind::thin_dielectric: return sample_thin_dielectric(bsdf, normals, wo, u_lobe);
    case BsdfKind::rough_dielectric:
    case BsdfKind::rough_conductor: return sample_rough(bsdf, normals, wo, u_lobe, u);
    case BsdfKind::plastic: return sample_plastic(bsdf, normals, wo, u_lobe, u);
    case BsdfKind::principled: return sample_principled(bsdf, normals, wo, u_lobe, u);
  }
  BsdfSample straight;
  straight.wi = -wo;
  straight.weight = grey(1.0f);
  straight.pdf = 1.0f;
  straight.valid = straight.specular = straight.transmitted = true;
  return straight;
}

/// Bsdf times |dot(wi, shading normal)|, per steradian, and the density with which sample_bsdf draws `wi`; without what
/// goes into single directions. Both are 0 for directions never drawn.
EMBRUN_LOCAL_FN BsdfValue evaluate_bsdf(const Bsdf& bsdf, const SurfaceNormals& surface, Vec3 wo, Vec3 wi) {
  if (is_specular(bsdf)) return {};
  const FacingNormals normals = face_towards(surface, wo);
  switch (bsdf.kind) {
    case BsdfKind::rough_dielectric:
    case BsdfKind::rough_conductor: return evaluate_rough(bsdf, normals, wo, wi);
    case BsdfKind::plastic: return evaluate_plastic(bsdf, normals, wo, wi);
    case BsdfKind::principled: return evaluate_principled(bsdf, normals, wo, wi);
    default: break;
  }
  const float pdf = lambert_pdf(normals, wi);
  return {bsdf.reflectance * pdf, pdf};
}

EMBRUN_FN float pdf_bsdf(const Bsdf& bsdf, const SurfaceNormals& surface, Vec3 wo, Vec3 wi) {
  return evaluate_bsdf(bsdf, surface, wo, wi).pdf;
}
EMBRUN_FN Rgb eval_bsdf(const Bsdf& bsdf, const SurfaceNormals& surface, Vec3 wo, Vec3 wi) {
  return evaluate_bsdf(bsdf, surface, wo, wi).value;
}

/// What fraction of white light comes back, roughly and whatever the direction: what a picture's albedo layer shows.
EMBRUN_FN Rgb albedo_of(const Bsdf& bsdf) {
  switch (bsdf.kind) {
    case BsdfKind::diffuse:
    case BsdfKind::plastic:
    case BsdfKind::principled: return bsdf.reflectance;
    case BsdfKind::rough_conductor:
      return bsdf.reflectance * fresnel_conductor(1.0f, bsdf.parameters->eta, bsdf.parameters->k);
    default: return grey(1.0f);
  }
}

}  // namespace embrun

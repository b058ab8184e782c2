#pragma once

#include <cstdint>

#include "materials/fresnel.h"
#include "materials/shading_normal.h"
#include "math/rgb.h"
#include "sampling/warp.h"

namespace embrun {

// Conventions of sample_bsdf, eval_bsdf and pdf_bsdf:
// - Frame: directions and normals are unit vectors in scene coordinates.
// - Directions: `wo` points from the surface to where the path came from (the camera side), `wi` to where it goes
//   on (the light side). Both point away from the surface.
// - Measure: densities are per steradian round the surface point. The kinds with `is_specular` have a discrete choice
//   instead; eval and pdf are 0 for them, and a sample's pdf is the probability of the choice.
// - The cosine |dot(wi, shading normal)| is inside both eval's value and a sample's weight.
// - On failure (nothing is scattered) a sample has `valid == false` and weight 0.
// - Radiance: where a path from the camera crosses from index n_near into n_far, the weight has the factor
//   (n_near / n_far)^2, for radiance is compressed by refraction. So inside water of an environment of radiance 1 the
//   radiance is n^2 = 1.77, and a camera in air sees exactly 1 again.

enum class BsdfKind : uint8_t {
  null,              ///< nothing is there: the path goes straight on, weight 1
  diffuse,           ///< Lambertian, on both sides, `reflectance`
  dielectric,        ///< smooth, exact Fresnel, `relative_index`; reflects and refracts, absorbs nothing
  conductor,         ///< smooth metal: exact Fresnel of a complex index, times `reflectance`
  thin_dielectric,   ///< a sheet of glass without thickness: reflects and lets straight through; no inside
  rough_dielectric,  ///< an interface of microfacets
  rough_conductor,   ///< a metal of microfacets
  plastic,           ///< a diffuse base under a smooth dielectric coat
  principled,        ///< Burley's
};

/// How the normals of microfacets are spread.
enum class MicrofacetDistribution : uint8_t { ggx, beckmann };

/// True for the interfaces of media that are nothing where the indices on both sides agree.
EMBRUN_FN bool is_interface(BsdfKind kind) {
  return kind == BsdfKind::dielectric || kind == BsdfKind::rough_dielectric;
}

/// What a material is at one surface point, ready to scatter.
struct Bsdf {
  BsdfKind kind = BsdfKind::null;
  Rgb reflectance{0, 0, 0};  ///< each channel in [0, 1]
  float relative_index = 1;  ///< n_far / n_near, as seen from `wo`
};

struct BsdfSample {
  Vec3 wi;        ///< unit, and on the side of the true surface that `transmitted` says
  Rgb weight;     ///< bsdf * cosine / pdf, with the radiance factor of a refraction
  float pdf = 0;  ///< per steradian; for a specular choice its probability
  bool valid = false;
  bool specular = false;
  bool transmitted = false;  ///< `wi` is across the true surface from `wo`
  bool bent = false;         ///< the shading normal disagreed with the true surface and a direction was bent
};

EMBRUN_FN bool is_specular(const Bsdf& bsdf) { return bsdf.kind != BsdfKind::diffuse; }

/// Factor on the radiance seen through an interface from the near side: (n_near / n_far)^2.
EMBRUN_FN float refraction_radiance_factor(float relative_index) { return 1.0f / (relative_index * relative_index); }

/// Reflects with the Fresnel reflectance as probability, else refracts: both weights are 1 (but for the radiance
/// factor), whatever the normals.
EMBRUN_FN BsdfSample sample_dielectric(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo, float u_lobe) {
  const float cos_i = min_of(dot(wo, normals.shading), 1.0f);
  const FresnelResult fresnel = fresnel_dielectric(cos_i, bsdf.relative_index);
  BsdfSample s;
  s.valid = s.specular = true;
  s.transmitted = u_lobe >= fresnel.reflectance;
  BentVector out;
  if (s.transmitted) {
    const Vec3 wi = refract_through(wo, normals.shading, cos_i, fresnel.cos_transmitted, bsdf.relative_index);
    out = bend_transmission(normalize(wi), normals);
    s.weight = grey(refraction_radiance_factor(bsdf.relative_index));
    s.pdf = 1.0f - fresnel.reflectance;
  } else {
    out = bend_reflection(normalize(reflect_about(wo, normals.shading)), normals);
    s.weight = grey(1.0f);
    s.pdf = fresnel.reflectance;
  }
  s.wi = out.v;
  s.bent = normals.bent || out.bent;
  return s;
}

EMBRUN_FN BsdfSample sample_conductor(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo) {
  const float c = 1.0f - min_of(dot(wo, normals.shading), 1.0f);
  const BentVector out = bend_reflection(normalize(reflect_about(wo, normals.shading)), normals);
  BsdfSample s;
  s.valid = s.specular = true;
  s.wi = out.v;
  s.weight = bsdf.reflectance + (grey(1.0f) - bsdf.reflectance) * (c * c * c * c * c);
  s.pdf = 1.0f;
  s.bent = normals.bent || out.bent;
  return s;
}

/// Cosine-distributed about the shading normal. Directions that the shading normal sends under the true surface are
/// not valid: they carry nothing, in eval and pdf alike.
EMBRUN_FN BsdfSample sample_diffuse(const Bsdf& bsdf, const FacingNormals& normals, Sample2 u) {
  const Vec3 local = sample_cosine_hemisphere(u);
  BsdfSample s;
  s.wi = normalize(Frame(normals.shading).to_world(local));
  if (dot(s.wi, normals.geometric) <= 0.0f) return {};
  s.valid = true;
  s.weight = bsdf.reflectance;
  s.pdf = cosine_hemisphere_pdf(local.z);
  s.bent = normals.bent;
  return s;
}

/// Draws the direction in which the path goes on. `u_lobe` chooses between reflection and refraction, `u` the direction
/// within a lobe.
EMBRUN_LOCAL_FN BsdfSample sample_bsdf(const Bsdf& bsdf, const SurfaceNormals& surface, Vec3 wo, float u_lobe,
                                       Sample2 u) {
  const FacingNormals normals = face_towards(surface, wo);
  switch (bsdf.kind) {
    case BsdfKind::null:
    case BsdfKind::thin_dielectric:
    case BsdfKind::rough_dielectric:
    case BsdfKind::rough_conductor:
    case BsdfKind::plastic:
    case BsdfKind::principled: break;
    case BsdfKind::diffuse: return sample_diffuse(bsdf, normals, u);
    case BsdfKind::dielectric: return sample_dielectric(bsdf, normals, wo, u_lobe);
    case BsdfKind::conductor: return sample_conductor(bsdf, normals, wo);
  }
  BsdfSample straight;
  straight.wi = -wo;
  straight.weight = grey(1.0f);
  straight.pdf = 1.0f;
  straight.valid = straight.specular = straight.transmitted = true;
  return straight;
}

/// Density with which sample_bsdf draws `wi`, per steradian; 0 for specular kinds and for directions never drawn.
EMBRUN_LOCAL_FN float pdf_bsdf(const Bsdf& bsdf, const SurfaceNormals& surface, Vec3 wo, Vec3 wi) {
  if (bsdf.kind != BsdfKind::diffuse) return 0.0f;
  const FacingNormals normals = face_towards(surface, wo);
  if (dot(wi, normals.geometric) <= 0.0f) return 0.0f;
  return cosine_hemisphere_pdf(dot(wi, normals.shading));
}

/// Bsdf times |dot(wi, shading normal)|, per steradian; 0 for specular kinds.
EMBRUN_LOCAL_FN Rgb eval_bsdf(const Bsdf& bsdf, const SurfaceNormals& surface, Vec3 wo, Vec3 wi) {
  return bsdf.reflectance * pdf_bsdf(bsdf, surface, wo, wi);
}

}  // namespace embrun

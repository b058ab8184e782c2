#pragma once

#include "materials/fresnel.h"
#include "materials/microfacet.h"

// Metals and dielectrics of microfacets [Walter2007]: single scattering, so that rough ones lose what would be
// reflected among facets.

namespace embrun {

EMBRUN_FN Microfacets facets_of(const Bsdf& bsdf) {
  return {bsdf.parameters->distribution, bsdf.alpha_u, bsdf.alpha_v};
}

/// A pair of directions at a facet whose normal turns the one into the other, in the local frame.
struct FacetEvent {
  Vec3 wo, wi, m;
  bool transmits = false;
};

/// The facet normal that reflects or refracts wo into wi, if there is one: `m` zero otherwise.
EMBRUN_FN FacetEvent facet_between(Vec3 wo, Vec3 wi, float relative_index) {
  FacetEvent event{wo, wi, {}, wi.z < 0.0f};
  Vec3 m = event.transmits ? wo + wi * relative_index : wo + wi;
  if (m.z < 0.0f) m = -m;
  const float length2 = length_squared(m);
  if (!(length2 > 0.0f && m.z > 0.0f)) return event;
  m = m * (1.0f / sqrtf(length2));
  // Both have to see the facet from its front, or one from its front and the other from behind.
  const bool agrees = dot(wo, m) > 0.0f && (event.transmits ? dot(wi, m) < 0.0f : dot(wi, m) > 0.0f);
  if (agrees) event.m = m;
  return event;
}

/// d(solid angle of m) / d(solid angle of wi) of a reflection.
EMBRUN_FN float reflection_jacobian(const FacetEvent& e) { return 1.0f / (4.0f * dot(e.wo, e.m)); }

/// The same of a refraction.
EMBRUN_FN float refraction_jacobian(const FacetEvent& e, float relative_index) {
  const float o = dot(e.wo, e.m), i = dot(e.wi, e.m);
  return square(relative_index) * fabsf(i) / square(o + relative_index * i);
}

EMBRUN_FN BsdfValue rough_conductor_event(const Bsdf& bsdf, const FacetEvent& e) {
  const Microfacets facets = facets_of(bsdf);
  const float seen = facet_density(facets, e.m) * facet_visibility(facets, e.wo, e.wi, e.m) / (4.0f * e.wo.z);
  const Rgb fresnel = fresnel_conductor(min_of(dot(e.wo, e.m), 1.0f), bsdf.parameters->eta, bsdf.parameters->k);
  return {bsdf.reflectance * fresnel * seen, facet_pdf(facets, e.wo, e.m) * reflection_jacobian(e)};
}

EMBRUN_FN BsdfValue rough_dielectric_event(const Bsdf& bsdf, const FacetEvent& e) {
  const Microfacets facets = facets_of(bsdf);
  const float cosine = min_of(dot(e.wo, e.m), 1.0f);
  const float fresnel = fresnel_dielectric(cosine, bsdf.relative_index).reflectance;
  const float seen = facet_density(facets, e.m) * facet_visibility(facets, e.wo, e.wi, e.m) * cosine / e.wo.z;
  const float drawn = facet_pdf(facets, e.wo, e.m);
  if (!e.transmits) {
    const float jacobian = fresnel * reflection_jacobian(e);
    return {bsdf.parameters->specular_reflectance * (seen * jacobian), drawn * jacobian};
  }
  const float jacobian = (1.0f - fresnel) * refraction_jacobian(e, bsdf.relative_index);
  const float factor = refraction_radiance_factor(bsdf.relative_index);
  return {bsdf.parameters->specular_transmittance * (seen * jacobian * factor), drawn * jacobian};
}

EMBRUN_FN BsdfValue rough_event(const Bsdf& bsdf, const FacetEvent& event) {
  return bsdf.kind == BsdfKind::rough_conductor ? rough_conductor_event(bsdf, event)
                                                : rough_dielectric_event(bsdf, event);
}

/// Value and density of a rough conductor or dielectric.
EMBRUN_LOCAL_FN BsdfValue evaluate_rough(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo, Vec3 wi) {
  const ScatterSide side = scatter_side(normals, wi);
  if (!side.reflects && !(side.transmits && bsdf.kind == BsdfKind::rough_dielectric)) return {};
  const Frame frame = facet_frame(normals.shading, bsdf.tangent);
  const FacetEvent event = facet_between(frame.to_local(wo), frame.to_local(wi), bsdf.relative_index);
  return event.m.z > 0.0f ? rough_event(bsdf, event) : BsdfValue{};
}

/// The sample that a facet's reflection or refraction makes of its local directions.
EMBRUN_FN BsdfSample facet_sample(const FacingNormals& normals, const Frame& frame, const FacetEvent& event,
                                  const BsdfValue& value) {
  BsdfSample s;
  s.wi = normalize(frame.to_world(event.wi));
  const ScatterSide side = scatter_side(normals, s.wi);
  if (!(event.transmits ? side.transmits : side.reflects) || !(value.pdf > 0.0f)) return {};
  s.valid = true;
  s.transmitted = event.transmits;
  s.weight = value.value * (1.0f / value.pdf);
  s.pdf = value.pdf;
  s.bent = normals.bent;
  return s;
}

EMBRUN_LOCAL_FN BsdfSample sample_rough(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo, float u_lobe,
                                        Sample2 u) {
  const Frame frame = facet_frame(normals.shading, bsdf.tangent);
  FacetEvent event;
  event.wo = frame.to_local(wo);
  event.m = sample_facet(facets_of(bsdf), event.wo, u);
  const float cosine = min_of(dot(event.wo, event.m), 1.0f);
  if (!(cosine > 0.0f)) return {};
  event.wi = reflect_about(event.wo, event.m);
  if (bsdf.kind == BsdfKind::rough_dielectric) {
    const FresnelResult fresnel = fresnel_dielectric(cosine, bsdf.relative_index);
    event.transmits = u_lobe >= fresnel.reflectance;
    if (event.transmits)
      event.wi = refract_through(event.wo, event.m, cosine, fresnel.cos_transmitted, bsdf.relative_index);
  }
  if (event.transmits != (event.wi.z < 0.0f)) return {};
  return facet_sample(normals, frame, event, rough_event(bsdf, event));
}

}  // namespace embrun

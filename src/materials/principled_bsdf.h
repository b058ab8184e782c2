#pragma once

#include "materials/rough_bsdf.h"

// Burley's principled BSDF [Burley2012, Burley2015] with the lobes and names of Mitsuba 3's `principled`: a diffuse base
// with retro-reflection (or flattened, like thin flesh), sheen, a main lobe of GGX facets that blends metal, tinted
// dielectric and rough glass, and a clear coat. Lobes are added up, so bright ones together may reflect somewhat more
// than arrives.

namespace embrun {

/// What the lobes share for one point and viewer, and how often each is drawn.
struct PrincipledLobes {
  PrincipledParameters parameters;
  Microfacets facets;
  float index;          ///< n_far / n_near
  float base, glass;    ///< shares of the diffuse base and of glass in what is not metal
  float coat_alpha;     ///< of the clear coat's facets
  bool inside;          ///< the viewer is in the glass: there is nothing else there
  float diffuse, coat;  ///< probabilities; what is left is the main lobe's
};

EMBRUN_FN PrincipledLobes principled_lobes(const Bsdf& bsdf, const FacingNormals& normals) {
  PrincipledLobes lobes;
  const PrincipledParameters& p = lobes.parameters = bsdf.parameters->principled;
  lobes.facets = {MicrofacetDistribution::ggx, bsdf.alpha_u, bsdf.alpha_v};
  // Matched indices would make refraction a single direction.
  lobes.index = fabsf(bsdf.relative_index - 1.0f) < 1e-3f ? 1.001f : bsdf.relative_index;
  lobes.base = (1.0f - p.metallic) * (1.0f - p.spec_trans);
  lobes.glass = (1.0f - p.metallic) * p.spec_trans;
  lobes.coat_alpha = 0.1f - 0.099f * p.clearcoat_gloss;
  lobes.inside = p.spec_trans > 0.0f && !normals.from_front;
  const float diffuse = lobes.inside ? 0.0f : lobes.base, coat = lobes.inside ? 0.0f : 0.25f * p.clearcoat;
  const float all = 1.0f / (1.0f + diffuse + coat);
  lobes.diffuse = diffuse * all;
  lobes.coat = coat * all;
  return lobes;
}

/// (1 - cos)^5 [Schlick1994].
EMBRUN_FN float schlick_weight(float cosine) {
  const float c = clamp(1.0f - cosine, 0.0f, 1.0f);
  return square(square(c)) * c;
}

/// A colour's hue: it over its luminance.
EMBRUN_FN Rgb tint_of(Rgb color) {
  const float y = luminance(color);
  return y > 0.0f ? color * (1.0f / y) : grey(1.0f);
}

/// Share of the main lobe's facets that refract, where `fresnel` is a facet's reflectance.
EMBRUN_FN float refracted_share(const PrincipledLobes& lobes, float fresnel) {
  return (lobes.inside ? 1.0f : lobes.glass) * (1.0f - fresnel);
}

/// Reflectance of a facet of the main lobe, seen under `cosine`.
EMBRUN_FN Rgb principled_fresnel(const PrincipledLobes& lobes, Rgb color, float cosine) {
  const PrincipledParameters& p = lobes.parameters;
  const FresnelResult exact = fresnel_dielectric(cosine, lobes.index);
  if (lobes.inside) return grey(lobes.glass * exact.reflectance);
  const float rise = schlick_weight(lobes.index > 1.0f ? cosine : exact.cos_transmitted);
  const auto schlick = [rise](Rgb normal) { return normal + (grey(1.0f) - normal) * rise; };
  const Rgb tinted = tint_of(color) * square((lobes.index - 1.0f) / (lobes.index + 1.0f));
  return grey((1.0f - p.metallic) * (1.0f - p.spec_tint) * exact.reflectance) + p.metallic * schlick(color) +
         ((1.0f - p.metallic) * p.spec_tint) * schlick(tinted);
}

/// The facets of the clear coat: D of "GTR1", whose tails are long; drawn with density D(m) m.z.
EMBRUN_FN float coat_density(float alpha, Vec3 m) {
  const float a2 = alpha * alpha;
  return (1.0f - a2) / (pi * -logf(a2) * (m.x * m.x + m.y * m.y + a2 * m.z * m.z));
}
EMBRUN_FN Vec3 sample_coat(float alpha, Sample2 u) {
  const float a2 = alpha * alpha;
  const float sin2 = (powf(a2, 1.0f - u.y) - a2) / (1.0f - a2);
  const float sine = sqrtf(clamp(sin2, 0.0f, 1.0f)), angle = 2.0f * pi * u.x;
  return {sine * cosf(angle), sine * sinf(angle), sqrtf(max_of(1.0f - sin2, 1e-12f))};
}

/// The base, its retro-reflection and the sheen, times the cosine.
EMBRUN_FN Rgb principled_diffuse(const PrincipledLobes& lobes, const Bsdf& bsdf, const FacetEvent& e) {
  const PrincipledParameters& p = lobes.parameters;
  const float cos_half = dot(e.wi, e.m);
  const float out = schlick_weight(e.wo.z), in = schlick_weight(e.wi.z);
  const float retro = 2.0f * bsdf.roughness * square(cos_half);
  const float straight = (1.0f - 0.5f * in) * (1.0f - 0.5f * out) + retro * (out + in + out * in * (retro - 1.0f));
  const float grazing = 0.5f * retro;
  const float spread = (1.0f + (grazing - 1.0f) * out) * (1.0f + (grazing - 1.0f) * in);
  const float flat = 1.25f * (spread * (1.0f / (e.wo.z + e.wi.z) - 0.5f) + 0.5f);
  const Rgb sheen = grey(1.0f - p.sheen_tint) + tint_of(bsdf.reflectance) * p.sheen_tint;
  return (bsdf.reflectance * (lobes.base * inv_pi * (straight + (flat - straight) * p.flatness)) +
          sheen * (p.sheen * (1.0f - p.metallic) * schlick_weight(cos_half))) *
         e.wi.z;
}

/// What all lobes that reflect send from wi to wo.
EMBRUN_FN BsdfValue principled_reflection(const PrincipledLobes& lobes, const Bsdf& bsdf, const FacetEvent& e) {
  const float cosine = min_of(dot(e.wo, e.m), 1.0f), jacobian = reflection_jacobian(e);
  const float fresnel = fresnel_dielectric(cosine, lobes.index).reflectance;
  const float seen = facet_density(lobes.facets, e.m) * facet_visibility(lobes.facets, e.wo, e.wi, e.m);
  BsdfValue sum;
  sum.value = principled_fresnel(lobes, bsdf.reflectance, cosine) * (seen / (4.0f * e.wo.z));
  sum.pdf = (1.0f - lobes.diffuse - lobes.coat) * (1.0f - refracted_share(lobes, fresnel)) *
            facet_pdf(lobes.facets, e.wo, e.m) * jacobian;
  if (lobes.coat > 0.0f) {
    const float reflectance = 0.04f + 0.96f * schlick_weight(cosine);
    const float density = coat_density(lobes.coat_alpha, e.m);
    const Microfacets shadows{MicrofacetDistribution::ggx, 0.25f, 0.25f};
    const float visible = facet_visibility(shadows, e.wo, e.wi, e.m);
    sum.value += grey(0.25f * lobes.parameters.clearcoat * reflectance * density * visible * e.wi.z);
    sum.pdf += lobes.coat * density * e.m.z * jacobian;
  }
  if (lobes.diffuse > 0.0f) {
    sum.value += principled_diffuse(lobes, bsdf, e);
    sum.pdf += lobes.diffuse * cosine_hemisphere_pdf(e.wi.z);
  }
  return sum;
}

EMBRUN_FN BsdfValue principled_refraction(const PrincipledLobes& lobes, const Bsdf& bsdf, const FacetEvent& e) {
  const float cosine = min_of(dot(e.wo, e.m), 1.0f);
  const float through = 1.0f - fresnel_dielectric(cosine, lobes.index).reflectance;
  const float jacobian = refraction_jacobian(e, lobes.index);
  const float seen = facet_density(lobes.facets, e.m) * facet_visibility(lobes.facets, e.wo, e.wi, e.m);
  const Rgb c = bsdf.reflectance;  // crossed twice by what passes through a body
  const float value =
      lobes.glass * through * seen * cosine / e.wo.z * jacobian * refraction_radiance_factor(lobes.index);
  return {Rgb{sqrtf(c.r), sqrtf(c.g), sqrtf(c.b)} * value, (1.0f - lobes.diffuse - lobes.coat) *
                                                               refracted_share(lobes, 1.0f - through) *
                                                               facet_pdf(lobes.facets, e.wo, e.m) * jacobian};
}

EMBRUN_FN BsdfValue principled_event(const PrincipledLobes& lobes, const Bsdf& bsdf, const FacetEvent& e) {
  return e.transmits ? principled_refraction(lobes, bsdf, e) : principled_reflection(lobes, bsdf, e);
}

EMBRUN_LOCAL_FN BsdfValue evaluate_principled(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo, Vec3 wi) {
  const PrincipledLobes lobes = principled_lobes(bsdf, normals);
  const ScatterSide side = scatter_side(normals, wi);
  if (!side.reflects && !(side.transmits && lobes.glass > 0.0f)) return {};
  const Frame frame = facet_frame(normals.shading, bsdf.tangent);
  const FacetEvent event = facet_between(frame.to_local(wo), frame.to_local(wi), lobes.index);
  return event.m.z > 0.0f ? principled_event(lobes, bsdf, event) : BsdfValue{};
}

EMBRUN_LOCAL_FN BsdfSample sample_principled(const Bsdf& bsdf, const FacingNormals& normals, Vec3 wo, float u_lobe,
                                             Sample2 u) {
  const PrincipledLobes lobes = principled_lobes(bsdf, normals);
  const Frame frame = facet_frame(normals.shading, bsdf.tangent);
  FacetEvent event;
  event.wo = frame.to_local(wo);
  const float drawn = lobes.diffuse + lobes.coat;
  if (u_lobe < lobes.diffuse) {
    event.wi = sample_cosine_hemisphere(u);
    event.m = normalize(event.wo + event.wi);
  } else {
    const bool coat = u_lobe < drawn;
    event.m = coat ? sample_coat(lobes.coat_alpha, u) : sample_facet(lobes.facets, event.wo, u);
    const float cosine = min_of(dot(event.wo, event.m), 1.0f);
    if (!(cosine > 0.0f)) return {};
    const FresnelResult fresnel = fresnel_dielectric(cosine, lobes.index);
    event.transmits =
        !coat && (u_lobe - drawn) >= (1.0f - drawn) * (1.0f - refracted_share(lobes, fresnel.reflectance));
    event.wi = event.transmits ? refract_through(event.wo, event.m, cosine, fresnel.cos_transmitted, lobes.index)
                               : reflect_about(event.wo, event.m);
    if (event.transmits != (event.wi.z < 0.0f)) return {};
  }
  return facet_sample(normals, frame, event, principled_event(lobes, bsdf, event));
}

}  // namespace embrun

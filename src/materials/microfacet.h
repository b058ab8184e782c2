#pragma once

#include "materials/bsdf_types.h"

// Microfacets: a surface of tiny mirrors whose normals are spread about the surface's own [Walter2007]. Vectors are unit
// vectors of a local frame whose z axis is the surface's normal; normals m have z > 0.

namespace embrun {

/// Least alpha: a smoother surface cannot be told from a smooth one, and single precision would suffer.
inline constexpr float min_alpha = 1e-3f;

struct Microfacets {
  MicrofacetDistribution distribution;
  float alpha_u, alpha_v;  ///< along x and y
};

/// D(m): area of facets per area of surface and steradian of their normal.
EMBRUN_FN float facet_density(const Microfacets& facets, Vec3 m) {
  if (!(m.z > 0.0f)) return 0.0f;
  const float slopes = square(m.x / facets.alpha_u) + square(m.y / facets.alpha_v);
  const float scale = pi * facets.alpha_u * facets.alpha_v;
  if (facets.distribution == MicrofacetDistribution::ggx) return 1.0f / (scale * square(slopes + m.z * m.z));
  const float cos2 = m.z * m.z;
  return expf(-slopes / cos2) / (scale * cos2 * cos2);
}

/// G1(w, m): share of the facets with normal m that is not hidden from w [Smith1967]. For Beckmann the rational fit of
/// [Walter2007], within 0.35 %.
EMBRUN_FN float facet_visibility(const Microfacets& facets, Vec3 w, Vec3 m) {
  if (!(dot(w, m) * w.z > 0.0f)) return 0.0f;
  const float stretch = (square(facets.alpha_u * w.x) + square(facets.alpha_v * w.y)) / (w.z * w.z);
  if (facets.distribution == MicrofacetDistribution::ggx) return 2.0f / (1.0f + sqrtf(1.0f + stretch));
  if (!(stretch > 0.390625f)) return 1.0f;  // 1 / 1.6^2
  const float a = 1.0f / sqrtf(stretch);
  return (3.535f * a + 2.181f * a * a) / (1.0f + 2.276f * a + 2.577f * a * a);
}

/// The share of facets seen from both sides, the two taken for independent.
EMBRUN_FN float facet_visibility(const Microfacets& facets, Vec3 wo, Vec3 wi, Vec3 m) {
  return facet_visibility(facets, wo, m) * facet_visibility(facets, wi, m);
}

/// Draws the normal of a facet that a path coming along `wo` (wo.z > 0) meets. GGX: the visible normals, as caps of a
/// sphere [Dupuy2023]. Beckmann: all normals, with density D(m) m.z.
EMBRUN_FN Vec3 sample_facet(const Microfacets& facets, Vec3 wo, Sample2 u) {
  const float angle = 2.0f * pi * u.x;
  if (facets.distribution == MicrofacetDistribution::ggx) {
    const Vec3 stretched = normalize(Vec3{facets.alpha_u * wo.x, facets.alpha_v * wo.y, wo.z});
    const float z = 1.0f - u.y * (1.0f + stretched.z);
    const float ring = sqrtf(max_of(0.0f, 1.0f - z * z));
    const Vec3 half = Vec3{ring * cosf(angle), ring * sinf(angle), z} + stretched;
    return normalize(Vec3{facets.alpha_u * half.x, facets.alpha_v * half.y, max_of(half.z, 1e-6f)});
  }
  const float slope = sqrtf(-logf(1.0f - u.y));
  return normalize(Vec3{facets.alpha_u * slope * cosf(angle), facets.alpha_v * slope * sinf(angle), 1.0f});
}

/// Density of sample_facet per steradian of m.
EMBRUN_FN float facet_pdf(const Microfacets& facets, Vec3 wo, Vec3 m) {
  const float density = facet_density(facets, m);
  if (facets.distribution == MicrofacetDistribution::beckmann) return density * m.z;
  return facet_visibility(facets, wo, m) * max_of(dot(wo, m), 0.0f) * density / wo.z;
}

/// The frame of the surface: x along the tangent, as far as the shading normal lets it.
EMBRUN_FN Frame facet_frame(Vec3 normal, Vec3 tangent) {
  Frame frame(normal);
  const Vec3 along = tangent - normal * dot(tangent, normal);
  if (!(length_squared(along) > 1e-12f)) return frame;
  frame.s = normalize(along);
  frame.t = cross(normal, frame.s);
  return frame;
}

}  // namespace embrun

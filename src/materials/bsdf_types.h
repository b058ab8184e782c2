#pragma once

#include <cstdint>

#include "materials/shading_normal.h"
#include "math/rgb.h"
#include "sampling/warp.h"

namespace embrun {

// Conventions of sample_bsdf, eval_bsdf and pdf_bsdf (bsdf.h), and of the functions of each kind that they call:
// - Frame: directions and normals are unit vectors in scene coordinates.
// - Directions: `wo` points from the surface to where the path came from (the camera side), `wi` to where it goes
//   on (the light side). Both point away from the surface.
// - Measure: densities are per steradian round the surface point. What reflects or refracts into a single direction is
//   a discrete choice instead: a sample that `specular` marks has the probability of that choice as its pdf, and eval
//   and pdf leave such choices out. The kinds for which is_specular holds have nothing else, plastic has both.
// - The cosine |dot(wi, shading normal)| is inside both eval's value and a sample's weight.
// - On failure (nothing is scattered) a sample has `valid == false` and weight 0.
// - Radiance: where a path from the camera crosses from index n_near into n_far, the weight and the value have the
//   factor (n_near / n_far)^2, for radiance is compressed by refraction. So inside water of an environment of radiance 1
//   the radiance is n^2 = 1.77, and a camera in air sees exactly 1 again.

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

/// What BsdfKind::principled has besides base colour, roughness and index; each in [0, 1].
struct PrincipledParameters {
  float metallic = 0;
  float spec_trans = 0;
  float spec_tint = 0;
  float sheen = 0, sheen_tint = 0;
  float flatness = 0;
  float clearcoat = 0, clearcoat_gloss = 0;
};

/// What is the same all over a material, for the kinds that need more than Bsdf holds.
struct BsdfParameters {
  MicrofacetDistribution distribution = MicrofacetDistribution::ggx;
  bool nonlinear = false;  ///< of plastic: the base's colour counts once for every reflection inside
  /// Factors on what an interface reflects and lets through.
  Rgb specular_reflectance{1, 1, 1}, specular_transmittance{1, 1, 1};
  Rgb eta{0, 0, 0}, k{1, 1, 1};  ///< complex index eta + i k of conductors
  /// Mean Fresnel reflectance of the coat of a plastic for diffuse light from below.
  float inner_reflectance = 0;
  PrincipledParameters principled;
};

/// What a material is at one surface point, ready to scatter.
struct Bsdf {
  BsdfKind kind = BsdfKind::null;
  Rgb reflectance{0, 0, 0};  ///< each channel in [0, 1]
  float relative_index = 1;  ///< n_far / n_near, as seen from `wo`
  /// Of the rough kinds, along the tangent and across it: the distribution's alpha, at least min_alpha.
  float alpha_u = 0.1f, alpha_v = 0.1f;
  float roughness = 0.3f;  ///< of principled
  Vec3 tangent;            ///< where u grows; zero: any
  /// Null for null and diffuse, and for a dielectric without factors.
  const BsdfParameters* parameters = nullptr;
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

/// A value and the density with which its direction is drawn.
struct BsdfValue {
  Rgb value;
  float pdf = 0;
};

/// True for kinds that scatter into single directions only.
EMBRUN_FN bool is_specular(const Bsdf& bsdf) {
  return bsdf.kind == BsdfKind::null || bsdf.kind == BsdfKind::dielectric || bsdf.kind == BsdfKind::conductor ||
         bsdf.kind == BsdfKind::thin_dielectric;
}

/// True for the interfaces of media that are nothing where the indices on both sides agree.
EMBRUN_FN bool is_interface(BsdfKind kind) {
  return kind == BsdfKind::dielectric || kind == BsdfKind::rough_dielectric;
}

/// Factor on the radiance seen through an interface from the near side: (n_near / n_far)^2.
EMBRUN_FN float refraction_radiance_factor(float relative_index) { return 1.0f / (relative_index * relative_index); }

/// Which side of the true surface a direction is on, if the shading normal agrees; neither otherwise: the direction
/// carries nothing.
struct ScatterSide {
  bool reflects = false, transmits = false;
};
EMBRUN_FN ScatterSide scatter_side(const FacingNormals& normals, Vec3 wi) {
  const float geometric = dot(wi, normals.geometric), shading = dot(wi, normals.shading);
  return {geometric > 0.0f && shading > 0.0f, geometric < 0.0f && shading < 0.0f};
}

}  // namespace embrun

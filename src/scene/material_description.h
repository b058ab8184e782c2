#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "image/image.h"
#include "materials/bsdf.h"
#include "materials/texture.h"
#include "math/rgb.h"
#include "math/vec.h"
#include "media/phase_function.h"

// Materials and their textures as plain data, part of scene_description.h.

namespace embrun {

/// A picture that textures show: linear values, 1 or 3 channels, none negative.
struct PictureDescription {
  Image image;
  bool raw = false;  ///< its file's values were taken as they are, without the decoding from sRGB
  std::string file;  ///< where the picture is from, or empty

  bool operator==(const PictureDescription&) const = default;
};

/// A colour over space or over a surface's coordinates (u, v), which the geometry decides: see
/// geometry/surface_coordinates.h. TextureKind::own is for splats with colours.
struct TextureDescription {
  TextureKind kind = TextureKind::constant;
  Rgb first{0.5f, 0.5f, 0.5f};
  Rgb second{0.2f, 0.2f, 0.2f};

  // Of TextureKind::checker, a checkerboard in space: square cells of side `cell` in the plane of two axes, cell (0, 0)
  // with its corner at `origin` shows `first`.
  double cell = 1;  ///< metres, > 0
  Vec3d origin;
  int axis_u = 0, axis_v = 2;  ///< 0 to 2, different

  // Of uv_checker, whose pattern repeats at every whole number and whose first cell is [0, 0.5] x [0, 0.5], and of
  // bitmap, whose picture fills [0, 1] x [0, 1], with its first row at v = 0.
  /// Two rows of three: (u, v) become (m0 u + m1 v + m2, m3 u + m4 v + m5) first.
  std::array<double, 6> to_uv{1, 0, 0, 0, 1, 0};
  int picture = -1;  ///< of a bitmap: index into SceneDescription::pictures
  TextureWrap wrap = TextureWrap::repeat;
  TextureFilter filter = TextureFilter::bilinear;

  bool operator==(const TextureDescription&) const = default;
};

inline TextureDescription constant_texture_description(Rgb value) {
  TextureDescription texture;
  texture.first = value;
  return texture;
}

/// What a principled material has beyond its base colour (`reflectance`), `roughness` and `ior`; all in [0, 1]
/// [Burley2012, Burley2015].
struct PrincipledDescription {
  double metallic = 0;
  double anisotropic = 0;
  double spec_trans = 0;  ///< share of what is not metallic that lets light through; above 0 it bounds a medium
  double spec_tint = 0;
  double sheen = 0, sheen_tint = 0;
  double flatness = 0;
  double clearcoat = 0, clearcoat_gloss = 0;

  bool operator==(const PrincipledDescription&) const = default;
};

/// What a surface is made of, and what is behind it if light gets there. A material of kind `null` bounds a medium without
/// being seen itself: the body of a fog.
struct MaterialDescription {
  BsdfKind kind = BsdfKind::diffuse;
  bool one_sided = false;  ///< seen only from where the normal points
  /// Of diffuse; of a plastic's base; the base colour of a principled one; a factor on what conductors reflect. Channels
  /// in [0, 1].
  TextureDescription reflectance;
  /// Factors on what the interfaces of dielectrics (smooth, thin, rough) and plastics reflect and let through; in [0, 1].
  /// Other than 1 they are not physical.
  Rgb specular_reflectance{1, 1, 1}, specular_transmittance{1, 1, 1};
  MicrofacetDistribution distribution = MicrofacetDistribution::ggx;  ///< of rough dielectrics and conductors
  /// The mean of its channels counts, in [0, 1]: the distribution's alpha (root mean square slope of Beckmann's), or
  /// the `roughness` of a principled material, whose alpha is the square of it. Below 0.001 counts as 0.001.
  TextureDescription roughness = constant_texture_description({0.1f, 0.1f, 0.1f});
  /// Alpha across the direction of u, for rough dielectrics and conductors that are not alike in all directions.
  std::optional<double> roughness_v;
  /// Complex index of a conductor, eta + i k, relative to what is round it. 0 + i: everything is reflected.
  Rgb eta{0, 0, 0}, k{1, 1, 1};
  bool nonlinear = false;  ///< of a plastic: colours deepen by light that is reflected inside several times
  PrincipledDescription principled;
  /// What is seen from where the normal does not point, if it is something else: none or one material. Both must be
  /// opaque.
  std::vector<MaterialDescription> back;

  /// Index inside a dielectric (smooth or rough) or a principled material with spec_trans, in [1, 10]. That of a thin
  /// dielectric, a plastic and an opaque principled material is relative to what is round it, in [0.1, 10].
  double ior = 1.33;
  Rgb absorption;        ///< of the inside, per metre
  Rgb scattering;        ///< of the inside, per metre: the same everywhere in it
  PhaseFunction phase;   ///< of that scattering
  int grid_medium = -1;  ///< what fills the inside besides: index into SceneDescription::grid_media, or -1
  /// Where bodies overlap the inside of the highest priority counts; bodies whose insides are the same in priority, ior,
  /// absorption, scattering, phase function and grid are one solid. 1 and up; the air has 0.
  int priority = 1;

  bool operator==(const MaterialDescription&) const = default;
};

/// True for materials that bound a medium: dielectrics, and invisible boundaries of something that absorbs or scatters.
inline bool has_inside(const MaterialDescription& material) {
  if (is_interface(material.kind)) return true;
  if (material.kind == BsdfKind::principled) return material.principled.spec_trans > 0;
  return material.kind == BsdfKind::null &&
         (material.grid_medium >= 0 || !(is_black(material.absorption) && is_black(material.scattering)));
}

/// True for materials that let no light through, and so may have another on their back.
inline bool is_opaque(const MaterialDescription& material) {
  using enum BsdfKind;
  return material.kind == diffuse || material.kind == conductor || material.kind == rough_conductor ||
         material.kind == plastic || (material.kind == principled && !has_inside(material));
}

inline MaterialDescription diffuse_material(Rgb reflectance) {
  MaterialDescription material;
  material.reflectance.first = reflectance;
  return material;
}

inline MaterialDescription dielectric_material(double ior, Rgb absorption = {}, int priority = 1) {
  MaterialDescription material;
  material.kind = BsdfKind::dielectric;
  material.ior = ior;
  material.absorption = absorption;
  material.priority = priority;
  return material;
}

/// A metal by its complex index; as it is, a mirror that reflects everything.
inline MaterialDescription conductor_material(Rgb eta = {0, 0, 0}, Rgb k = {1, 1, 1}) {
  MaterialDescription material;
  material.kind = BsdfKind::conductor;
  material.reflectance.first = {1, 1, 1};
  material.eta = eta;
  material.k = k;
  return material;
}

/// The invisible boundary of a medium in air.
inline MaterialDescription fog_material(Rgb absorption, Rgb scattering, PhaseFunction phase = {}, int priority = 1) {
  MaterialDescription material;
  material.kind = BsdfKind::null;
  material.ior = 1;
  material.absorption = absorption;
  material.scattering = scattering;
  material.phase = phase;
  material.priority = priority;
  return material;
}

}  // namespace embrun

#include "io/scene/write_materials.h"

#include <fmt/format.h>

#include <optional>

#include "base/error.h"
#include "scene/each_material.h"

namespace embrun {
namespace {

/// Writes materials: what they show of pictures needs the scene's list of them.
void write_texture(Xml& xml, const Pictures& pictures, const char* name, const TextureDescription& texture) {
  const auto start = [&](const char* type) { xml.open(fmt::format("texture name=\"{}\" type=\"{}\"", name, type)); };
  const auto colors = [&] {
    xml.color("color0", texture.first);
    xml.color("color1", texture.second);
  };
  switch (texture.kind) {
    case TextureKind::constant: xml.color(name, texture.first); return;
    case TextureKind::checker:
      start("world_checkerboard");
      colors();
      xml.real("cell", texture.cell);
      xml.point("origin", texture.origin);
      xml.whole("axis_u", texture.axis_u);
      xml.whole("axis_v", texture.axis_v);
      break;
    case TextureKind::own:
      start("mesh_attribute");
      xml.text("name", "vertex_color");
      xml.close();
      return;
    case TextureKind::uv_checker:
      start("checkerboard");
      colors();
      break;
    case TextureKind::bitmap: {
      constexpr const char* wraps[] = {"repeat", "mirror", "clamp"};
      const PictureDescription& picture = pictures.at(static_cast<std::size_t>(texture.picture));
      need_file(picture.file, "picture", static_cast<std::size_t>(texture.picture));
      start("bitmap");
      xml.file(picture.file);
      if (picture.raw) xml.flag("raw", true);
      xml.text("wrap_mode", wraps[static_cast<int>(texture.wrap)]);
      xml.text("filter_type", texture.filter == TextureFilter::nearest ? "nearest" : "bilinear");
      break;
    }
  }
  const auto& m = texture.to_uv;
  const Placement to_uv{{m[0], m[3], 0}, {m[1], m[4], 0}, {0, 0, 1}, {m[2], m[5], 0}};
  if (texture.kind != TextureKind::checker) xml.placement(to_uv, "to_uv");
  xml.close();
}

void write_roughness(Xml& xml, const Pictures& pictures, const MaterialDescription& material) {
  xml.text("distribution", material.distribution == MicrofacetDistribution::ggx ? "ggx" : "beckmann");
  write_texture(xml, pictures, material.roughness_v ? "alpha_u" : "alpha", material.roughness);
  if (material.roughness_v) xml.real("alpha_v", *material.roughness_v);
}

void write_indices(Xml& xml, const MaterialDescription& material) {
  xml.real("int_ior", material.ior);
  xml.real("ext_ior", 1.0);
}

void write_principled(Xml& xml, const Pictures& pictures, const MaterialDescription& material) {
  const PrincipledDescription& p = material.principled;
  write_texture(xml, pictures, "base_color", material.reflectance);
  write_texture(xml, pictures, "roughness", material.roughness);
  xml.real("eta", material.ior);
  xml.real("metallic", p.metallic);
  xml.real("anisotropic", p.anisotropic);
  xml.real("spec_trans", p.spec_trans);
  xml.real("spec_tint", p.spec_tint);
  xml.real("sheen", p.sheen);
  xml.real("sheen_tint", p.sheen_tint);
  xml.real("flatness", p.flatness);
  xml.real("clearcoat", p.clearcoat);
  xml.real("clearcoat_gloss", p.clearcoat_gloss);
}

/// The properties of the bsdf that has been opened.
void write_properties(Xml& xml, const Pictures& pictures, const MaterialDescription& material) {
  const auto factors = [&](bool transmits) {
    if (!(material.specular_reflectance == grey(1))) xml.color("specular_reflectance", material.specular_reflectance);
    if (transmits && !(material.specular_transmittance == grey(1)))
      xml.color("specular_transmittance", material.specular_transmittance);
  };
  switch (material.kind) {
    case BsdfKind::null: break;
    case BsdfKind::diffuse: write_texture(xml, pictures, "reflectance", material.reflectance); break;
    case BsdfKind::dielectric:
    case BsdfKind::rough_dielectric:
      write_indices(xml, material);
      factors(true);
      if (material.kind == BsdfKind::rough_dielectric) write_roughness(xml, pictures, material);
      break;
    case BsdfKind::thin_dielectric:
      write_indices(xml, material);
      factors(true);
      break;
    case BsdfKind::conductor:
    case BsdfKind::rough_conductor:
      xml.color("eta", material.eta);
      xml.color("k", material.k);
      write_texture(xml, pictures, "specular_reflectance", material.reflectance);
      if (material.kind == BsdfKind::rough_conductor) write_roughness(xml, pictures, material);
      break;
    case BsdfKind::plastic:
      write_indices(xml, material);
      write_texture(xml, pictures, "diffuse_reflectance", material.reflectance);
      factors(false);
      if (material.nonlinear) xml.flag("nonlinear", true);
      break;
    case BsdfKind::principled: write_principled(xml, pictures, material); break;
  }
  if (has_inside(material) || (material.kind == BsdfKind::null && material.priority != 1))
    xml.whole("priority", material.priority);
  if (material.one_sided) xml.flag("one_sided", true);
}

void write_value_grid(Xml& xml, const char* name, const ValueGridDescription& grid, std::size_t index) {
  need_file(grid.file, "grid medium", index);
  xml.open(fmt::format("volume name=\"{}\" type=\"gridvolume\"", name));
  xml.file(grid.file);
  if (grid.nearest) xml.text("filter_type", "nearest");
  xml.placement(grid.placement);
  xml.close();
}

/// `absorption`: what the bodies that it fills have besides.
void write(Xml& xml, const GridMediumDescription& medium, std::size_t index, Rgb absorption) {
  xml.open("medium type=\"heterogeneous\" id=\"" + grid_medium_id(static_cast<int>(index)) + "\"");
  if (medium.extinction_grid)
    write_value_grid(xml, "sigma_t", *medium.extinction_grid, index);
  else
    xml.color("sigma_t", medium.extinction);
  if (medium.albedo_grid)
    write_value_grid(xml, "albedo", *medium.albedo_grid, index);
  else
    xml.color("albedo", medium.albedo);
  xml.real("scale", medium.scale);
  if (!is_black(absorption)) xml.color("sigma_a", absorption);
  write_phase(xml, medium.phase);
  xml.close();
}

}  // namespace

void write_phase(Xml& xml, const PhaseFunction& phase) {
  switch (phase.kind) {
    case PhaseKind::isotropic: return;
    case PhaseKind::rayleigh: xml.line("<phase type=\"rayleigh\"/>"); return;
    case PhaseKind::henyey_greenstein: break;
  }
  xml.open("phase type=\"hg\"");
  xml.real("g", phase.g);
  xml.close();
}

void write_bsdf(Xml& xml, const Pictures& pictures, const MaterialDescription& material, const std::string& id) {
  constexpr const char* types[] = {"null",           "diffuse",        "dielectric",
                                   "conductor",      "thindielectric", "roughdielectric",
                                   "roughconductor", "plastic",        "principled"};
  const std::string with_id = id.empty() ? "" : " id=\"" + id + "\"";
  // A bsdf by itself is black from behind.
  const std::vector<MaterialDescription> black{diffuse_material({0, 0, 0})};
  if (is_opaque(material) && !material.one_sided && material.back != black) {
    MaterialDescription side = material;
    side.back = black;
    xml.open("bsdf type=\"twosided\"" + with_id);
    write_bsdf(xml, pictures, side);
    if (!material.back.empty()) {
      side = material.back.front();
      side.back = black;
      write_bsdf(xml, pictures, side);
    }
  } else {
    xml.open(fmt::format("bsdf type=\"{}\"{}", types[static_cast<int>(material.kind)], with_id));
    write_properties(xml, pictures, material);
  }
  xml.close();
}

std::string grid_medium_id(int index) { return fmt::format("grid_medium_{}", index + 1); }

void write_interior(Xml& xml, const MaterialDescription& material, const std::string& id) {
  if (material.grid_medium >= 0) {
    if (id.empty()) xml.line("<ref name=\"interior\" id=\"" + grid_medium_id(material.grid_medium) + "\"/>");
    return;
  }
  if (is_black(material.absorption) && is_black(material.scattering)) return;
  xml.open(id.empty() ? "medium name=\"interior\" type=\"homogeneous\""
                      : "medium id=\"" + id + "\" type=\"homogeneous\"");
  xml.color("sigma_a", material.absorption);
  xml.color("sigma_s", material.scattering);
  write_phase(xml, material.phase);
  xml.close();
}

void write_grid_media(Xml& xml, const SceneDescription& scene) {
  std::vector<std::optional<Rgb>> absorption(scene.grid_media.size());
  each_material(scene, [&](const MaterialDescription& material, const char* what, std::size_t i) {
    if (material.grid_medium < 0) return;
    std::optional<Rgb>& own = absorption.at(static_cast<std::size_t>(material.grid_medium));
    if (!is_black(material.scattering) || (own && !(*own == material.absorption)))
      throw Error(fmt::format(
          "{} {}: it has a medium on a grid and others besides it that a scene file cannot say together", what, i + 1));
    own = material.absorption;
  });
  for (std::size_t i = 0; i < scene.grid_media.size(); ++i)
    write(xml, scene.grid_media[i], i, absorption[i].value_or(Rgb{}));
}

}  // namespace embrun

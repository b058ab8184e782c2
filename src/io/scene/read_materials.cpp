#include <fmt/format.h>

#include <cmath>

#include "io/scene/indices.h"
#include "io/scene/reading.h"
#include "io/text.h"

namespace embrun {
namespace {

double ratio(const IndexPair& indices) { return indices.interior / indices.exterior; }

/// The index inside, and which body wins where several overlap.
void read_inside(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  const IndexPair indices = read_indices(bsdf);
  if (const std::optional<int> priority = bsdf.integer("priority", 1, 1000)) {
    material.ior = ratio(indices);
    material.priority = *priority;
    return;
  }
  const BodyPriorities::Body* body = reading.priorities.find(indices.interior, indices.exterior);
  if (body == nullptr)
    bsdf.fail(
        fmt::format("what is round it cannot be told: no dielectric here has the ext_ior {} as its int_ior; an "
                    "<integer name=\"priority\"> says which body wins where two overlap",
                    indices.exterior));
  material.ior = body->ior;
  material.priority = body->priority;
}

void read_factors(SceneObject& bsdf, MaterialDescription& material, bool transmits) {
  material.specular_reflectance = bsdf.color("specular_reflectance").value_or(grey(1));
  if (transmits) material.specular_transmittance = bsdf.color("specular_transmittance").value_or(grey(1));
}

/// The microfacets of rough dielectrics and conductors.
void read_roughness(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  const std::string distribution = bsdf.text("distribution").value_or("beckmann");
  if (distribution != "beckmann" && distribution != "ggx")
    bsdf.fail(fmt::format("'distribution' is {}: there are beckmann, ggx", quoted(distribution)));
  material.distribution = distribution == "ggx" ? MicrofacetDistribution::ggx : MicrofacetDistribution::beckmann;
  bsdf.ignore("sample_visible", "visible normals are always sampled");
  if (bsdf.has("alpha_u") != bsdf.has("alpha_v")) bsdf.fail("give both 'alpha_u' and 'alpha_v', or 'alpha'");
  if (!bsdf.has("alpha_u")) {
    material.roughness = read_texture(reading, bsdf, "alpha", grey(0.1f));
    return;
  }
  if (bsdf.has("alpha")) bsdf.fail("give either 'alpha', or 'alpha_u' and 'alpha_v'");
  material.roughness = read_texture(reading, bsdf, "alpha_u", grey(0.1f));
  material.roughness_v = bsdf.number("alpha_v");
}

void read_diffuse(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  material.reflectance = read_texture(reading, bsdf, "reflectance", grey(0.5f));
}

void read_dielectric(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  material.kind = BsdfKind::dielectric;
  read_inside(reading, bsdf, material);
  read_factors(bsdf, material, true);
}

void read_rough_dielectric(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  material.kind = BsdfKind::rough_dielectric;
  read_inside(reading, bsdf, material);
  read_factors(bsdf, material, true);
  read_roughness(reading, bsdf, material);
}

void read_thin_dielectric(SceneReading&, SceneObject& bsdf, MaterialDescription& material) {
  material.kind = BsdfKind::thin_dielectric;
  material.ior = ratio(read_indices(bsdf));
  read_factors(bsdf, material, true);
}

void read_conductor(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  material.kind = BsdfKind::conductor;
  const ComplexIndex index = read_complex_index(bsdf);
  material.eta = index.eta;
  material.k = index.k;
  material.reflectance = read_texture(reading, bsdf, "specular_reflectance", grey(1));
}

void read_rough_conductor(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  read_conductor(reading, bsdf, material);
  material.kind = BsdfKind::rough_conductor;
  read_roughness(reading, bsdf, material);
}

void read_plastic(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  material.kind = BsdfKind::plastic;
  material.ior = ratio(read_indices(bsdf, "polypropylene"));
  material.reflectance = read_texture(reading, bsdf, "diffuse_reflectance", grey(0.5f));
  read_factors(bsdf, material, false);
  material.nonlinear = bsdf.flag("nonlinear").value_or(false);
}

void read_principled(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  material.kind = BsdfKind::principled;
  material.reflectance = read_texture(reading, bsdf, "base_color", grey(0.5f));
  material.roughness = read_texture(reading, bsdf, "roughness", grey(0.5f));
  PrincipledDescription& p = material.principled;
  const auto share = [&](const char* name, double& value) { value = bsdf.number(name, value); };
  share("metallic", p.metallic);
  share("anisotropic", p.anisotropic);
  share("spec_trans", p.spec_trans);
  share("spec_tint", p.spec_tint);
  share("sheen", p.sheen);
  share("sheen_tint", p.sheen_tint);
  share("flatness", p.flatness);
  share("clearcoat", p.clearcoat);
  share("clearcoat_gloss", p.clearcoat_gloss);
  if (bsdf.has("eta") && bsdf.has("specular")) bsdf.fail("give either 'eta' or 'specular'");
  // Burley's specular: the index whose reflectance at normal incidence is 0.08 of it.
  const double specular = bsdf.number("specular", 0.5);
  if (!(specular >= 0 && specular <= 1)) bsdf.fail(fmt::format("'specular' is {}: it has to be in [0, 1]", specular));
  material.ior = bsdf.number("eta", 2 / (1 - std::sqrt(0.08 * specular)) - 1);
  material.priority = bsdf.integer("priority", 1, 1000).value_or(1);
  for (const char* rate :
       {"diffuse_reflectance_sampling_rate", "main_specular_sampling_rate", "clearcoat_sampling_rate"})
    bsdf.ignore(rate, "how lobes are sampled is chosen");
}

void read_null(SceneReading&, SceneObject& bsdf, MaterialDescription& material) {
  material.kind = BsdfKind::null;
  material.ior = 1;
  material.priority = bsdf.integer("priority", 1, 1000).value_or(1);
}

void read_two_sided(SceneReading& reading, SceneObject& bsdf, MaterialDescription& material) {
  const XmlElement* front = reading.take(bsdf, "bsdf");
  if (front == nullptr) bsdf.fail("there is no <bsdf> in it");
  const auto one_side = [&](const XmlElement& element) {
    MaterialDescription side = read_material(reading, element);
    if (!is_opaque(side) || side.one_sided) bsdf.fail("only what lets no light through has two sides");
    side.back.clear();
    return side;
  };
  material = one_side(*front);
  if (const XmlElement* back = reading.take(bsdf, "bsdf")) material.back = {one_side(*back)};
}

using Reader = void (*)(SceneReading&, SceneObject&, MaterialDescription&);
struct Kind {
  std::string_view type;
  Reader read;
};
constexpr Kind kinds[] = {{"diffuse", read_diffuse},
                          {"dielectric", read_dielectric},
                          {"roughdielectric", read_rough_dielectric},
                          {"thindielectric", read_thin_dielectric},
                          {"conductor", read_conductor},
                          {"roughconductor", read_rough_conductor},
                          {"plastic", read_plastic},
                          {"principled", read_principled},
                          {"null", read_null},
                          {"twosided", read_two_sided}};

/// What lets no light through is black from behind, unless it is twosided or not there at all.
MaterialDescription black_behind(MaterialDescription material) {
  if (is_opaque(material) && !material.one_sided) material.back = {diffuse_material({0, 0, 0})};
  return material;
}

MaterialDescription read_bsdf(SceneReading& reading, const XmlElement& element) {
  SceneObject bsdf = reading.object(element);
  std::string known;
  for (const Kind& kind : kinds) {
    known += (known.empty() ? "" : ", ") + std::string(kind.type);
    if (bsdf.type() != kind.type) continue;
    MaterialDescription material;
    kind.read(reading, bsdf, material);
    material.one_sided = bsdf.flag("one_sided").value_or(material.one_sided);
    bsdf.finish();
    return kind.read == read_two_sided ? material : black_behind(material);
  }
  bsdf.fail("this bsdf is not supported: there are " + known);
}

}  // namespace

MaterialDescription read_material(SceneReading& reading, const XmlElement& element) {
  const XmlElement& target = reading.resolve(element);
  if (target.tag != "bsdf")
    reading.tree.fail(element, element.tag, fmt::format("it refers to a <{}>, not to a <bsdf>", target.tag));
  if (const auto known = reading.materials.find(&target); known != reading.materials.end()) return known->second;
  // A twosided bsdf may refer to itself.
  if (++reading.material_depth > 32) reading.tree.fail(target, target.tag, "it refers to itself");
  MaterialDescription material = read_bsdf(reading, target);
  --reading.material_depth;
  return reading.materials.emplace(&target, std::move(material)).first->second;
}

MaterialDescription take_material(SceneReading& reading, SceneObject& shape) {
  return take_material(reading, shape, black_behind({}));
}

MaterialDescription take_material(SceneReading& reading, SceneObject& shape, const MaterialDescription& fallback) {
  shape.ignore("exterior", "what is outside follows from the bodies round it");
  const XmlElement* interior = shape.property("interior");
  const XmlElement* bsdf = reading.take(shape, "bsdf");
  MaterialDescription material = bsdf != nullptr ? read_material(reading, *bsdf) : fallback;
  fill_inside(reading, shape, interior, material);
  return material;
}

}  // namespace embrun

#include <fmt/format.h>

#include <cmath>

#include "io/scene/reading.h"

namespace embrun {
namespace {

struct HomogeneousMedium {
  Rgb absorption, scattering;
  PhaseFunction phase;
};

HomogeneousMedium read_homogeneous(SceneReading& reading, const XmlElement& element) {
  SceneObject medium = reading.object(element);
  if (medium.type() == "heterogeneous")
    medium.fail(
        "media from grids are not supported: <shape type=\"particles\"> takes a medium from the particles themselves");
  if (medium.type() != "homogeneous") medium.fail("this medium is not supported: there is homogeneous");
  HomogeneousMedium result;
  const std::optional<Rgb> sigma_a = medium.color("sigma_a"), sigma_s = medium.color("sigma_s");
  if (sigma_a || sigma_s) {
    if (medium.has("sigma_t") || medium.has("albedo"))
      medium.fail("give either sigma_a and sigma_s, or sigma_t and albedo");
    result.absorption = sigma_a.value_or(Rgb{});
    result.scattering = sigma_s.value_or(Rgb{});
  } else {
    const Rgb extinction = medium.color("sigma_t").value_or(grey(1));
    const Rgb albedo = medium.color("albedo").value_or(grey(0.75f));
    result.scattering = extinction * albedo;
    result.absorption = extinction * (grey(1) - albedo);
  }
  const auto scale = static_cast<float>(medium.number("scale", 1));
  result.absorption *= scale;
  result.scattering *= scale;
  for (int c = 0; c < 3; ++c)
    if (!(result.absorption[c] >= 0 && result.scattering[c] >= 0))
      medium.fail("it absorbs or scatters less than nothing");
  result.phase = take_phase(reading, medium);
  medium.ignore("sample_emitters", "lights are always sampled");
  medium.ignore("has_spectral_extinction", "it is found out");
  medium.finish();
  return result;
}

}  // namespace

PhaseFunction take_phase(SceneReading& reading, SceneObject& medium) {
  const XmlElement* element = medium.take({"phase"});
  if (element == nullptr) return {};
  SceneObject phase = reading.object(reading.resolve(*element));
  PhaseFunction result;
  if (phase.type() == "hg") {
    result.kind = PhaseKind::henyey_greenstein;
    const double g = phase.number("g", 0.8);
    if (!(std::abs(g) <= largest_phase_g))
      phase.fail(fmt::format("'g' is {}: it has to lie in [-{}, {}]", g, largest_phase_g, largest_phase_g));
    result.g = static_cast<float>(g);
  } else if (phase.type() == "rayleigh") {
    result.kind = PhaseKind::rayleigh;
  } else if (phase.type() != "isotropic") {
    phase.fail("this phase function is not supported: there are isotropic, hg, rayleigh");
  }
  phase.finish();
  return result;
}

void fill_inside(SceneReading& reading, SceneObject& shape, const XmlElement* property, MaterialDescription& material) {
  if (property == nullptr) return;
  const XmlElement& element = reading.resolve(*property);
  if (element.tag != "medium")
    reading.tree.fail(*property, shape.title(), fmt::format("'interior' is a <{}>, not a <medium>", element.tag));
  const HomogeneousMedium medium = read_homogeneous(reading, element);
  if (material.kind != BsdfKind::null && !has_inside(material)) {
    reading.result.warnings.push_back(
        reading.tree.located(*property, shape.title(), "the medium has no effect: no light gets in"));
    return;
  }
  material.absorption = medium.absorption;
  material.scattering = medium.scattering;
  material.phase = medium.phase;
}

}  // namespace embrun

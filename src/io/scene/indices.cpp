#include "io/scene/indices.h"

#include <fmt/format.h>

#include "io/text.h"

namespace embrun {
namespace {

struct NamedIndex {
  std::string_view name;
  double index;
};

/// At 589 nm and room temperature [Hecht2002], under Mitsuba's names.
constexpr NamedIndex named_indices[] = {
    {"vacuum", 1.0},
    {"air", 1.000277},
    {"helium", 1.000036},
    {"hydrogen", 1.000132},
    {"carbon dioxide", 1.00045},
    {"water", 1.333},
    {"water ice", 1.31},
    {"acetone", 1.36},
    {"ethanol", 1.361},
    {"glycerol", 1.4729},
    {"carbon tetrachloride", 1.461},
    {"benzene", 1.501},
    {"silicone oil", 1.52045},
    {"bromine", 1.661},
    {"fused quartz", 1.458},
    {"pyrex", 1.47},
    {"acrylic glass", 1.49},
    {"polypropylene", 1.49},
    {"bk7", 1.5046},
    {"sodium chloride", 1.544},
    {"amber", 1.55},
    {"pet", 1.575},
    {"diamond", 2.419},
};

struct NamedMetal {
  std::string_view name;
  ComplexIndex index;
};

/// Measured spectra [Palik1985] as seen in daylight, as rgb_in_daylight() has it: silver, aluminium, gold, copper, brass.
constexpr NamedMetal named_metals[] = {
    {"Ag", {{0.1285f, 0.1236f, 0.1509f}, {4.0647f, 3.2858f, 2.3918f}}},
    {"Al", {{1.4073f, 0.9266f, 0.5842f}, {7.7399f, 6.6019f, 5.3606f}}},
    {"Au", {{0.0795f, 0.4066f, 1.5595f}, {3.3895f, 2.5028f, 1.7713f}}},
    {"Cu", {{0.1071f, 0.9772f, 1.2047f}, {3.2741f, 2.5930f, 2.3690f}}},
    {"CuZn", {{0.4182f, 0.5207f, 1.1228f}, {3.6672f, 2.6802f, 1.7723f}}},
};

double read_index(SceneObject& bsdf, std::string_view property, std::string_view fallback) {
  std::string name(fallback);
  if (bsdf.has(property)) {
    const XmlElement& element = *bsdf.property(property);
    if (element.tag != "string") {
      const double index = *bsdf.number(property);
      if (!(index >= 1 && index <= 10))
        bsdf.tree().fail(element, bsdf.title(), fmt::format("'{}' is {}: it has to be in [1, 10]", property, index));
      return index;
    }
    name = to_lower(*bsdf.text(property));
  }
  std::string known;
  for (const NamedIndex& entry : named_indices) {
    if (entry.name == name) return entry.index;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  bsdf.fail(fmt::format("'{}' is {}, which is no known material: there are {}", property, quoted(name), known));
}

}  // namespace

IndexPair read_indices(SceneObject& bsdf, std::string_view interior) {
  return {read_index(bsdf, "int_ior", interior), read_index(bsdf, "ext_ior", "air")};
}

bool bounds_inside(std::string_view type) { return type == "dielectric" || type == "roughdielectric"; }

ComplexIndex read_complex_index(SceneObject& bsdf) {
  const std::string name = bsdf.text("material").value_or("none");
  const std::optional<Rgb> eta = bsdf.color("eta"), k = bsdf.color("k");
  if (eta || k) {
    if (name != "none") bsdf.fail("give either 'material', or 'eta' and 'k'");
    return {eta.value_or(Rgb{0, 0, 0}), k.value_or(Rgb{1, 1, 1})};
  }
  if (name == "none") return {};
  std::string known = "none";
  for (const NamedMetal& metal : named_metals) {
    if (metal.name == name) return metal.index;
    known += ", " + std::string(metal.name);
  }
  bsdf.fail(fmt::format("'material' is {}, which is no known metal: there are {}", quoted(name), known));
}

}  // namespace embrun

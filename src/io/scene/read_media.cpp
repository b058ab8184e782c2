#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "io/read_volume.h"
#include "io/scene/reading.h"
#include "io/text.h"

namespace embrun {
namespace {

/// A property that is a colour, a number or a <volume>.
struct VolumeValue {
  Rgb constant;
  std::optional<ValueGridDescription> grid;
};

/// Makes what is no value of a medium 0, or the highest there can be. Returns how many numbers were not right.
std::size_t clean_values(std::vector<float>& values, float highest) {
  std::size_t wrong = 0;
  for (float& v : values) {
    if (v >= 0 && v <= highest) continue;
    ++wrong;
    v = v > highest && std::isfinite(v) ? highest : 0;
  }
  return wrong;
}

/// The box that a grid's file says its cells fill, as what becomes of [0,1]^3.
Placement box_of(SceneObject& volume, const VolumeFile& file) {
  for (int axis = 0; axis < 3; ++axis)
    if (!std::isfinite(file.low[axis]) || !std::isfinite(file.high[axis]) || !(file.low[axis] < file.high[axis]))
      volume.fail(fmt::format("its file's own box has no extent along axis {}: {} to {}", axis, file.low[axis],
                              file.high[axis]));
  const Vec3d low{file.low[0], file.low[1], file.low[2]}, high{file.high[0], file.high[1], file.high[2]};
  return {{high.x - low.x, 0, 0}, {0, high.y - low.y, 0}, {0, 0, high.z - low.z}, low};
}

ValueGridDescription read_grid(SceneReading& reading, SceneObject& volume, float highest) {
  const std::optional<std::string> name = volume.text("filename");
  if (!name) volume.fail("'filename' is missing");
  ValueGridDescription grid;
  grid.file = reading.path_of(volume, *name);
  const std::vector<std::byte> bytes = reading.read_bytes(grid.file);
  VolumeFile file = read_volume_from_memory(bytes, grid.file);
  grid.nx = file.nx;
  grid.ny = file.ny;
  grid.nz = file.nz;
  grid.channels = file.channels;
  grid.values = std::move(file.values);
  if (const std::size_t wrong = clean_values(grid.values, highest); wrong > 0)
    volume.warn(highest == 1
                    ? fmt::format("{} numbers of its file are not in [0, 1]; they are moved there", wrong)
                    : fmt::format("{} numbers of its file are negative or not finite; they count as 0", wrong));
  const std::string filter = volume.text("filter_type").value_or("trilinear");
  if (filter != "trilinear" && filter != "nearest")
    volume.fail(fmt::format("'filter_type' is {}: there are trilinear, nearest", quoted(filter)));
  grid.nearest = filter == "nearest";
  if (volume.text("wrap_mode").value_or("clamp") != "clamp") volume.fail("'wrap_mode' has to be clamp");
  // Numbers are always taken as they are.
  volume.flag("raw");
  volume.ignore("accel", "there is one way to look grids up");
  volume.ignore("max_value", "it is found out");
  grid.placement = volume.placement("to_world");
  if (volume.flag("use_grid_bbox").value_or(false)) grid.placement = compose(grid.placement, box_of(volume, file));
  return grid;
}

/// `highest` is what the values can be at most.
VolumeValue read_volume(SceneReading& reading, SceneObject& medium, std::string_view name, Rgb fallback,
                        float highest) {
  if (!medium.has(name)) return {fallback, std::nullopt};
  const XmlElement& property = reading.resolve(*medium.property(name));
  if (property.tag != "volume") return {medium.color(name).value_or(fallback), std::nullopt};
  SceneObject volume = reading.object(property);
  VolumeValue result{fallback, std::nullopt};
  if (volume.type() == "constvolume")
    result.constant = volume.color("value").value_or(grey(1));
  else if (volume.type() == "gridvolume")
    result.grid = read_grid(reading, volume, highest);
  else
    volume.fail("this volume is not supported: there are constvolume, gridvolume");
  volume.finish();
  return result;
}

/// As read_volume, for a medium that is the same everywhere.
Rgb read_constant(SceneReading& reading, SceneObject& medium, std::string_view name, Rgb fallback) {
  const VolumeValue value = read_volume(reading, medium, name, fallback, 1e30f);
  if (value.grid) medium.fail(fmt::format("'{}' is a grid, which a homogeneous medium cannot have", name));
  return value.constant;
}

void set_coefficients(Interior& interior, Rgb extinction, Rgb albedo, float scale) {
  interior.scattering = extinction * albedo * scale;
  interior.absorption = extinction * (grey(1) - albedo) * scale;
}

void check_coefficients(SceneObject& medium, const Interior& interior) {
  for (int c = 0; c < 3; ++c)
    if (!(interior.absorption[c] >= 0 && interior.scattering[c] >= 0))
      medium.fail("it absorbs or scatters less than nothing");
}

/// Those that say how Mitsuba works, not what it shows.
void ignore_hints(SceneObject& medium) {
  medium.ignore("sample_emitters", "lights are always sampled");
  medium.ignore("has_spectral_extinction", "it is found out");
}

Interior read_homogeneous(SceneReading& reading, SceneObject& medium) {
  Interior interior;
  const auto scale = static_cast<float>(medium.number("scale", 1));
  const std::optional<Rgb> sigma_a = medium.color("sigma_a"), sigma_s = medium.color("sigma_s");
  if (sigma_a || sigma_s) {
    if (medium.has("sigma_t") || medium.has("albedo"))
      medium.fail("give either sigma_a and sigma_s, or sigma_t and albedo");
    interior.absorption = sigma_a.value_or(Rgb{}) * scale;
    interior.scattering = sigma_s.value_or(Rgb{}) * scale;
  } else {
    const Rgb extinction = read_constant(reading, medium, "sigma_t", grey(1));
    set_coefficients(interior, extinction, read_constant(reading, medium, "albedo", grey(0.75f)), scale);
  }
  interior.phase = take_phase(reading, medium);
  return interior;
}

/// Without any grid it is homogeneous. `sigma_a` is Embrun's: what absorbs everywhere besides, as clear water does.
Interior read_heterogeneous(SceneReading& reading, SceneObject& medium) {
  GridMediumDescription description;
  VolumeValue extinction = read_volume(reading, medium, "sigma_t", grey(1), 1e30f);
  VolumeValue albedo = read_volume(reading, medium, "albedo", grey(0.75f), 1);
  description.scale = medium.number("scale", 1);
  description.phase = take_phase(reading, medium);
  if (!(description.scale >= 0)) medium.fail(fmt::format("'scale' is {}: it must not be negative", description.scale));
  Interior interior;
  interior.absorption = medium.color("sigma_a").value_or(Rgb{});
  if (!extinction.grid && !albedo.grid) {
    const Rgb besides = interior.absorption;
    set_coefficients(interior, extinction.constant, albedo.constant, static_cast<float>(description.scale));
    interior.absorption += besides;
    interior.phase = description.phase;
    return interior;
  }
  description.extinction = extinction.constant;
  description.extinction_grid = std::move(extinction.grid);
  description.albedo = albedo.constant;
  description.albedo_grid = std::move(albedo.grid);
  std::vector<GridMediumDescription>& media = reading.result.scene.grid_media;
  interior.grid_medium = static_cast<int>(media.size());
  media.push_back(std::move(description));
  return interior;
}

Interior read_medium(SceneReading& reading, const XmlElement& element) {
  SceneObject medium = reading.object(element);
  Interior interior;
  if (medium.type() == "homogeneous")
    interior = read_homogeneous(reading, medium);
  else if (medium.type() == "heterogeneous")
    interior = read_heterogeneous(reading, medium);
  else
    medium.fail("this medium is not supported: there are homogeneous, heterogeneous");
  check_coefficients(medium, interior);
  ignore_hints(medium);
  medium.finish();
  return interior;
}

}  // namespace

const Interior& read_interior(SceneReading& reading, const XmlElement& element) {
  const auto known = reading.interiors.find(&element);
  if (known != reading.interiors.end()) return known->second;
  return reading.interiors.emplace(&element, read_medium(reading, element)).first->second;
}

PhaseFunction take_phase(SceneReading& reading, SceneObject& medium) {
  const XmlElement* element = reading.take(medium, "phase");
  if (element == nullptr) return {};
  SceneObject phase = reading.object(*element);
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
  const Interior& medium = read_interior(reading, element);
  if (material.kind != BsdfKind::null && !has_inside(material)) {
    reading.result.warnings.push_back(
        reading.tree.located(*property, shape.title(), "the medium has no effect: no light gets in"));
    return;
  }
  material.absorption = medium.absorption;
  material.scattering = medium.scattering;
  material.phase = medium.phase;
  material.grid_medium = medium.grid_medium;
}

}  // namespace embrun

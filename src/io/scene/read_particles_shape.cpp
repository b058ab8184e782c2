#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "io/read_particles.h"
#include "io/scene/reading.h"
#include "io/text.h"
#include "particles/append_particles.h"
#include "particles/particle_kinds.h"
#include "particles/radius.h"
#include "particles/spacing.h"
#include "scene/kind_scene.h"

namespace embrun {
namespace {

/// Those that say that the particles are a medium.
constexpr std::string_view medium_properties[] = {"extinction", "albedo", "density", "emission", "temperature"};

template <class Value>
Value choice(SceneObject& shape, std::string_view name, Value fallback,
             std::initializer_list<std::pair<std::string_view, Value>> choices) {
  const std::optional<std::string> text = shape.text(name);
  if (!text) return fallback;
  std::string known;
  for (const auto& [label, value] : choices) {
    if (*text == label) return value;
    known += (known.empty() ? "" : ", ") + std::string(label);
  }
  shape.fail(fmt::format("'{}' is {}: there are {}", name, quoted(*text), known));
}

void read_surface(SceneObject& shape, SurfaceSettings& surface) {
  surface.kernel =
      choice<Kernel>(shape, "kernel", surface.kernel,
                     {{"metaball", Kernel::metaball}, {"zhu-bridson", Kernel::zhu_bridson}, {"blinn", Kernel::blinn}});
  surface.order = shape.integer("order", 1, 16).value_or(surface.order);
  surface.recover = choice<RecoverMode>(
      shape, "recover", surface.recover,
      {{"smooth", RecoverMode::smooth}, {"thesis", RecoverMode::thesis}, {"off", RecoverMode::off}});
  surface.normal = choice<NormalMode>(shape, "normal", surface.normal,
                                      {{"weighted", NormalMode::weighted}, {"gradient", NormalMode::gradient}});
  if (!shape.has("threshold")) return;
  if (shape.property("threshold")->tag == "string") {
    surface.threshold_mode =
        choice<ThresholdMode>(shape, "threshold", surface.threshold_mode,
                              {{"auto", ThresholdMode::automatic}, {"thesis", ThresholdMode::thesis}});
    return;
  }
  surface.threshold_mode = ThresholdMode::number;
  surface.threshold = static_cast<float>(*shape.number("threshold"));
}

// ---- the medium --------------------------------------------------------------------------------------------------

/// The attribute that a string property names, with so many components.
const Attribute* attribute(SceneObject& shape, const ParticleSet& particles, std::string_view property, int components,
                           std::string& source) {
  const std::optional<std::string> name = shape.text(property);
  if (!name) return nullptr;
  source = *name;
  if (particles.size() == 0) return nullptr;
  const Attribute* found = particles.find(*name);
  if (found == nullptr) {
    std::string known;
    for (const Attribute& a : particles.attributes) known += (known.empty() ? "" : ", ") + a.name;
    shape.fail(fmt::format("'{}': the particles have no attribute {}; there are: {}", property, quoted(*name), known));
  }
  if (found->components != 1 && found->components != components)
    shape.fail(fmt::format("'{}': the attribute {} has {} components, where 1 or {} are wanted", property,
                           quoted(*name), found->components, components));
  return found;
}

std::vector<float> numbers_of(const Attribute* source) {
  std::vector<float> values;
  if (source == nullptr) return values;
  for (std::size_t i = 0; i < source->value_count(); ++i) values.push_back(static_cast<float>(source->value(i)));
  return values;
}

/// One component is grey.
std::vector<Rgb> colors_of(const Attribute* source) {
  std::vector<Rgb> values;
  if (source == nullptr) return values;
  if (source->components == 1) {
    for (const float v : numbers_of(source)) values.push_back(grey(v));
    return values;
  }
  for (std::size_t i = 0; i + 2 < source->value_count(); i += 3)
    values.push_back({static_cast<float>(source->value(i)), static_cast<float>(source->value(i + 1)),
                      static_cast<float>(source->value(i + 2))});
  return values;
}

/// A property that is a colour for all, or (a <string>) the attribute that has one for each.
void read_color_or_attribute(SceneObject& shape, const ParticleSet& particles, std::string_view name, Rgb& color,
                             std::vector<Rgb>& each, std::string& source) {
  if (!shape.has(name)) return;
  if (shape.property(name)->tag == "string")
    each = colors_of(attribute(shape, particles, name, 3, source));
  else
    color = *shape.color(name);
}

/// True when a colour is given as inf.
bool is_infinite(SceneObject& shape, std::string_view name) {
  const XmlElement* property = shape.has(name) ? shape.property(name) : nullptr;
  return property != nullptr && property->tag != "string" && trimmed(property->get("value")) == "inf";
}

/// What the particles do to light, if anything is said of it; the rest as `medium` has it.
std::optional<ParticleMediumDescription> read_medium(SceneReading& reading, SceneObject& shape,
                                                     const ParticleSet& particles,
                                                     ParticleMediumDescription medium = {}) {
  const bool said = std::any_of(std::begin(medium_properties), std::end(medium_properties),
                                [&](std::string_view name) { return shape.has(name); });
  if (!said) return std::nullopt;
  ParticleMediumSources& sources = medium.sources;
  if (is_infinite(shape, "extinction"))
    medium.extinction = grey(infinity);
  else
    read_color_or_attribute(shape, particles, "extinction", medium.extinction, medium.extinctions, sources.extinction);
  read_color_or_attribute(shape, particles, "albedo", medium.albedo, medium.albedos, sources.albedo);
  medium.densities = numbers_of(attribute(shape, particles, "density", 1, sources.density));
  medium.emission = colors_of(attribute(shape, particles, "emission", 3, sources.emission));
  medium.temperatures = numbers_of(attribute(shape, particles, "temperature", 1, sources.temperature));
  medium.extinction_scale = shape.number("extinction_scale", medium.extinction_scale);
  medium.emission_scale = shape.number("emission_scale", medium.emission_scale);
  medium.density_radius = shape.number("density_radius", medium.density_radius);
  medium.model = choice<DensityModel>(shape, "density_model", medium.model,
                                      {{"balls", DensityModel::balls}, {"smooth", DensityModel::smooth}});
  medium.phase = take_phase(reading, shape);
  if (is_opaque(medium.extinction) &&
      !(medium.albedos.empty() && medium.emission.empty() && medium.temperatures.empty()))
    shape.fail("'extinction' is inf: what is opaque has one albedo, and does not glow");
  return medium;
}

/// The particles of the file that the shape names.
struct ShapeParticles : SizedParticles {
  std::string file, kinds;
  std::vector<std::string> more_files;
};

/// The files that the shape names, at least one.
std::vector<std::string> paths_of(const SceneReading& reading, SceneObject& shape) {
  const std::optional<std::string> one = shape.text("filename"), several = shape.text("filenames");
  if (one && several) shape.fail("give either 'filename' or 'filenames'");
  if (one) return {reading.path_of(shape, *one)};
  if (!several) shape.fail("'filename' is missing");
  std::vector<std::string> paths;
  for (std::size_t begin = 0; begin <= several->size();) {
    const std::size_t end = std::min(several->find(';', begin), several->size());
    const std::string_view name = trimmed(std::string_view(*several).substr(begin, end - begin));
    if (!name.empty()) paths.push_back(reading.path_of(shape, std::string(name)));
    begin = end + 1;
  }
  if (paths.empty()) shape.fail("'filenames' names no file: they are separated by ;");
  return paths;
}

/// A file's particles, which may be none.
ParticleSet read_if_any(SceneReading& reading, const std::string& path) {
  try {
    return read_particles_from_memory(reading.read_bytes(path), path);
  } catch (const NoParticles&) {
    return {};
  }
}

/// Only those of the kind, if the shape says how to tell it. There may be none, but of water.
ShapeParticles read_shape_particles(SceneReading& reading, SceneObject& shape, ParticleKind kind) {
  ShapeParticles read;
  const std::vector<std::string> paths = paths_of(reading, shape);
  read.file = paths.front();
  read.particles = read_if_any(reading, read.file);
  for (std::size_t i = 1; i < paths.size(); ++i) {
    const ParticleSet more = read_if_any(reading, paths[i]);
    if (read.particles.size() == 0)
      read.particles = more;
    else if (more.size() > 0)
      append_particles(read.particles, more);
    read.more_files.push_back(paths[i]);
  }
  read.kinds = shape.text("kinds").value_or("");
  if (!read.kinds.empty() && read.particles.size() > 0) {
    try {
      auto sets = split_by_kind(read.particles, kind_mapping_from_text(read.kinds), read.file);
      read.particles = std::move(sets[static_cast<std::size_t>(kind)]);
    } catch (const Error& error) {
      shape.fail(error.what());
    }
  }
  const std::optional<double> radius = shape.number("radius");
  if (radius && !(*radius > 0)) shape.fail(fmt::format("'radius' is {}: it has to be positive", *radius));
  if (read.particles.size() == 0) {
    const std::string none = read.kinds.empty() ? fmt::format("{}: there are no particles", read.file)
                                                : fmt::format("no particle is {} by 'kinds'", to_string(kind));
    if (kind == ParticleKind::water) shape.fail(none);
    shape.warn(none);
    return read;
  }
  static_cast<SizedParticles&>(read) = size_particles(std::move(read.particles), radius, read.file);
  for (const std::string& note : read.particles.notes) shape.warn(note);
  return read;
}

void add_fluid(SceneReading& reading, SceneObject& shape, ShapeParticles& read, const Placement& outer) {
  FluidDescription fluid;
  fluid.file = read.file;
  fluid.more_files = read.more_files;
  fluid.kinds = read.kinds;
  read_surface(shape, fluid.surface);
  fluid.surface.spacing = read.spacing.spacing;
  fluid.surface.radius = static_cast<float>(read.radius.radius);
  fluid.method = choice<SurfaceMethod>(
      shape, "method", fluid.method,
      {{"fast", SurfaceMethod::fast}, {"thesis", SurfaceMethod::thesis}, {"mesh", SurfaceMethod::mesh}});
  fluid.mesh_cell = shape.number("mesh_cell", fluid.mesh_cell);
  fluid.density_cell = shape.number("density_cell", fluid.density_cell);
  fluid.detail = shape.number("detail", fluid.detail);
  if (!(fluid.detail >= 0) || std::isinf(fluid.detail))
    shape.fail("'detail' is a number of footprints, 0 (the particles' own surface) or greater");
  if (fluid.detail > 0 && fluid.method != SurfaceMethod::fast) shape.fail("'detail' is for the method fast");
  if (fluid.detail > 0 && !read.radius.radii.empty())
    shape.fail("'detail' is for particles of one radius: give a 'radius'");
  const std::optional<Vec3d> low = shape.vector("container_low"), high = shape.vector("container_high");
  if (low.has_value() != high.has_value()) shape.fail("a container has both a 'container_low' and a 'container_high'");
  if (low) fluid.container = Box3d{*low, *high};
  fluid.wets_container = shape.flag("wets_container").value_or(fluid.wets_container);
  fluid.wall_overlap = shape.number("wall_overlap", fluid.wall_overlap);
  fluid.placement = compose(outer, shape.placement("to_world"));
  fluid.material = take_material(reading, shape, dielectric_material(1.33));
  fluid.medium = read_medium(reading, shape, read.particles);
  shape.finish();
  if (fluid.medium && is_opaque(fluid.medium->extinction)) {
    if (!has_inside(fluid.material)) shape.fail("'extinction': no light gets through its surface");
    fluid.material = opaque_fluid_material(fluid.material, fluid.medium->albedo);
    fluid.medium.reset();
  }
  fluid.positions = std::move(read.particles.positions);
  fluid.radii = std::move(read.radius.radii);
  reading.result.scene.fluids.push_back(std::move(fluid));
}

BallsDescription balls_of(const ShapeParticles& read, const MaterialDescription& material) {
  BallsDescription set;
  set.material = material;
  for (std::size_t i = 0; i < read.particles.size(); ++i)
    set.balls.push_back({read.particles.positions[i],
                         read.radius.radii.empty() ? read.radius.radius : static_cast<double>(read.radius.radii[i])});
  return set;
}

/// Foam: a volume without a surface.
void add_volume(SceneReading& reading, SceneObject& shape, ShapeParticles& read, const Placement& outer) {
  if (!(outer == Placement{})) shape.fail("foam cannot be part of a shapegroup");
  VolumeDescription volume;
  volume.file = read.file;
  volume.more_files = read.more_files;
  volume.kinds = read.kinds;
  volume.radius = static_cast<double>(static_cast<float>(read.radius.radius));
  if (read.particles.size() > 0) volume.medium = foam_medium(volume.radius);
  if (const auto said = read_medium(reading, shape, read.particles, volume.medium)) volume.medium = *said;
  shape.finish();
  if (read.particles.size() == 0) return;
  if (is_opaque(volume.medium.extinction)) {
    reading.result.scene.balls.push_back(balls_of(read, diffuse_material(volume.medium.albedo)));
    return;
  }
  volume.positions = std::move(read.particles.positions);
  volume.radii = std::move(read.radius.radii);
  reading.result.scene.volumes.push_back(std::move(volume));
}

/// Bubbles, sand, spray: balls on their own.
void add_balls(SceneReading& reading, SceneObject& shape, const ShapeParticles& read, const Placement& outer,
               const MaterialDescription& material) {
  if (!(outer == Placement{})) shape.fail("discrete particles cannot be part of a shapegroup");
  BallsDescription set = balls_of(read, take_material(reading, shape, material));
  shape.finish();
  if (!set.balls.empty()) reading.result.scene.balls.push_back(std::move(set));
}

}  // namespace

void read_particles_shape(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  const ParticleKind kind = choice<ParticleKind>(shape, "kind", ParticleKind::water,
                                                 {{"water", ParticleKind::water},
                                                  {"foam", ParticleKind::foam},
                                                  {"bubble", ParticleKind::bubble},
                                                  {"sand", ParticleKind::sand},
                                                  {"spray", ParticleKind::spray}});
  ShapeParticles read = read_shape_particles(reading, shape, kind);
  switch (kind) {
    case ParticleKind::foam: add_volume(reading, shape, read, outer); break;
    case ParticleKind::water: add_fluid(reading, shape, read, outer); break;
    case ParticleKind::bubble:
    case ParticleKind::sand:
    case ParticleKind::spray:
      add_balls(reading, shape, read, outer, default_material(kind, dielectric_material(1.33)));
      break;
    case ParticleKind::none: break;
  }
}

}  // namespace embrun

#include "render/kind_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "io/read_particles.h"
#include "math/median.h"
#include "render/color_by.h"
#include "render/option_names.h"
#include "scene/kind_scene.h"
#include "scene/tank.h"

namespace embrun {
namespace {

Rgb to_rgb(const Color& color) { return {color[0], color[1], color[2]}; }

/// A kind of particle as the options have it.
struct KindOptions {
  ParticleKind kind;
  const char* plural;
  const std::vector<std::string>& files;
  const std::optional<double>& radius;
};

std::vector<KindOptions> kinds_of(const RenderOptions& o) {
  return {{ParticleKind::foam, "foam particles", o.foam, o.foam_radius},
          {ParticleKind::spray, "drops of spray", o.spray, o.spray_radius},
          {ParticleKind::bubble, "bubbles", o.bubbles, o.bubble_radius},
          {ParticleKind::sand, "grains of sand", o.sand, o.sand_radius}};
}

ParticleMediumDescription medium_of(const ParticleSet& particles, const Color& extinction, const Color& albedo,
                                    double phase_g, const RenderOptions& options, std::vector<std::string>& notes,
                                    const std::string& name) {
  ParticleMediumDescription medium;
  medium.extinction = to_rgb(extinction);
  medium.albedo = to_rgb(albedo);
  if (phase_g != 0) medium.phase = {PhaseKind::henyey_greenstein, static_cast<float>(phase_g)};
  medium.density_radius = options.density_radius.value_or(0);
  medium.densities = relative_densities(particles, notes, name);
  return medium;
}

/// Gives a fluid the medium, if there is one, or the body, if it is opaque.
void fill_fluid(FluidDescription& fluid, const ParticleSet& particles, const std::optional<Color>& extinction,
                const Color& albedo, double phase_g, const RenderOptions& options, std::vector<std::string>& notes,
                const std::string& name) {
  if (!extinction) return;
  if (is_opaque(to_rgb(*extinction)))
    fluid.material = opaque_fluid_material(fluid.material, to_rgb(albedo));
  else
    fluid.medium = medium_of(particles, *extinction, albedo, phase_g, options, notes, name);
}

// ---- other kinds -------------------------------------------------------------------------------------------------

/// Adds one set of particles of a kind.
void add_set(SceneDescription& scene, const KindOptions& kind, const ParticleSet& particles,
             const RenderOptions& options, double fluid_radius, const ParticleSource& source,
             std::vector<std::string>& notes) {
  const std::string name = source.file.empty() ? "particles" : source.file;
  if (particles.size() == 0) {
    notes.push_back(fmt::format("{}: no {}", name, kind.plural));
    return;
  }
  KindLook look;
  const Attribute* own = particles.find("radius");
  if (kind.radius || own == nullptr || own->components != 1 || !own->strings.empty()) {
    const double radius = kind.radius.value_or(default_kind_radius(kind.kind, fluid_radius));
    look = default_look(kind.kind, radius);
    notes.push_back(fmt::format("{}: {} {} of radius {:.6g} m{}", name, particles.size(), kind.plural, radius,
                                kind.radius ? "" : fmt::format(", {:g} of the water's", radius / fluid_radius)));
  } else {
    std::vector<float> radii;
    for (std::size_t i = 0; i < particles.size(); ++i)
      radii.push_back(static_cast<float>(std::max(own->value(i), 0.0)));
    std::vector<float> sorted = radii;
    std::sort(sorted.begin(), sorted.end());
    const double median = static_cast<double>(sorted[sorted.size() / 2]);
    if (!(median > 0)) throw Error(fmt::format("{}: radius: half of the {} have none; give one", name, kind.plural));
    look = default_look(kind.kind, median);
    look.radii = std::move(radii);
    notes.push_back(fmt::format("{}: {} {} of radii {:.6g} to {:.6g} m", name, particles.size(), kind.plural,
                                sorted.front(), sorted.back()));
  }
  if (kind.kind == ParticleKind::foam && options.foam_extinction) look.extinction = to_rgb(*options.foam_extinction);
  if (kind.kind == ParticleKind::sand && options.sand_color) look.color = to_rgb(*options.sand_color);
  add_particles(scene, kind.kind, particles.positions, look, scene.fluids.front().material, source);
}

void add_fluid(SceneDescription& scene, const FluidOptions& other, const RenderOptions& options, Box3d& bounds,
               std::vector<std::string>& notes) {
  RenderOptions own = options;
  own.kinds.clear();
  const MeasuredParticles measured = measure(read_particles(other.file), own, other.file);
  FluidDescription fluid = scene.fluids.front();
  fluid.positions = measured.particles.positions;
  fluid.radii = measured.radius.radii;
  fluid.file = other.file;
  fluid.surface.radius = static_cast<float>(measured.radius.radius);
  fluid.surface.spacing = measured.spacing.spacing;
  fluid.material = water_material(options);
  fluid.material.ior = other.ior.value_or(options.ior);
  if (other.absorption) fluid.material.absorption = to_rgb(*other.absorption);
  fluid.material.priority = static_cast<int>(scene.fluids.size()) + 1;
  fluid.medium.reset();
  fill_fluid(fluid, measured.particles, other.extinction, other.albedo.value_or(Color{1, 1, 1}), other.phase_g, options,
             notes, other.file);
  const Box3d more = robust_bounds(measured);
  bounds.include(more.low);
  bounds.include(more.high);
  notes.push_back(fmt::format("{}: another fluid, {} particles", other.file, measured.particles.size()));
  scene.fluids.push_back(std::move(fluid));
}

void add_tank(SceneDescription& scene, const RenderOptions& options) {
  if (!options.tank) return;
  if (!options.container) throw Error("a tank needs a container to be round");
  for (FluidDescription& fluid : scene.fluids) press_into_walls(fluid, *options.tank);
  scene.meshes.push_back(make_tank(*scene.fluids.front().container, *options.tank, scene.up,
                                   dielectric_material(options.tank_ior, {}, glass_priority)));
}

}  // namespace

std::vector<float> relative_densities(const ParticleSet& particles, std::vector<std::string>& notes,
                                      const std::string& name) {
  const Attribute* density = particles.find("density");
  if (density == nullptr || density->components != 1 || !density->strings.empty() || particles.size() == 0) return {};
  std::vector<float> values;
  for (std::size_t i = 0; i < particles.size(); ++i) values.push_back(static_cast<float>(density->value(i)));
  std::vector<float> sorted = values;
  const float rest = median_of(sorted);
  if (!(rest > 0)) return {};
  for (float& value : values) value = std::max(value / rest, 0.0f);
  notes.push_back(fmt::format("{}: extinction goes with density; {:.4g} counts as rest density", name, rest));
  return values;
}

void check_kind_options(const RenderOptions& o) {
  if (!o.kinds.empty()) kind_mapping_from_text(o.kinds);
  overlap_from_name(o.overlap);
  check_color_map(o.color_map);
  for (const KindOptions& kind : kinds_of(o))
    if (kind.radius && !(*kind.radius > 0 && std::isfinite(*kind.radius)))
      throw Error(fmt::format("radius {} of {}: it must be positive", *kind.radius, kind.plural));
  if (o.tank && !(*o.tank > 0 && std::isfinite(*o.tank)))
    throw Error(fmt::format("a tank of thickness {}: it must be positive", *o.tank));
  if (o.tank && !o.container) throw Error("a tank needs a container to be round");
  // A scene of one particle, and one of each kind: values out of range are found as they would be in a scene.
  SceneDescription scene;
  for (const KindOptions& kind : kinds_of(o)) {
    KindLook look = default_look(kind.kind, 1);
    if (o.foam_extinction) look.extinction = to_rgb(*o.foam_extinction);
    if (o.sand_color && kind.kind == ParticleKind::sand) look.color = to_rgb(*o.sand_color);
    add_particles(scene, kind.kind, {{0, 0, 0}}, look, dielectric_material(1.33));
  }
  for (const FluidOptions& other : o.fluids) {
    FluidDescription fluid;
    fluid.positions = {{0, 0, 0}};
    fluid.surface.radius = 1;
    fluid.material.ior = other.ior.value_or(o.ior);
    if (other.absorption) fluid.material.absorption = to_rgb(*other.absorption);
    std::vector<std::string> notes;
    fill_fluid(fluid, {}, other.extinction, other.albedo.value_or(Color{1, 1, 1}), other.phase_g, o, notes, "");
    scene.fluids.push_back(fluid);
  }
  validate(scene);
}

RenderOptions without_files(const RenderOptions& options) {
  RenderOptions plain = options;
  plain.environment = "white";
  plain.sun.reset();
  plain.meshes.clear();
  plain.fluids.clear();
  plain.kinds.clear();
  plain.color_by.clear();
  for (auto* files : {&plain.foam, &plain.bubbles, &plain.sand, &plain.spray}) files->clear();
  return plain;
}

void add_inside(FluidDescription& fluid, const MeasuredParticles& measured, const RenderOptions& options,
                std::vector<std::string>& notes) {
  if (!options.extinction && options.color_by.empty()) return;
  const auto dense = static_cast<float>(1 / (4 * measured.radius.radius));
  fill_fluid(fluid, measured.particles, options.extinction.value_or(Color{dense, dense, dense}), options.albedo,
             options.phase_g, options, notes, "the fluid");
  if (options.color_by.empty()) return;
  const ColorsByAttribute by =
      color_by_attribute(measured.particles, options.color_by, options.color_map, "colour by " + options.color_by);
  fluid.medium->albedos = by.colors;
  notes.push_back(fmt::format("coloured by {}: {:.6g} to {:.6g}, the map's ends at {:.6g} and {:.6g}", options.color_by,
                              by.least, by.most, by.low, by.high));
}

void add_other_particles(SceneDescription& scene, const MeasuredParticles& measured, const RenderOptions& options,
                         Box3d& bounds, std::vector<std::string>& notes) {
  scene.overlap = overlap_from_name(options.overlap);
  for (const FluidOptions& other : options.fluids) add_fluid(scene, other, options, bounds, notes);
  for (const KindOptions& kind : kinds_of(options)) {
    const auto of_file = static_cast<std::size_t>(kind.kind);
    if (of_file < measured.others.size() && measured.others[of_file].size() > 0)
      add_set(scene, kind, measured.others[of_file], options, measured.radius.radius, {measured.file, options.kinds},
              notes);
    for (const std::string& file : kind.files) {
      ParticleSet particles;
      try {
        particles = read_particles(file);
      } catch (const NoParticles&) {
        // There is none of that kind in this frame.
      }
      add_set(scene, kind, particles, options, measured.radius.radius, {file, ""}, notes);
    }
  }
  join_fluids(scene.fluids);
  add_tank(scene, options);
}

}  // namespace embrun

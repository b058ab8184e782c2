#include "scene/kind_scene.h"

#include <cmath>

#include "base/error.h"

namespace embrun {
namespace {

constexpr Rgb sand_brown{0.52f, 0.36f, 0.19f};

BallsDescription balls_of(const std::vector<Vec3d>& positions, const KindLook& look,
                          const MaterialDescription& material) {
  BallsDescription set;
  set.material = material;
  set.balls.reserve(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i)
    set.balls.push_back({positions[i], look.radii.empty() ? look.radius : static_cast<double>(look.radii[i])});
  return set;
}

/// The particles' radii one by one.
void spell_out_radii(FluidDescription& fluid) {
  if (fluid.radii.empty()) fluid.radii.assign(fluid.positions.size(), fluid.surface.radius);
}

template <class Value>
void extend(std::vector<Value>& values, std::size_t size, const Value& value) {
  if (!values.empty()) values.resize(size, value);
}

}  // namespace

double default_kind_radius(ParticleKind kind, double fluid_radius) {
  switch (kind) {
    case ParticleKind::foam: return 0.5 * fluid_radius;
    case ParticleKind::bubble:
    case ParticleKind::spray: return 0.25 * fluid_radius;
    case ParticleKind::water:
    case ParticleKind::sand:
    case ParticleKind::none: break;
  }
  return fluid_radius;
}

KindLook default_look(ParticleKind kind, double radius) {
  KindLook look;
  look.radius = static_cast<double>(static_cast<float>(radius));  // as files hold it
  look.color = kind == ParticleKind::sand ? sand_brown : grey(1);
  look.extinction = foam_medium(look.radius).extinction;
  return look;
}

ParticleMediumDescription foam_medium(double radius) {
  ParticleMediumDescription medium;
  medium.model = DensityModel::smooth;
  medium.density_radius = 0.5 * radius;
  medium.extinction = grey(static_cast<float>(0.5 / radius));
  return medium;
}

MaterialDescription default_material(ParticleKind kind, const MaterialDescription& fluid) {
  if (kind == ParticleKind::bubble) return dielectric_material(1, {}, bubble_priority);
  return kind == ParticleKind::sand ? diffuse_material(sand_brown) : fluid;
}

bool is_opaque(Rgb extinction) {
  return std::isinf(extinction.r) && std::isinf(extinction.g) && std::isinf(extinction.b) && extinction.r > 0 &&
         extinction.g > 0 && extinction.b > 0;
}

MaterialDescription opaque_fluid_material(const MaterialDescription& fluid, Rgb albedo) {
  MaterialDescription material = diffuse_material(albedo);
  if (fluid.ior == 1) return material;
  material.kind = BsdfKind::plastic;
  material.ior = fluid.ior;
  material.specular_reflectance = fluid.specular_reflectance;
  return material;
}

void add_particles(SceneDescription& scene, ParticleKind kind, const std::vector<Vec3d>& positions,
                   const KindLook& look, const MaterialDescription& fluid, const ParticleSource& source) {
  EMBRUN_CHECK(kind != ParticleKind::water);
  if (positions.empty()) return;
  switch (kind) {
    case ParticleKind::foam: {
      if (is_opaque(look.extinction)) {
        scene.balls.push_back(balls_of(positions, look, diffuse_material(look.color)));
        break;
      }
      VolumeDescription volume;
      volume.positions = positions;
      volume.radii = look.radii;
      volume.radius = look.radius;
      volume.medium = foam_medium(look.radius);
      volume.medium.extinction = look.extinction;
      volume.medium.albedo = look.color;
      volume.file = source.file;
      volume.kinds = source.kinds;
      scene.volumes.push_back(std::move(volume));
      break;
    }
    case ParticleKind::bubble:
    case ParticleKind::spray: scene.balls.push_back(balls_of(positions, look, default_material(kind, fluid))); break;
    case ParticleKind::sand: scene.balls.push_back(balls_of(positions, look, diffuse_material(look.color))); break;
    case ParticleKind::water:
    case ParticleKind::none: break;
  }
}

void join_fluids(std::vector<FluidDescription>& fluids) {
  for (std::size_t i = 0; i < fluids.size(); ++i) {
    FluidDescription& fluid = fluids[i];
    const std::size_t own = fluid.positions.size();
    for (std::size_t j = i + 1; j < fluids.size(); ++j) {
      FluidDescription& other = fluids[j];
      const bool own_radii =
          !fluid.radii.empty() || !other.radii.empty() || fluid.surface.radius != other.surface.radius;
      if (own_radii) spell_out_radii(fluid);
      fluid.positions.insert(fluid.positions.end(), other.positions.begin(), other.positions.end());
      if (own_radii) {
        fluid.radii.insert(fluid.radii.end(), other.radii.begin(), other.radii.end());
        fluid.radii.resize(fluid.positions.size(), other.surface.radius);
      }
      fluid.file.clear();
    }
    if (!fluid.medium || i + 1 == fluids.size()) continue;
    ParticleMediumDescription& medium = *fluid.medium;
    if (medium.extinctions.empty() && medium.densities.empty()) medium.densities.assign(own, 1.0f);
    extend(medium.densities, fluid.positions.size(), 0.0f);
    extend(medium.extinctions, fluid.positions.size(), Rgb{});
    extend(medium.albedos, fluid.positions.size(), medium.albedo);
    extend(medium.emission, fluid.positions.size(), Rgb{});
    extend(medium.temperatures, fluid.positions.size(), 0.0f);
  }
}

}  // namespace embrun

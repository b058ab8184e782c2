#include "scene/compile_media.h"

#include <fmt/format.h>

#include <utility>

#include "base/error.h"
#include "math/black_body.h"

namespace embrun {
namespace {

/// Radiance of every particle's matter, from colours or temperatures.
std::vector<Rgb> glow_of(const ParticleMediumDescription& medium) {
  const auto scale = static_cast<float>(medium.emission_scale);
  std::vector<Rgb> glow = medium.emission;
  for (const float kelvin : medium.temperatures) glow.push_back(black_body_radiance(static_cast<double>(kelvin)));
  for (Rgb& radiance : glow) radiance *= scale;
  return glow;
}

/// What is common to fluids and volumes. `radius` and `spacing` in metres of the scene.
void describe(const ParticleMediumDescription& medium, double radius, double spacing, PlacedParticles& placed) {
  DensityParticles& particles = placed.particles;
  particles.positions = placed.positions;
  particles.radii = placed.radii;
  particles.radius = static_cast<float>(radius);
  particles.model = medium.model;
  particles.volume = static_cast<float>(spacing * spacing * spacing);
  const auto scale = static_cast<float>(medium.extinction_scale);
  particles.extinction = medium.extinction * scale;
  particles.albedo = medium.albedo;
  particles.phase = medium.phase;
  particles.extinctions = medium.extinctions;
  for (Rgb& k : particles.extinctions) k *= scale;
  // A fluid's smooth sum is the density itself: particles that stand for less room have it from being closer together.
  if (medium.model == DensityModel::balls) particles.factors = medium.densities;
  particles.albedos = medium.albedos;
  particles.emission = glow_of(medium);
}

/// Factor from particles' radii to those of their balls.
double ball_scale(const ParticleMediumDescription& medium, double radius) {
  return medium.density_radius > 0 ? medium.density_radius / radius : 1;
}

PlacedParticles place_volume(const VolumeDescription& volume, Vec3d recentring) {
  PlacedParticles placed;
  for (const Vec3d& p : volume.positions) placed.positions.push_back(to_float(p - recentring));
  const double scale = ball_scale(volume.medium, volume.radius);
  for (const float r : volume.radii) placed.radii.push_back(static_cast<float>(scale * static_cast<double>(r)));
  describe(volume.medium, volume.radius * scale, 2 * volume.radius, placed);
  placed.particles.factors = volume.medium.densities;
  return placed;
}

/// A grid of the description in the scene's coordinates, its numbers times `scale`.
GridValues place_grid(const ValueGridDescription& grid, Vec3d recentring, float scale) {
  GridValues result{grid.values, grid.nx, grid.ny, grid.nz, grid.channels, grid.nearest, {}};
  for (float& v : result.values) v *= scale;
  result.to_world = {to_float(grid.placement.x_axis), to_float(grid.placement.y_axis), to_float(grid.placement.z_axis),
                     to_float(grid.placement.origin - recentring)};
  return result;
}

/// One cell that fills a box.
GridValues fill_box(Rgb value, const Box3& box) {
  const Vec3 size = box.high - box.low;
  // Bodies that reach to the box's faces must not lose their outermost layer to rounding.
  const float margin = 1e-3f * max_of(size.x, max_of(size.y, size.z)) + 1e-6f;
  const Vec3 low = box.low - Vec3{margin, margin, margin}, high = box.high + Vec3{margin, margin, margin};
  return {{value.r, value.g, value.b},
          1,
          1,
          1,
          3,
          true,
          {{high.x - low.x, 0, 0}, {0, high.y - low.y, 0}, {0, 0, high.z - low.z}, low}};
}

}  // namespace

PlacedParticles place_particles(const FluidDescription& fluid, Vec3d recentring) {
  PlacedParticles placed;
  for (const Vec3d& p : fluid.positions) placed.positions.push_back(to_float(place(fluid.placement, p) - recentring));
  const double own = static_cast<double>(fluid.surface.radius), size = largest_scale(fluid.placement);
  const double scale = size * ball_scale(*fluid.medium, own);
  for (const float r : fluid.radii) placed.radii.push_back(static_cast<float>(scale * static_cast<double>(r)));
  const double spacing = fluid.surface.spacing > 0 ? fluid.surface.spacing : 2 * own;
  describe(*fluid.medium, own * scale, size * spacing, placed);
  return placed;
}

GridMediumData compile_grid_medium(const GridMediumDescription& medium, Vec3d recentring, const Box3& bounds) {
  const auto scale = static_cast<float>(medium.scale);
  GridValues albedo;
  if (medium.albedo_grid) albedo = place_grid(*medium.albedo_grid, recentring, 1);
  return {medium.extinction_grid ? place_grid(*medium.extinction_grid, recentring, scale)
                                 : fill_box(medium.extinction * scale, bounds),
          std::move(albedo), medium.albedo, medium.phase};
}

ParticleDensity compile_density(const SceneDescription& scene, Vec3d recentring) {
  const std::size_t count = scene.fluids.size() + scene.volumes.size();
  bool any = !scene.volumes.empty();
  for (const FluidDescription& fluid : scene.fluids) any = any || fluid.medium.has_value();
  if (!any) return {};
  if (count > static_cast<std::size_t>(max_density_fluids))
    throw Error(fmt::format("{} fluids and {} volumes: at most {} together can be told apart", scene.fluids.size(),
                            scene.volumes.size(), max_density_fluids));

  std::vector<PlacedParticles> placed(count);
  for (std::size_t i = 0; i < scene.fluids.size(); ++i)
    if (scene.fluids[i].medium) placed[i] = place_particles(scene.fluids[i], recentring);
  for (std::size_t i = 0; i < scene.volumes.size(); ++i)
    placed[scene.fluids.size() + i] = place_volume(scene.volumes[i], recentring);
  std::vector<DensityParticles> particles;
  for (PlacedParticles& own : placed) particles.push_back(std::move(own.particles));
  return ParticleDensity(particles, scene.overlap);
}

}  // namespace embrun

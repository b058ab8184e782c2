#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>

#include "base/error.h"
#include "geometry/splat_hierarchy.h"
#include "sampling/gauss_rule.h"
#include "scene/each_material.h"
#include "scene/scene_description.h"

namespace embrun {
namespace {

template <class... Args>
void require(bool condition, fmt::format_string<Args...> format, Args&&... args) {
  if (!condition) throw Error(fmt::format(format, std::forward<Args>(args)...));
}

bool finite(double v) { return std::isfinite(v); }
bool finite(Vec3d v) { return finite(v.x) && finite(v.y) && finite(v.z); }
bool finite(Rgb v) { return is_finite(v); }

void check_color(Rgb color, const std::string& what, float highest) {
  for (int c = 0; c < 3; ++c)
    require(color[c] >= 0 && color[c] <= highest, "{}: {},{},{} has a channel that is not in [0, {}]", what, color.r,
            color.g, color.b, highest);
}

/// A coefficient per metre.
void check_coefficient(Rgb value, const std::string& what) {
  for (int c = 0; c < 3; ++c)
    require(value[c] >= 0 && finite(value[c]),
            "{} {},{},{} has a channel that is not a finite number of at least 0 (what is opaque is a surface)", what,
            value.r, value.g, value.b);
}

void check_phase(const PhaseFunction& phase, const std::string& what) {
  require(std::abs(phase.g) <= largest_phase_g, "{}: phase function: g = {} is not in [-{}, {}]", what, phase.g,
          largest_phase_g, largest_phase_g);
}

void check_texture(const TextureDescription& texture, std::size_t pictures, const std::string& what) {
  check_color(texture.first, what, 1);
  if (texture.kind == TextureKind::constant) return;
  check_color(texture.second, what + ": second colour", 1);
  require(texture.cell > 0 && finite(texture.cell), "{}: checker cells of {} m; their side must be positive", what,
          texture.cell);
  require(finite(texture.origin), "{}: the checkerboard's origin is not finite", what);
  for (const int axis : {texture.axis_u, texture.axis_v})
    require(axis >= 0 && axis <= 2, "{}: checkerboard axis {} is not 0, 1 or 2", what, axis);
  require(texture.axis_u != texture.axis_v, "{}: the checkerboard's two axes are the same", what);
  for (const double m : texture.to_uv) require(finite(m), "{}: its transform of (u, v) is not finite", what);
  if (texture.kind == TextureKind::bitmap)
    require(texture.picture >= 0 && static_cast<std::size_t>(texture.picture) < pictures,
            "{}: it shows picture {} of {}", what, texture.picture, pictures);
}

void check_picture(const PictureDescription& picture, const std::string& what) {
  const Image& image = picture.image;
  require(image.width >= 1 && image.height >= 1 && (image.channels == 1 || image.channels == 3),
          "{}: {} x {} pixels of {} channels; there must be pixels, of 1 or 3 channels", what, image.width,
          image.height, image.channels);
  require(image.pixels.size() == image.pixel_count() * static_cast<std::size_t>(image.channels),
          "{}: {} values for {} x {} pixels of {} channels", what, image.pixels.size(), image.width, image.height,
          image.channels);
  for (const float value : image.pixels)
    require(value >= 0 && finite(static_cast<double>(value)), "{}: it has a pixel that is negative or not finite",
            what);
}

/// A parameter that blends.
void check_share(double value, const char* name, const std::string& what) {
  require(value >= 0 && value <= 1, "{}: {} {} is not in [0, 1]", what, name, value);
}

void check_principled(const PrincipledDescription& p, const std::string& what) {
  check_share(p.metallic, "metallic", what);
  check_share(p.anisotropic, "anisotropic", what);
  check_share(p.spec_trans, "spec_trans", what);
  check_share(p.spec_tint, "spec_tint", what);
  check_share(p.sheen, "sheen", what);
  check_share(p.sheen_tint, "sheen_tint", what);
  check_share(p.flatness, "flatness", what);
  check_share(p.clearcoat, "clearcoat", what);
  check_share(p.clearcoat_gloss, "clearcoat_gloss", what);
}

/// What a BSDF needs besides the media on its sides.
void check_bsdf(const MaterialDescription& material, std::size_t pictures, const std::string& what) {
  using enum BsdfKind;
  const BsdfKind kind = material.kind;
  const bool conducts = kind == conductor || kind == rough_conductor;
  const bool rough = kind == rough_conductor || kind == rough_dielectric;
  if (conducts || kind == diffuse || kind == plastic || kind == principled)
    check_texture(material.reflectance, pictures, what + ": reflectance");
  check_color(material.specular_reflectance, what + ": specular reflectance", 1);
  check_color(material.specular_transmittance, what + ": specular transmittance", 1);
  if (rough || kind == principled) check_texture(material.roughness, pictures, what + ": roughness");
  if (material.roughness_v) check_share(*material.roughness_v, "roughness_v", what);
  if (conducts) {
    check_color(material.eta, what + ": eta", 1000);
    check_color(material.k, what + ": k", 1000);
    for (int c = 0; c < 3; ++c)
      require(material.eta[c] > 0 || material.k[c] > 0, "{}: eta and k of a channel are both 0", what);
  }
  if (kind == principled) check_principled(material.principled, what);
  if (kind == thin_dielectric || kind == plastic || (kind == principled && !has_inside(material)))
    require(material.ior >= 0.1 && material.ior <= 10, "{}: refractive index {} is not in [0.1, 10]", what,
            material.ior);
}

void check_material(const MaterialDescription& material, std::size_t pictures, const std::string& what) {
  check_bsdf(material, pictures, what);
  require(material.back.size() <= 1, "{}: {} materials for its back; there is one back", what, material.back.size());
  for (const MaterialDescription& back : material.back) {
    require(is_opaque(material) && is_opaque(back) && !material.one_sided && !back.one_sided && back.back.empty(),
            "{}: only what is opaque, and not one-sided, can have another material on its back", what);
    check_bsdf(back, pictures, what + ": its back");
  }
  if (!has_inside(material)) return;
  require(material.ior >= 1 && material.ior <= 10, "{}: refractive index {} is not in [1, 10]", what, material.ior);
  check_coefficient(material.absorption, what + ": absorption");
  check_coefficient(material.scattering, what + ": scattering");
  check_phase(material.phase, what);
  require(material.priority >= 1, "{}: priority {} is not at least 1 (0 is the air's)", what, material.priority);
}

void check_box(const Box3d& box, const std::string& what) {
  require(finite(box.low) && finite(box.high), "{}: a corner is not finite", what);
  require(box.low.x < box.high.x && box.low.y < box.high.y && box.low.z < box.high.z,
          "{}: the first corner {},{},{} must be below the second {},{},{} on every axis", what, box.low.x, box.low.y,
          box.low.z, box.high.x, box.high.y, box.high.z);
}

void check_placement(const Placement& p, const std::string& what) {
  require(finite(p.x_axis) && finite(p.y_axis) && finite(p.z_axis) && finite(p.origin),
          "{}: the placement is not finite", what);
  require(std::abs(determinant(p)) > 1e-12 * length(p.x_axis) * length(p.y_axis) * length(p.z_axis),
          "{}: the placement flattens it", what);
}

void check_particle_medium(const ParticleMediumDescription& medium, std::size_t particles, const std::string& what) {
  check_coefficient(medium.extinction, what + ": extinction");
  require(medium.extinction_scale >= 0 && finite(medium.extinction_scale),
          "{}: extinction scale {} is negative or not finite", what, medium.extinction_scale);
  check_color(medium.albedo, what + ": albedo", 1);
  check_phase(medium.phase, what);
  require(medium.density_radius >= 0 && finite(medium.density_radius),
          "{}: density radius {} is negative or not finite", what, medium.density_radius);
  require(medium.emission_scale >= 0 && finite(medium.emission_scale),
          "{}: emission scale {} is negative or not finite", what, medium.emission_scale);
  require(medium.emission.empty() || medium.temperatures.empty(),
          "{}: its particles have both emission and temperatures; give one of them", what);
  const auto check_count = [&](std::size_t values, const char* name) {
    require(values == 0 || values == particles, "{}: {} {} for {} particles", what, values, name, particles);
  };
  check_count(medium.densities.size(), "densities");
  check_count(medium.extinctions.size(), "extinctions");
  check_count(medium.albedos.size(), "albedos");
  check_count(medium.emission.size(), "emissions");
  check_count(medium.temperatures.size(), "temperatures");
  const auto of_particle = [&](std::size_t i, const char* name) {
    return fmt::format("{}: particle {}: {}", what, i, name);
  };
  for (std::size_t i = 0; i < medium.densities.size(); ++i)
    require(medium.densities[i] >= 0 && finite(medium.densities[i]),
            "{}: particle {}: density {} is negative or not finite", what, i, medium.densities[i]);
  for (std::size_t i = 0; i < medium.extinctions.size(); ++i)
    check_coefficient(medium.extinctions[i], of_particle(i, "extinction"));
  for (std::size_t i = 0; i < medium.albedos.size(); ++i) check_color(medium.albedos[i], of_particle(i, "albedo"), 1);
  for (std::size_t i = 0; i < medium.emission.size(); ++i)
    check_coefficient(medium.emission[i], of_particle(i, "emission"));
  for (std::size_t i = 0; i < medium.temperatures.size(); ++i)
    require(medium.temperatures[i] >= 0 && medium.temperatures[i] <= 1e6f,
            "{}: particle {}: temperature {} K is not in [0, 1e6]", what, i, medium.temperatures[i]);
}

void check_value_grid(const ValueGridDescription& grid, float highest, const std::string& what) {
  constexpr int most = 1 << 20;
  require(grid.nx >= 1 && grid.ny >= 1 && grid.nz >= 1 && grid.nx <= most && grid.ny <= most && grid.nz <= most &&
              (grid.channels == 1 || grid.channels == 3),
          "{}: {} x {} x {} cells of {} channels; there must be cells, of 1 or 3 channels", what, grid.nx, grid.ny,
          grid.nz, grid.channels);
  const double numbers = static_cast<double>(grid.nx) * grid.ny * grid.nz * grid.channels;
  require(static_cast<double>(grid.values.size()) == numbers, "{}: {} values for {} x {} x {} cells of {} channels",
          what, grid.values.size(), grid.nx, grid.ny, grid.nz, grid.channels);
  for (std::size_t i = 0; i < grid.values.size(); ++i)
    require(grid.values[i] >= 0 && grid.values[i] <= highest, "{}: value {} is {}, which is not in [0, {}]", what, i,
            grid.values[i], highest);
  check_placement(grid.placement, what);
}

void check_grid_medium(const GridMediumDescription& medium, const std::string& what) {
  constexpr float greatest = 1e30f;
  check_color(medium.extinction, what + ": extinction", greatest);
  require(medium.scale >= 0 && medium.scale <= 1e6, "{}: scale {} is not in [0, 1e6]", what, medium.scale);
  check_color(medium.albedo, what + ": albedo", 1);
  check_phase(medium.phase, what);
  if (medium.extinction_grid) check_value_grid(*medium.extinction_grid, greatest, what + ": extinction");
  if (medium.albedo_grid) check_value_grid(*medium.albedo_grid, 1, what + ": albedo");
}

/// True when the placement turns balls into balls.
bool keeps_balls(const Placement& p) {
  const double x = length(p.x_axis), y = length(p.y_axis), z = length(p.z_axis);
  const double tolerance = 1e-6 * x * x;
  return std::abs(y - x) <= 1e-6 * x && std::abs(z - x) <= 1e-6 * x && std::abs(dot(p.x_axis, p.y_axis)) <= tolerance &&
         std::abs(dot(p.y_axis, p.z_axis)) <= tolerance && std::abs(dot(p.z_axis, p.x_axis)) <= tolerance;
}

void check_volume(const VolumeDescription& volume, const std::string& what) {
  require(volume.radius > 0 && finite(volume.radius), "{}: particle radius {} is not positive", what, volume.radius);
  require(volume.radii.empty() || volume.radii.size() == volume.positions.size(), "{}: {} radii for {} particles", what,
          volume.radii.size(), volume.positions.size());
  for (std::size_t i = 0; i < volume.positions.size(); ++i)
    require(finite(volume.positions[i]), "{}: the position of particle {} is not finite", what, i);
  for (std::size_t i = 0; i < volume.radii.size(); ++i)
    require(volume.radii[i] >= 0 && finite(volume.radii[i]),
            "{}: the radius {} of particle {} is negative or not finite", what, volume.radii[i], i);
  check_particle_medium(volume.medium, volume.positions.size(), what);
}

/// For surfaces that are no place for pictures.
void check_no_coordinates(const MaterialDescription& material, const std::string& what) {
  for (const TextureDescription* texture : {&material.reflectance, &material.roughness})
    require(texture->kind != TextureKind::uv_checker && texture->kind != TextureKind::bitmap,
            "{}: its surface has no coordinates (u, v) for its texture", what);
}

void check_fluid(const FluidDescription& fluid, std::size_t pictures, const std::string& what) {
  require(!fluid.positions.empty(), "{}: it has no particles", what);
  const SurfaceSettings& surface = fluid.surface;
  require(surface.radius > 0 && finite(surface.radius), "{}: particle radius {} is not positive", what, surface.radius);
  require(surface.order >= 1 && surface.order <= 16, "{}: neighbourhood order {} is not in [1, 16]", what,
          surface.order);
  require(surface.spacing >= 0 && finite(surface.spacing), "{}: rest spacing {} is negative or not finite", what,
          surface.spacing);
  if (surface.threshold_mode == ThresholdMode::number)
    require(surface.threshold > 0 && finite(surface.threshold), "{}: threshold {} is not positive", what,
            surface.threshold);
  require(fluid.radii.empty() || fluid.radii.size() == fluid.positions.size(), "{}: {} radii for {} particles", what,
          fluid.radii.size(), fluid.positions.size());
  for (std::size_t i = 0; i < fluid.positions.size(); ++i)
    require(finite(fluid.positions[i]), "{}: the position of particle {} is not finite", what, i);
  for (std::size_t i = 0; i < fluid.radii.size(); ++i)
    require(fluid.radii[i] > 0 && finite(fluid.radii[i]), "{}: the radius {} of particle {} is not positive", what,
            fluid.radii[i], i);
  require(fluid.material.kind != BsdfKind::null && fluid.material.kind != BsdfKind::thin_dielectric,
          "{}: its material is none that a surface can have", what);
  check_material(fluid.material, pictures, what);
  check_no_coordinates(fluid.material, what);
  check_placement(fluid.placement, what);
  if (fluid.container) check_box(*fluid.container, what + ": container");
  require(fluid.mesh_cell >= 0 && finite(fluid.mesh_cell), "{}: mesh cell {} is negative or not finite", what,
          fluid.mesh_cell);
  require(fluid.density_cell >= 0 && finite(fluid.density_cell), "{}: density cell {} is negative or not finite", what,
          fluid.density_cell);
  require(fluid.wall_overlap >= 0 && finite(fluid.wall_overlap),
          "{}: overlap with walls of {} m is negative or not finite", what, fluid.wall_overlap);
  require(fluid.detail >= 0 && finite(fluid.detail), "{}: a detail of {} footprints: it must be 0 or greater", what,
          fluid.detail);
  require(fluid.detail == 0 || (fluid.method == SurfaceMethod::fast && fluid.radii.empty()),
          "{}: levels of detail are of surfaces that are found directly, of particles of one radius", what);
  if (!fluid.medium) return;
  require(has_inside(fluid.material), "{}: its particles scatter light, but no light gets through its surface", what);
  require(keeps_balls(fluid.placement), "{}: its particles scatter light as balls, which the placement distorts", what);
  check_particle_medium(*fluid.medium, fluid.positions.size(), what);
}

void check_light(const LightDescription& light, const std::string& what) {
  require(finite(light.radiance), "{}: its radiance is not finite", what);
  require(finite(light.position) && finite(light.edge_u) && finite(light.edge_v) && finite(light.normal),
          "{}: a coordinate is not finite", what);
  using Kind = LightDescription::Kind;
  if (light.kind == Kind::rectangle) {
    const double along = std::abs(dot(light.edge_u, light.edge_v));
    require(along <= 1e-6 * length(light.edge_u) * length(light.edge_v), "{}: its edges are not at right angles", what);
  }
  if (light.kind == Kind::disk || light.kind == Kind::sphere)
    require(light.radius > 0 && finite(light.radius), "{}: its radius {} is not positive", what, light.radius);
  if (light.kind == Kind::disk || light.kind == Kind::distant || light.kind == Kind::directional)
    require(length(light.normal) > 0, "{}: its direction is zero", what);
  if (light.kind == Kind::distant)
    require(light.half_angle > 0 && light.half_angle <= 90, "{}: its half angle {} is not in (0, 90] degrees", what,
            light.half_angle);
}

void check_film(const FilmDescription& film) {
  constexpr int largest = 1 << 16;
  require(film.width >= 1 && film.height >= 1 && film.width <= largest && film.height <= largest,
          "picture of {} x {} pixels: each side must be from 1 to {}", film.width, film.height, largest);
  if (!film.crop) return;
  const PixelWindow& crop = *film.crop;
  require(crop.width >= 1 && crop.height >= 1 && crop.x >= 0 && crop.y >= 0 && crop.x <= film.width - crop.width &&
              crop.y <= film.height - crop.height,
          "crop {},{},{},{} does not lie within the {} x {} pixels of the picture", crop.x, crop.y, crop.width,
          crop.height, film.width, film.height);
}

/// The numbers of nodes next to one that make a rule of the hemisphere, for people.
std::string nearest_rules(int nodes) {
  const auto name = [](int n) {
    const HemisphereRuleSize size = *hemisphere_rule_size(n);
    return fmt::format("{} ({} x {})", n, size.heights, size.azimuths);
  };
  int below = std::min(nodes, most_hemisphere_nodes);
  while (!hemisphere_rule_size(below)) --below;
  if (below == most_hemisphere_nodes) return name(below);
  int above = nodes;
  while (!hemisphere_rule_size(above)) ++above;
  return name(below) + " and " + name(above);
}

void check_gauss_rule(const IntegratorDescription& settings) {
  require(settings.gauss_nodes >= 0, "{} nodes of Gauss's rule: give 1 or more", settings.gauss_nodes);
  const int nodes = gauss_nodes_of(settings);
  if (hemisphere_rule_size(nodes)) return;
  throw Error(
      fmt::format("{} nodes of Gauss's rule{}: their number has to be heights times azimuths, from 1 to 8 azimuths for "
                  "each height, and at most {}; the nearest are {}",
                  nodes, settings.gauss_nodes == 0 ? " (one for each sample of a pixel)" : "", most_hemisphere_nodes,
                  nearest_rules(nodes)));
}

void check_integrator(const IntegratorDescription& settings) {
  require(settings.samples >= 1, "{} samples per pixel: there must be at least 1", settings.samples);
  require(settings.max_depth >= 0 && settings.max_depth <= 65535, "greatest depth {} is not in [0, 65535]",
          settings.max_depth);
  require(settings.max_refractions >= -1, "{} refractions: give 0 or more, or -1 for any number",
          settings.max_refractions);
  require(settings.clamp > 0, "clamp at {}: it must be positive", settings.clamp);
  require(settings.occlusion_distance > 0, "occlusion up to {} m: the distance must be positive",
          settings.occlusion_distance);
  if (settings.kind == IntegratorKind::gauss) check_gauss_rule(settings);
  require(settings.roulette_depth >= 0, "Russian roulette after {} events: give 0 or more", settings.roulette_depth);
}

void check_patch(const PatchDescription& patch, std::size_t pictures, const std::string& what) {
  require(finite(patch.center) && finite(patch.axis_u) && finite(patch.axis_v), "{}: a coordinate is not finite", what);
  require(length(patch.axis_u) > 0 && length(patch.axis_v) > 0 &&
              std::abs(dot(patch.axis_u, patch.axis_v)) <= 1e-6 * length(patch.axis_u) * length(patch.axis_v),
          "{}: its axes are not at right angles", what);
  require(patch.half_u > 0 && patch.half_v > 0, "{}: its half sides {} and {} are not positive", what, patch.half_u,
          patch.half_v);
  require(!has_inside(patch.material), "{}: a patch has no inside to refract into", what);
  check_material(patch.material, pictures, what);
  check_color(patch.radiance, what + ": radiance", 1e30f);
  if (is_black(patch.radiance)) return;
  require(finite(patch.half_u) && finite(patch.half_v), "{}: it shines, so it must not be infinite", what);
  require(!patch.round || std::abs(patch.half_u - patch.half_v) <= 1e-6 * patch.half_u,
          "{}: it shines, so it has to be a circle: its half sides are {} and {}", what, patch.half_u, patch.half_v);
}

void check_cylinder(const CylinderDescription& cylinder, std::size_t pictures, const std::string& what) {
  require(finite(cylinder.start) && finite(cylinder.end), "{}: a coordinate is not finite", what);
  require(length(cylinder.end - cylinder.start) > 0, "{}: its two ends are the same point", what);
  require(cylinder.radius > 0 && finite(cylinder.radius), "{}: its radius {} is not positive", what, cylinder.radius);
  require(finite(cylinder.meridian) && std::abs(dot(cylinder.end - cylinder.start, cylinder.meridian)) <=
                                           1e-6 * length(cylinder.end - cylinder.start) * length(cylinder.meridian),
          "{}: its meridian is not at right angles to its axis", what);
  require(!has_inside(cylinder.material), "{}: it is open, and has no inside to refract into", what);
  check_material(cylinder.material, pictures, what);
  check_color(cylinder.radiance, what + ": radiance", 1e30f);
}

void check_mesh(const MeshDescription& mesh, std::size_t pictures, const std::string& what) {
  require(!mesh.mesh.triangles.empty(), "{}: it has no triangles", what);
  require(mesh.mesh.normals.empty() || mesh.mesh.normals.size() == mesh.mesh.positions.size(),
          "{}: {} normals for {} positions", what, mesh.mesh.normals.size(), mesh.mesh.positions.size());
  for (const Vec3& p : mesh.mesh.positions) require(is_finite(p), "{}: a position is not finite", what);
  require(mesh.mesh.coordinates.empty() || mesh.mesh.coordinates.size() == mesh.mesh.positions.size(),
          "{}: {} texture coordinates for {} positions", what, mesh.mesh.coordinates.size(),
          mesh.mesh.positions.size());
  for (const Vec2 uv : mesh.mesh.coordinates)
    require(is_finite(uv.x) && is_finite(uv.y), "{}: a texture coordinate is not finite", what);
  for (const auto& triangle : mesh.mesh.triangles)
    for (const std::uint32_t index : triangle)
      require(index < mesh.mesh.positions.size(), "{}: a triangle names position {} of {}", what, index,
              mesh.mesh.positions.size());
  check_color(mesh.radiance, what + ": radiance", 1e30f);
  check_material(mesh.material, pictures, what);
  check_placement(mesh.placement, what);
  for (const Placement& copy : mesh.copies) check_placement(copy, what + ": a copy");
}

void check_splats(const SplatsDescription& splats, std::size_t pictures, const std::string& what) {
  const std::size_t count = splats.centers.size();
  require(count > 0 || splats.hierarchy != nullptr, "{}: there are none", what);
  require(count == 0 || splats.hierarchy == nullptr, "{}: they are a file's, but {} others are there as well", what,
          count);
  require(splats.hierarchy == nullptr || splats.hierarchy->closed == splats.closed,
          "{}: the file says otherwise of whether they are closed", what);
  const auto one_each = [&](std::size_t size, const char* name) {
    require(size == count, "{}: {} {} for {} splats", what, size, name, count);
  };
  one_each(splats.normals.size(), "normals");
  one_each(splats.radii.size(), "radii");
  if (!splats.lesser_axes.empty()) one_each(splats.lesser_axes.size(), "lesser axes");
  if (!splats.colors.empty()) one_each(splats.colors.size(), "colours");
  for (std::size_t i = 0; i < count; ++i) {
    require(finite(splats.centers[i]), "{}: the centre of splat {} is not finite", what, i);
    require(std::abs(length(splats.normals[i]) - 1) < 1e-3f, "{}: the normal of splat {} has not length 1", what, i);
    require(splats.radii[i] > 0 && finite(splats.radii[i]), "{}: the radius {} of splat {} is not positive", what,
            splats.radii[i], i);
    if (splats.lesser_axes.empty()) continue;
    const float lesser = length(splats.lesser_axes[i]);
    require(lesser > 0 && lesser <= splats.radii[i] * 1.001f &&
                std::abs(dot(splats.lesser_axes[i], splats.normals[i])) <= 1e-2f * lesser,
            "{}: the lesser half axis of splat {} is 0, longer than the greater one, or not in its plane", what, i);
  }
  for (std::size_t i = 0; i < splats.colors.size(); ++i)
    check_color(splats.colors[i], fmt::format("{}: colour of splat {}", what, i), 1);
  if (splats.surface == CloudSurface::mls) {
    require(splats.mls_support >= 1 && splats.mls_support <= 16, "{}: the support {} of its surface is not in [1, 16]",
            what, splats.mls_support);
    require(splats.lesser_axes.empty(), "{}: a moving least squares surface takes no ellipses", what);
    require(splats.hierarchy == nullptr && splats.detail == 0, "{}: levels of detail are of splats", what);
    require(!splats.bent_normals, "{}: bent normals are for splats; a moving least squares surface is smooth", what);
  }
  require(splats.detail >= 0 && finite(splats.detail), "{}: a detail of {} footprints: it must be 0 or greater", what,
          splats.detail);
  require(splats.closed || !has_inside(splats.material),
          "{}: they are open, and have no inside to refract into (is it a closed cloud?)", what);
  check_material(splats.material, pictures, what);
  check_no_coordinates(splats.material, what);
  check_placement(splats.placement, what);
}

std::string numbered(const char* what, std::size_t i) { return fmt::format("{} {}", what, i + 1); }

/// Every material's grid is there.
void check_grid_references(const SceneDescription& scene) {
  each_material(scene, [&](const MaterialDescription& material, const char* what, std::size_t i) {
    require(material.grid_medium < static_cast<int>(scene.grid_media.size()), "{}: it names grid medium {} of {}",
            numbered(what, i), material.grid_medium + 1, scene.grid_media.size());
  });
}

bool has_colors(const SplatsDescription& splats) {
  return splats.hierarchy != nullptr ? splats.hierarchy->colors != nullptr : !splats.colors.empty();
}

/// A surface's own colour is asked of splats that have colours.
void check_own_colors(const SceneDescription& scene) {
  each_material(scene, [&](const MaterialDescription& material, const char* what, std::size_t i) {
    const bool splats = std::string_view(what) == "splats";
    if (splats && has_colors(scene.splats[i])) return;
    require(material.reflectance.kind != TextureKind::own && material.roughness.kind != TextureKind::own,
            "{}: its texture is its own colour, and it has none", numbered(what, i));
  });
}

}  // namespace

void validate(const SceneDescription& scene) {
  const std::size_t pictures = scene.pictures.size();
  for (std::size_t i = 0; i < pictures; ++i) check_picture(scene.pictures[i], numbered("picture", i));
  for (std::size_t i = 0; i < scene.fluids.size(); ++i) check_fluid(scene.fluids[i], pictures, numbered("fluid", i));
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) check_volume(scene.volumes[i], numbered("volume", i));
  for (std::size_t i = 0; i < scene.grid_media.size(); ++i)
    check_grid_medium(scene.grid_media[i], numbered("grid medium", i));
  check_grid_references(scene);
  check_own_colors(scene);
  for (std::size_t i = 0; i < scene.balls.size(); ++i) {
    const std::string what = numbered("set of balls", i);
    check_material(scene.balls[i].material, pictures, what);
    const Vec3d pole = scene.balls[i].pole, meridian = scene.balls[i].meridian;
    require(finite(pole) && finite(meridian) && length(pole) > 0 && length(meridian) > 0 &&
                std::abs(dot(pole, meridian)) <= 1e-6 * length(pole) * length(meridian),
            "{}: its pole and meridian are not at right angles", what);
    check_color(scene.balls[i].radiance, what + ": radiance", 1e30f);
    for (const BallDescription& ball : scene.balls[i].balls)
      require(finite(ball.center) && ball.radius >= 0 && finite(ball.radius),
              "{}: a ball of radius {} is negative or not finite", what, ball.radius);
  }
  for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
    check_box(scene.boxes[i].box, numbered("box", i));
    check_material(scene.boxes[i].material, pictures, numbered("box", i));
  }
  for (std::size_t i = 0; i < scene.patches.size(); ++i) check_patch(scene.patches[i], pictures, numbered("patch", i));
  for (std::size_t i = 0; i < scene.cylinders.size(); ++i)
    check_cylinder(scene.cylinders[i], pictures, numbered("cylinder", i));
  for (std::size_t i = 0; i < scene.splats.size(); ++i) check_splats(scene.splats[i], pictures, numbered("splats", i));
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) check_mesh(scene.meshes[i], pictures, numbered("mesh", i));
  for (std::size_t i = 0; i < scene.lights.size(); ++i) check_light(scene.lights[i], numbered("light", i));
  check_color(scene.environment.constant, "environment: radiance", 1e30f);
  require(scene.environment.scale >= 0 && finite(scene.environment.scale),
          "environment: scale {} is negative or not finite", scene.environment.scale);
  check_film(scene.film);
  make_camera(scene.camera, scene.film.width, scene.film.height);
  check_integrator(scene.integrator);
}

}  // namespace embrun

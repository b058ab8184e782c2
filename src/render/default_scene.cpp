#include "render/default_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <unordered_map>

#include "base/error.h"
#include "io/image_read.h"
#include "io/read_mesh.h"
#include "media/homogeneous.h"
#include "particles/particle_kinds.h"
#include "render/kind_options.h"
#include "render/option_names.h"

namespace embrun {
namespace {

Vec3d to_vector(const Point& p) { return {p[0], p[1], p[2]}; }

/// The q-quantile of values that may be reordered.
double quantile(std::vector<double>& values, double q) {
  const auto rank = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

/// Every n-th particle, so that at most so many are looked at.
std::size_t stride_for(std::size_t count, std::size_t most) { return count / most + 1; }

/// A chosen coordinate, rounded to what is worth writing down: about the 100,000th part of the scene.
double round_choice(double v, const Box3d& bounds) {
  // Written with powers of ten that are whole numbers, so that the result prints as short as it is.
  const double decimals = 5 - std::floor(std::log10(length(bounds.high - bounds.low)));
  const double power = std::pow(10.0, std::abs(decimals));
  return decimals >= 0 ? std::round(v * power) / power : std::round(v / power) * power;
}
Vec3d round_choice(Vec3d v, const Box3d& bounds) {
  return {round_choice(v.x, bounds), round_choice(v.y, bounds), round_choice(v.z, bounds)};
}

// ---- fluid -------------------------------------------------------------------------------------------------------

FluidDescription make_fluid(const MeasuredParticles& measured, const RenderOptions& options) {
  FluidDescription fluid;
  fluid.file = measured.file;
  fluid.kinds = options.kinds;
  fluid.positions = measured.particles.positions;
  fluid.radii = measured.radius.radii;
  fluid.surface = surface_settings(measured, options);
  fluid.method = method_from_names(options.method, options.representation);
  if (fluid.method == SurfaceMethod::mesh) {
    fluid.mesh_cell = options.mesh_cell.value_or(0);
    fluid.density_cell = options.density_cell.value_or(0);
  }
  fluid.detail = options.lod.value_or(0);
  fluid.material = water_material(options);
  if (options.container) {
    const auto& c = *options.container;
    fluid.container = Box3d{{c[0], c[1], c[2]}, {c[3], c[4], c[5]}};
  }
  return fluid;
}

// ---- surroundings ------------------------------------------------------------------------------------------------

/// 1, 2 or 5 times a power of ten, not above `length`.
double round_length(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length)));
  return length >= 5 * power ? 5 * power : length >= 2 * power ? 2 * power : power;
}

PatchDescription make_floor(FloorKind kind, double height, const Box3d& bounds, const UpBasis& up) {
  PatchDescription floor;
  floor.center = height * to_double(up.up);
  floor.axis_u = to_double(up.right);
  floor.axis_v = -1.0 * to_double(up.back);
  floor.half_u = floor.half_v = static_cast<double>(infinity);
  floor.material = diffuse_material({0.52f, 0.51f, 0.49f});
  if (kind != FloorKind::checker) return floor;
  TextureDescription& texture = floor.material.reflectance;
  texture.kind = TextureKind::checker;
  texture.first = grey(0.7f);
  texture.second = grey(0.25f);
  const Vec3d size = bounds.high - bounds.low;
  const bool y_up = up.up.y == 1.0f;
  texture.axis_u = 0;
  texture.axis_v = y_up ? 2 : 1;
  texture.cell = round_length(std::max(size.x, y_up ? size.z : size.y) / 8);
  return floor;
}

EnvironmentDescription make_environment(const RenderOptions& options, std::vector<std::string>& notes) {
  using Kind = EnvironmentDescription::Kind;
  EnvironmentDescription environment;
  if (options.environment == "white") return environment;
  if (options.environment == "sky" || options.environment == "studio") {
    environment.kind = options.environment == "sky" ? Kind::sky : Kind::studio;
    if (options.sun == 0.0)
      environment.sky.sun_irradiance = 0;
    else if (options.sun)
      environment.sky.sun_diameter = static_cast<float>(*options.sun);
    return environment;
  }
  environment.kind = Kind::image;
  environment.file = options.environment;
  Image image = read_image(options.environment);
  const EnvironmentRepair repair = clean_environment(image);
  if (repair.not_finite + repair.negative > 0)
    notes.push_back(fmt::format("{}: {} pixels are not finite and {} negative; their channels count as 0",
                                options.environment, repair.not_finite, repair.negative));
  environment.image = as_environment(image);
  return environment;
}

// ---- camera ------------------------------------------------------------------------------------------------------

CameraSettings make_camera_settings(const RenderOptions& options, const Box3d& bounds, UpAxis up_axis) {
  constexpr double default_fov = 35;
  const double aspect = static_cast<double>(options.width) / options.height;
  const double fov = options.fov.value_or(default_fov);
  CameraSettings camera = frame_box(bounds.low, bounds.high, parse_view(options.view), up_axis, aspect, fov);
  camera.eye = round_choice(camera.eye, bounds);
  camera.target = round_choice(camera.target, bounds);
  if (options.camera_from) {
    camera.eye = to_vector(*options.camera_from);
    camera.target =
        options.camera_to ? to_vector(*options.camera_to) : round_choice(0.5 * (bounds.low + bounds.high), bounds);
    const UpBasis basis = up_basis(up_axis);
    const Vec3d view = normalize(camera.target - camera.eye);
    // Straight up or down, the top of the picture is away from a viewer in front.
    const bool vertical = length(cross(view, to_double(basis.up))) < 1e-6;
    camera.up = vertical ? -1.0 * to_double(basis.back) : to_double(basis.up);
  }
  camera.filter = filter_from_name(options.filter);
  return camera;
}

}  // namespace

MeasuredParticles measure(ParticleSet particles, const RenderOptions& options, const std::string& name) {
  MeasuredParticles measured;
  if (options.kinds.empty()) {
    measured.particles = std::move(particles);
  } else {
    auto sets = split_by_kind(particles, kind_mapping_from_text(options.kinds), name);
    measured.particles = std::move(sets[static_cast<std::size_t>(ParticleKind::water)]);
    if (measured.particles.size() == 0)
      throw Error(fmt::format("{}: by the kinds {} no particle is water", name, options.kinds));
    measured.others.assign(std::make_move_iterator(sets.begin()), std::make_move_iterator(sets.end()));
  }
  static_cast<SizedParticles&>(measured) = size_particles(std::move(measured.particles), options.radius, name);
  return measured;
}

SurfaceSettings surface_settings(const MeasuredParticles& measured, const RenderOptions& options) {
  SurfaceSettings surface;
  surface.kernel = kernel_from_name(options.kernel);
  surface.order = options.order;
  const ThresholdChoice threshold = threshold_from_text(options.threshold);
  surface.threshold_mode = threshold.mode;
  surface.threshold = threshold.value;
  surface.recover = recover_from_name(options.recover);
  surface.normal = normal_from_name(options.normal);
  surface.spacing = measured.spacing.spacing;
  surface.radius = static_cast<float>(measured.radius.radius);
  return surface;
}

Box3d robust_bounds(const MeasuredParticles& measured) {
  const std::vector<Vec3d>& positions = measured.particles.positions;
  const std::size_t stride = stride_for(positions.size(), 200000);
  std::vector<double> x, y, z;
  for (std::size_t i = 0; i < positions.size(); i += stride) {
    x.push_back(positions[i].x);
    y.push_back(positions[i].y);
    z.push_back(positions[i].z);
  }
  constexpr double strays = 0.001;
  const Vec3d reach = measured.radius.radius * Vec3d{1, 1, 1};
  return {Vec3d{quantile(x, strays), quantile(y, strays), quantile(z, strays)} - reach,
          Vec3d{quantile(x, 1 - strays), quantile(y, 1 - strays), quantile(z, 1 - strays)} + reach};
}

double lowest_layer(const MeasuredParticles& measured, const UpBasis& up) {
  // The lowest particle of every column that holds any ...
  const double side = 4 * measured.radius.radius;
  const Vec3d right = to_double(up.right), back = to_double(up.back), upwards = to_double(up.up);
  std::unordered_map<std::uint64_t, double> lows;
  for (const Vec3d& p : measured.particles.positions) {
    const auto cell = [side](double c) {
      return static_cast<std::uint64_t>(static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(c / side))));
    };
    const std::uint64_t column = cell(dot(p, right)) << 32 | cell(dot(p, back));
    const auto [entry, fresh] = lows.try_emplace(column, dot(p, upwards));
    entry->second = std::min(entry->second, dot(p, upwards));
  }
  std::vector<double> heights;
  heights.reserve(lows.size());
  for (const auto& [column, low] : lows) heights.push_back(low);

  // ... and of those near the lowest (but for a few strays) the usual height: that of the layer on the floor.
  const double lowest = quantile(heights, 0.02);
  std::vector<double> layer;
  for (const double height : heights)
    if (std::abs(height - lowest) <= 2 * measured.radius.radius) layer.push_back(height);
  return quantile(layer, 0.5);
}

MaterialDescription water_material(const RenderOptions& options) {
  const Color absorption =
      options.absorption.value_or(Color{clear_water_absorption.r, clear_water_absorption.g, clear_water_absorption.b});
  return dielectric_material(options.ior, {absorption[0], absorption[1], absorption[2]});
}

void add_surroundings(SceneDescription& scene, const RenderOptions& options, Box3d bounds, double floor_height,
                      std::vector<std::string>& notes) {
  scene.environment = make_environment(options, notes);
  double& bottom = scene.up == UpAxis::y ? bounds.low.y : bounds.low.z;
  if (const FloorKind floor = floor_from_name(options.floor); floor != FloorKind::none) {
    const double height = options.floor_height.value_or(floor_height);
    bottom = std::min(height, scene.up == UpAxis::y ? bounds.high.y : bounds.high.z);
    scene.patches.push_back(make_floor(floor, height, bounds, up_basis(scene.up)));
  }
  for (const std::string& path : options.meshes) {
    MeshDescription mesh;
    mesh.mesh = read_mesh(path);
    mesh.file = path;
    mesh.material = diffuse_material(grey(0.6f));
    scene.meshes.push_back(std::move(mesh));
  }
  scene.camera = make_camera_settings(options, bounds, scene.up);

  scene.film.width = options.width;
  scene.film.height = options.height;
  if (options.crop) {
    const auto& c = *options.crop;
    scene.film.crop = PixelWindow{c[0], c[1], c[2], c[3]};
  }
  scene.integrator.seed = options.seed;
  scene.integrator.samples = options.samples;
  set_integrator(scene.integrator, options.integrator, options.occlusion_distance, options.gauss_nodes);
  scene.integrator.max_depth = options.max_depth;
  scene.integrator.max_refractions = options.refractions;
  scene.integrator.straight_shadows = straight_shadows_from_name(options.boundary_nee, scene.integrator.kind);
  scene.integrator.clamp = options.clamp.value_or(scene.integrator.clamp);
}

SceneDescription make_scene(const MeasuredParticles& measured, const RenderOptions& options,
                            std::vector<std::string>& notes) {
  SceneDescription scene;
  scene.up = up_from_name(options.up);
  scene.fluids.push_back(make_fluid(measured, options));
  add_inside(scene.fluids.front(), measured, options, notes);
  Box3d bounds = robust_bounds(measured);
  add_other_particles(scene, measured, options, bounds, notes);
  double height = floor_from_name(options.floor) == FloorKind::none
                      ? 0
                      : round_choice(lowest_layer(measured, up_basis(scene.up)), bounds);
  // Fluid that wets its container reaches down to the bottom: there is nothing to cut.
  if (options.container) height = scene.up == UpAxis::y ? (*options.container)[1] : (*options.container)[2];
  // A tank stands a little in its floor, so that the floor alone is met there.
  if (options.tank) height -= 0.99 * *options.tank;
  add_surroundings(scene, options, bounds, height, notes);
  return scene;
}

}  // namespace embrun

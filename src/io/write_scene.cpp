#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "base/error.h"
#include "io/read_scene.h"
#include "io/scene/write_materials.h"

namespace embrun {
namespace {

void write_material(Xml& xml, const Pictures& pictures, const MaterialDescription& material) {
  write_bsdf(xml, pictures, material);
  write_interior(xml, material);
}

void write_emission(Xml& xml, Rgb radiance) {
  if (is_black(radiance)) return;
  xml.open("emitter type=\"area\"");
  xml.color("radiance", radiance);
  xml.close();
}

// ---- particles ---------------------------------------------------------------------------------------------------

void write_values(Xml& xml, const char* name, Rgb color, const std::vector<Rgb>& each, const std::string& source) {
  if (each.empty())
    xml.color(name, color);
  else
    xml.text(name, source);
}

void write(Xml& xml, const ParticleMediumDescription& medium) {
  const ParticleMediumSources& s = medium.sources;
  if ((!medium.extinctions.empty() && s.extinction.empty()) || (!medium.albedos.empty() && s.albedo.empty()) ||
      (!medium.densities.empty() && s.density.empty()) || (!medium.emission.empty() && s.emission.empty()) ||
      (!medium.temperatures.empty() && s.temperature.empty()))
    throw Error("values of the particles' medium are no attribute of their file: a scene file cannot name them");
  write_values(xml, "extinction", medium.extinction, medium.extinctions, s.extinction);
  write_values(xml, "albedo", medium.albedo, medium.albedos, s.albedo);
  if (!s.density.empty()) xml.text("density", s.density);
  if (!s.emission.empty()) xml.text("emission", s.emission);
  if (!s.temperature.empty()) xml.text("temperature", s.temperature);
  xml.real("extinction_scale", medium.extinction_scale);
  xml.real("emission_scale", medium.emission_scale);
  xml.real("density_radius", medium.density_radius);
  xml.text("density_model", medium.model == DensityModel::balls ? "balls" : "smooth");
  write_phase(xml, medium.phase);
}

void write(Xml& xml, const SurfaceSettings& surface) {
  constexpr const char* kernels[] = {"metaball", "zhu-bridson", "blinn"};
  constexpr const char* recovers[] = {"smooth", "thesis", "off"};
  constexpr const char* normals[] = {"weighted", "gradient"};
  xml.text("kernel", kernels[static_cast<int>(surface.kernel)]);
  xml.whole("order", surface.order);
  if (surface.threshold_mode == ThresholdMode::number)
    xml.real("threshold", surface.threshold);
  else
    xml.text("threshold", surface.threshold_mode == ThresholdMode::thesis ? "thesis" : "auto");
  xml.text("recover", recovers[static_cast<int>(surface.recover)]);
  xml.text("normal", normals[static_cast<int>(surface.normal)]);
}

void write(Xml& xml, const Pictures& pictures, const FluidDescription& fluid, std::size_t index) {
  need_file(fluid.file, "fluid", index);
  xml.open("shape type=\"particles\"");
  xml.files(fluid.file, fluid.more_files);
  if (!fluid.kinds.empty()) xml.text("kinds", fluid.kinds);
  if (fluid.radii.empty()) xml.real("radius", fluid.surface.radius);
  write(xml, fluid.surface);
  if (fluid.method == SurfaceMethod::thesis) xml.text("method", "thesis");
  if (fluid.method == SurfaceMethod::mesh) xml.text("method", "mesh");
  if (fluid.mesh_cell != 0) xml.real("mesh_cell", fluid.mesh_cell);
  if (fluid.density_cell != 0) xml.real("density_cell", fluid.density_cell);
  if (fluid.detail > 0) xml.real("detail", fluid.detail);
  if (fluid.container) {
    xml.point("container_low", fluid.container->low);
    xml.point("container_high", fluid.container->high);
  }
  if (!fluid.wets_container) xml.flag("wets_container", false);
  if (fluid.wall_overlap != 0) xml.real("wall_overlap", fluid.wall_overlap);
  xml.placement(fluid.placement);
  write_material(xml, pictures, fluid.material);
  if (fluid.medium) write(xml, *fluid.medium);
  xml.close();
}

void write(Xml& xml, const VolumeDescription& volume, std::size_t index) {
  need_file(volume.file, "volume", index);
  xml.open("shape type=\"particles\"");
  xml.text("kind", "foam");
  xml.files(volume.file, volume.more_files);
  if (!volume.kinds.empty()) xml.text("kinds", volume.kinds);
  if (volume.radii.empty()) xml.real("radius", volume.radius);
  write(xml, volume.medium);
  xml.close();
}

// ---- shapes ------------------------------------------------------------------------------------------------------

void write(Xml& xml, const Pictures& pictures, const BallsDescription& set, std::size_t index) {
  // The spheres of a set share their material.
  const bool shared = set.balls.size() > 1;
  const std::string material = fmt::format("balls_{}", index + 1), medium = material + "_medium";
  const bool on_grid = set.material.grid_medium >= 0;
  const bool has_medium = on_grid || !(is_black(set.material.absorption) && is_black(set.material.scattering));
  const std::string interior = on_grid ? grid_medium_id(set.material.grid_medium) : medium;
  if (shared) {
    write_bsdf(xml, pictures, set.material, material);
    write_interior(xml, set.material, medium);
  }
  for (const BallDescription& ball : set.balls) {
    xml.open("shape type=\"sphere\"");
    xml.point("center", ball.center);
    xml.real("radius", ball.radius);
    if (!(set.pole == Vec3d{0, 0, 1}) || !(set.meridian == Vec3d{1, 0, 0})) {
      xml.vector("pole", set.pole);
      xml.vector("meridian", set.meridian);
    }
    if (shared) {
      xml.line("<ref id=\"" + material + "\"/>");
      if (has_medium) xml.line("<ref name=\"interior\" id=\"" + interior + "\"/>");
    } else {
      write_material(xml, pictures, set.material);
    }
    write_emission(xml, set.radiance);
    xml.close();
  }
}

void write(Xml& xml, const Pictures& pictures, const BoxDescription& box) {
  xml.open("shape type=\"box\"");
  xml.point("low", box.box.low);
  xml.point("high", box.box.high);
  write_material(xml, pictures, box.material);
  xml.close();
}

void write(Xml& xml, const Pictures& pictures, const PatchDescription& patch) {
  xml.open("shape type=\"patch\"");
  xml.point("center", patch.center);
  xml.vector("axis_u", patch.axis_u);
  xml.vector("axis_v", patch.axis_v);
  if (std::isfinite(patch.half_u)) xml.real("half_u", patch.half_u);
  if (std::isfinite(patch.half_v)) xml.real("half_v", patch.half_v);
  if (patch.round) xml.flag("round", true);
  if (patch.v_reversed) xml.flag("v_reversed", true);
  write_material(xml, pictures, patch.material);
  write_emission(xml, patch.radiance);
  xml.close();
}

void write(Xml& xml, const Pictures& pictures, const CylinderDescription& cylinder) {
  xml.open("shape type=\"cylinder\"");
  xml.point("p0", cylinder.start);
  xml.point("p1", cylinder.end);
  xml.real("radius", cylinder.radius);
  if (!(cylinder.meridian == Vec3d{})) xml.vector("meridian", cylinder.meridian);
  if (cylinder.u_reversed) xml.flag("u_reversed", true);
  write_material(xml, pictures, cylinder.material);
  write_emission(xml, cylinder.radiance);
  xml.close();
}

template <class Vector>
std::string joined(const std::vector<Vector>& vectors) {
  std::string text;
  for (const Vector& v : vectors) text += fmt::format("{}{}, {}, {}", text.empty() ? "" : ",  ", v[0], v[1], v[2]);
  return text;
}

void write(Xml& xml, const Pictures& pictures, const MeshDescription& mesh, std::size_t index) {
  const std::string group = fmt::format("mesh_{}", index + 1);
  const bool copied = !mesh.copies.empty();
  if (copied) xml.open("shape type=\"shapegroup\" id=\"" + group + "\"");
  if (mesh.file.empty()) {
    xml.open("shape type=\"mesh\"");
    xml.text("positions", joined(mesh.mesh.positions));
    if (!mesh.mesh.normals.empty()) xml.text("normals", joined(mesh.mesh.normals));
    if (!mesh.mesh.coordinates.empty()) {
      std::string text;
      for (const Vec2 c : mesh.mesh.coordinates) text += fmt::format("{}{}, {}", text.empty() ? "" : ",  ", c.x, c.y);
      xml.text("coordinates", text);
    }
    xml.text("triangles", joined(mesh.mesh.triangles));
  } else {
    xml.open("shape type=\"ply\"");
    xml.file(mesh.file);
    if (mesh.face_normals) xml.flag("face_normals", true);
    if (mesh.flipped) xml.flag("flip_normals", true);
    if (mesh.coordinates_flipped) xml.flag("flip_tex_coords", true);
  }
  if (!copied) xml.placement(mesh.placement);
  write_material(xml, pictures, mesh.material);
  write_emission(xml, mesh.radiance);
  xml.close();
  if (!copied) return;
  xml.close();
  for (const Placement& copy : mesh.copies) {
    xml.open("shape type=\"instance\"");
    xml.line("<ref id=\"" + group + "\"/>");
    xml.placement(copy);
    xml.close();
  }
}

/// How points became splats.
void write_choices(Xml& xml, const SplatsDescription& splats) {
  const SplatOptions& options = splats.options;
  if (options.normals != NormalChoice::automatic)
    xml.text("normals", options.normals == NormalChoice::file ? "file" : "estimate");
  if (options.neighbours) xml.whole("neighbours", static_cast<int>(*options.neighbours));
  if (options.sensor) xml.point("sensor", *options.sensor);
  if (options.radius) xml.real("radius", *options.radius);
  xml.real("radius_scale", options.radius_scale);
  if (options.ellipses) xml.flag("ellipses", true);
  // As it was told from the splats, for it decides what is seen.
  xml.flag("closed", splats.closed);
  if (options.keep_duplicates) xml.flag("keep_duplicates", true);
  xml.real("outlier_ratio", options.outlier_ratio);
  if (options.thin != 0) xml.real("thin", options.thin);
  if (splats.surface == CloudSurface::mls) {
    xml.text("surface", "mls");
    xml.real("mls_support", splats.mls_support);
  }
  if (splats.bent_normals) xml.flag("bent_normals", true);
  if (splats.flipped) xml.flag("flip_normals", true);
}

void write(Xml& xml, const Pictures& pictures, const SplatsDescription& splats, std::size_t index) {
  need_file(splats.file, "splats", index);
  xml.open("shape type=\"splats\"");
  xml.file(splats.file);
  if (splats.hierarchy == nullptr) write_choices(xml, splats);
  // Of a file of splats it is on unless said otherwise.
  if (splats.detail > 0 || splats.hierarchy != nullptr) xml.real("detail", splats.detail);
  xml.placement(splats.placement);
  write_material(xml, pictures, splats.material);
  xml.close();
}

// ---- lights ------------------------------------------------------------------------------------------------------

/// Those without extent are Mitsuba's own.
void write_delta_light(Xml& xml, const LightDescription& light) {
  const bool point = light.kind == LightDescription::Kind::point;
  xml.open(point ? "emitter type=\"point\"" : "emitter type=\"directional\"");
  xml.color(point ? "intensity" : "irradiance", light.radiance);
  if (point)
    xml.point("position", light.position);
  else
    xml.vector("direction", -1.0 * light.normal);
  xml.close();
}

void write(Xml& xml, const LightDescription& light) {
  using Kind = LightDescription::Kind;
  if (light.kind == Kind::point || light.kind == Kind::directional) {
    write_delta_light(xml, light);
    return;
  }
  const bool sun = light.kind == Kind::distant;
  xml.open(sun ? "emitter type=\"sun_disk\"" : "emitter type=\"lamp\"");
  xml.color("radiance", light.radiance);
  switch (light.kind) {
    case Kind::rectangle:
      xml.text("shape", "rectangle");
      xml.vector("edge_u", light.edge_u);
      xml.vector("edge_v", light.edge_v);
      break;
    case Kind::disk:
      xml.text("shape", "disk");
      xml.vector("normal", light.normal);
      xml.real("radius", light.radius);
      break;
    case Kind::sphere:
      xml.text("shape", "sphere");
      xml.real("radius", light.radius);
      break;
    case Kind::distant:
      xml.vector("towards", light.normal);
      xml.real("half_angle", light.half_angle);
      break;
    case Kind::point:
    case Kind::directional: break;
  }
  if (!sun) xml.point("position", light.position);
  if (light.two_sided) xml.flag("two_sided", true);
  xml.close();
}

void write(Xml& xml, const EnvironmentDescription& environment) {
  using Kind = EnvironmentDescription::Kind;
  switch (environment.kind) {
    case Kind::none: return;
    case Kind::constant:
      xml.open("emitter type=\"constant\"");
      xml.color("radiance", environment.constant);
      xml.close();
      return;
    case Kind::sky: {
      const SkySettings& sky = environment.sky;
      xml.open("emitter type=\"sky\"");
      xml.real("sun_elevation", sky.sun_elevation);
      xml.real("sun_azimuth", sky.sun_azimuth);
      xml.real("sun_diameter", sky.sun_diameter);
      xml.real("sun_irradiance", sky.sun_irradiance);
      xml.real("sky_irradiance", sky.sky_irradiance);
      xml.real("turbidity", sky.turbidity);
      xml.color("ground", sky.ground);
      break;
    }
    case Kind::studio: xml.open("emitter type=\"studio\""); break;
    case Kind::image:
      if (environment.file.empty()) throw Error("the environment is not from a file: a scene file cannot name it");
      xml.open("emitter type=\"envmap\"");
      xml.file(environment.file);
      xml.real("scale", environment.scale);
      break;
  }
  xml.real("turn", environment.turn);
  xml.close();
}

// ---- camera and integrator ---------------------------------------------------------------------------------------

void write_filter(Xml& xml, const PixelFilter& filter) {
  switch (filter.kind) {
    case FilterKind::box: xml.line("<rfilter type=\"box\"/>"); return;
    case FilterKind::tent: xml.open("rfilter type=\"tent\""); break;
    case FilterKind::gaussian:
      xml.open("rfilter type=\"gaussian\"");
      xml.real("stddev", static_cast<double>(filter.radius) / 3);
      xml.close();
      return;
    case FilterKind::blackman_harris: xml.open("rfilter type=\"blackman_harris\""); break;
  }
  xml.real("radius", filter.radius);
  xml.close();
}

void write_sensor(Xml& xml, const SceneDescription& scene) {
  const CameraSettings& camera = scene.camera;
  const FilmDescription& film = scene.film;
  xml.open(camera.lens_radius > 0 ? "sensor type=\"thinlens\"" : "sensor type=\"perspective\"");
  xml.real("fov", camera.vertical_fov);
  xml.text("fov_axis", "y");
  if (camera.lens_radius > 0) xml.real("aperture_radius", camera.lens_radius);
  if (camera.focus_distance > 0) xml.real("focus_distance", camera.focus_distance);
  if (camera.shutter_open != 0 || camera.shutter_close != 0) {
    xml.real("shutter_open", camera.shutter_open);
    xml.real("shutter_close", camera.shutter_close);
  }
  xml.open("transform name=\"to_world\"");
  if (camera.mirrored) xml.line("<scale x=\"-1\"/>");
  xml.line(fmt::format("<lookat origin=\"{}\" target=\"{}\" up=\"{}\"/>", triple(camera.eye), triple(camera.target),
                       triple(camera.up)));
  xml.close();
  const IntegratorDescription& integrator = scene.integrator;
  xml.open(integrator.sampler == SamplerKind::sobol ? "sampler type=\"sobol\"" : "sampler type=\"independent\"");
  xml.whole("sample_count", integrator.samples);
  xml.whole("seed", integrator.seed);
  xml.close();
  xml.open("film type=\"hdrfilm\"");
  xml.whole("width", film.width);
  xml.whole("height", film.height);
  if (film.crop) {
    xml.whole("crop_offset_x", film.crop->x);
    xml.whole("crop_offset_y", film.crop->y);
    xml.whole("crop_width", film.crop->width);
    xml.whole("crop_height", film.crop->height);
  }
  write_filter(xml, camera.filter);
  xml.close();
  xml.close();
}

void write_integrator(Xml& xml, const IntegratorDescription& integrator) {
  constexpr int unlimited = 65535;
  constexpr const char* kinds[] = {"volpath", "whitted", "ao", "gauss"};
  const IntegratorKind kind = integrator.kind;
  xml.open(std::string("integrator type=\"") + kinds[static_cast<int>(kind)] + "\"");
  xml.whole("max_depth", integrator.max_depth >= unlimited ? -1 : integrator.max_depth + 1);
  xml.whole("rr_depth", integrator.roulette_depth);
  xml.whole("max_refractions", integrator.max_refractions);
  xml.flag("hide_emitters", integrator.hide_emitters);
  // What has no effect would be a warning when it is read.
  if (kind == IntegratorKind::path) xml.flag("guide", integrator.guide);
  if (kind == IntegratorKind::path || kind == IntegratorKind::gauss) xml.flag("equiangular", integrator.equiangular);
  if (kind == IntegratorKind::gauss && integrator.gauss_nodes > 0) xml.whole("nodes", integrator.gauss_nodes);
  if (kind == IntegratorKind::ambient_occlusion) {
    if (std::isfinite(integrator.occlusion_distance)) xml.real("distance", integrator.occlusion_distance);
  } else {
    xml.flag("straight_shadows", integrator.straight_shadows);
    if (std::isfinite(integrator.clamp)) xml.real("clamp", integrator.clamp);
  }
  xml.close();
}

}  // namespace

std::string write_scene(const SceneDescription& scene) {
  Xml xml;
  xml.open("scene version=\"3.0.0\"");
  xml.text("up", scene.up == UpAxis::z ? "z" : "y");
  constexpr const char* overlaps[] = {"min", "max", "sum"};
  xml.text("overlap", overlaps[static_cast<int>(scene.overlap)]);
  write_integrator(xml, scene.integrator);
  write_sensor(xml, scene);
  write_grid_media(xml, scene);
  write(xml, scene.environment);
  for (const LightDescription& light : scene.lights) write(xml, light);
  for (std::size_t i = 0; i < scene.fluids.size(); ++i) write(xml, scene.pictures, scene.fluids[i], i);
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) write(xml, scene.volumes[i], i);
  for (std::size_t i = 0; i < scene.balls.size(); ++i) write(xml, scene.pictures, scene.balls[i], i);
  for (const BoxDescription& box : scene.boxes) write(xml, scene.pictures, box);
  for (const PatchDescription& patch : scene.patches) write(xml, scene.pictures, patch);
  for (const CylinderDescription& cylinder : scene.cylinders) write(xml, scene.pictures, cylinder);
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) write(xml, scene.pictures, scene.meshes[i], i);
  for (std::size_t i = 0; i < scene.splats.size(); ++i) write(xml, scene.pictures, scene.splats[i], i);
  xml.close();
  return xml.take();
}

}  // namespace embrun

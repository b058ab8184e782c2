#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>

#include "base/error.h"
#include "base/instruction_set.h"
#include "embrun/embrun.h"
#include "io/atomic_file.h"
#include "io/read_particles.h"
#include "io/text.h"
#include "io/write_mesh.h"
#include "math/box3d.h"
#include "meshing/density_vdb.h"
#include "meshing/isosurface.h"
#include "render/default_scene.h"
#include "render/kind_options.h"
#include "render/option_names.h"
#include "render/render_loop.h"
#include "render/stopwatch.h"

namespace embrun {
namespace {

/// The options of a render that have the same meaning.
RenderOptions render_options(const MeshOptions& o) {
  RenderOptions r;
  r.radius = o.radius;
  r.order = o.order;
  r.kernel = o.kernel;
  r.threshold = o.threshold;
  r.recover = o.recover;
  r.normal = o.normal;
  r.kinds = o.kinds;
  r.threads = o.threads;
  return r;
}

Point to_point(Vec3d p) { return {p.x, p.y, p.z}; }

/// The middle of the particles' bounds.
Vec3d middle_of(const std::vector<Vec3d>& positions) {
  const Box3d box = box_of(positions);
  return 0.5 * (box.low + box.high);
}

/// The next place whose coordinates are multiples of a number.
Vec3d round_to(double step, Vec3d p) {
  return {std::round(p.x / step) * step, std::round(p.y / step) * step, std::round(p.z / step) * step};
}

std::vector<Vec3> relative_to(Vec3d origin, const std::vector<Vec3d>& positions) {
  std::vector<Vec3> result;
  result.reserve(positions.size());
  for (const Vec3d& p : positions) result.push_back(to_float(p - origin));
  return result;
}

/// A mesh and a density in the making, one step after the other.
struct MeshWork {
  const MeshOptions& options;
  const RenderHooks& hooks;
  MeshReport report;
  MeasuredParticles measured;
  Vec3d origin;                 ///< what the rest is relative to
  std::vector<Vec3> positions;  ///< single precision is enough about the particles' middle
  TriangleMesh mesh;
  DensityGrid density;
  Vec3d density_origin;  ///< what that is relative to: so that grids of the same cells are aligned everywhere

  void read(const std::string& particle_file);
  void take_measure(ParticleSet particles, const std::string& name);
  void make_mesh();
  void make_density();
  void record_mesh();
  void write(const std::string& mesh_file);
};

void MeshWork::read(const std::string& particle_file) {
  report.version = version();
  report.instruction_set = name_of(instruction_set());
  report.threads = thread_count(options.threads);
  report.input = particle_file;
  const Stopwatch watch;
  tell(hooks, "reading", 0, 0);
  ParticleSet particles = read_particles(particle_file);
  report.format = particles.format;
  report.dropped = particles.dropped_non_finite;
  report.read_seconds = watch.seconds();
  tell(hooks, "reading", 1, report.read_seconds);
  take_measure(std::move(particles), particle_file);
}

void MeshWork::take_measure(ParticleSet particles, const std::string& name) {
  const Stopwatch watch;
  const std::size_t read = particles.size();
  measured = measure(std::move(particles), render_options(options), name);
  check_extent(measured.particles, measured.radius.radius, name);
  report.particles = measured.particles.size();
  report.dropped += read - report.particles;
  report.radius = measured.radius.radius;
  report.radius_source = to_string(measured.radius.source);
  report.spacing = measured.spacing.spacing;
  report.notes = measured.particles.notes;
  report.cell = options.cell.value_or(0.5 * report.radius);
  report.density_cell = options.density_cell.value_or(0.5 * report.radius);

  origin = middle_of(measured.particles.positions);
  positions = relative_to(origin, measured.particles.positions);
  report.measure_seconds = watch.seconds();
}

void MeshWork::make_mesh() {
  const Stopwatch watch;
  tell(hooks, "meshing", 0, 0);
  const std::vector<float>& radii = measured.radius.radii;
  const SurfaceModel model =
      resolve_surface_model(positions, radii, surface_settings(measured, render_options(options)));
  report.recovered = model.recovered.size();
  report.threshold = static_cast<double>(model.threshold);
  report.influence_radius = static_cast<double>(model.influence_radius);
  report.measure_seconds += watch.seconds();

  IsosurfaceSettings settings;
  settings.cell = static_cast<float>(report.cell);
  settings.progress = [&](double fraction) { tell(hooks, "meshing", fraction, watch.seconds()); };
  IsosurfaceStats stats;
  mesh = extract_isosurface(positions, radii, model, settings, &stats);
  report.sample_seconds = stats.sampling_seconds;
  report.extract_seconds = stats.extraction_seconds;
  record_mesh();
  tell(hooks, "meshing", 1, watch.seconds());
}

void MeshWork::record_mesh() {
  report.vertices = mesh.positions.size();
  report.triangles = mesh.triangles.size();
  report.components = component_count(mesh);
  report.volume = enclosed_volume(mesh);
  report.area = surface_area(mesh);
  Box3 box;
  for (const Vec3& p : mesh.positions) box.include(p);
  if (box.empty()) return;
  report.low = to_point(origin + to_double(box.low));
  report.high = to_point(origin + to_double(box.high));
}

/// Relative to rest density: 1 in the balls of particles without a density of their own.
void MeshWork::make_density() {
  const Stopwatch watch;
  tell(hooks, "sampling", 0, 0);
  std::vector<float> radii = measured.radius.radii;
  const double scale = options.density_radius ? *options.density_radius / report.radius : 1;
  for (float& radius : radii) radius *= static_cast<float>(scale);
  const auto cell = static_cast<float>(report.density_cell);
  density_origin = round_to(static_cast<double>(DensityGrid::tile_side * cell), origin);
  const std::vector<Vec3> places = relative_to(density_origin, measured.particles.positions);
  DensityParticles particles;
  particles.positions = places;
  particles.radii = radii;
  particles.radius = static_cast<float>(scale * report.radius);
  particles.extinction = grey(1);
  particles.factors = relative_densities(measured.particles, report.notes, report.input);
  density =
      sample_density(particles, cell, [&](double fraction) { tell(hooks, "sampling", fraction, watch.seconds()); });
  double sum = 0;
  for (const float value : density.extinction) {
    report.density_voxels += value != 0;
    sum += static_cast<double>(value);
  }
  report.density_integral = sum * std::pow(static_cast<double>(density.cell), 3);
  report.density_seconds = watch.seconds();
  tell(hooks, "sampling", 1, report.density_seconds);
}

void MeshWork::write(const std::string& mesh_file) {
  const Stopwatch watch;
  tell(hooks, "writing", 0, 0);
  std::string comment = fmt::format("Embrun {}", version());
  if (!options.command.empty()) comment += ": " + options.command;
  write_mesh(mesh_file, mesh, {origin, 1e-3f * static_cast<float>(report.cell), comment});
  if (!options.density_file.empty()) {
    const std::string bytes = encode_vdb(density, density_origin, comment);
    write_file_atomically(options.density_file, std::as_bytes(std::span(bytes)));
  }
  report.write_seconds = watch.seconds();
  tell(hooks, "writing", 1, report.write_seconds);
}

}  // namespace

void check_mesh_options(const MeshOptions& o) {
  check_options(render_options(o));
  if (o.cell && !(*o.cell > 0 && std::isfinite(*o.cell)))
    throw Error(fmt::format("cell {}: it must be positive", *o.cell));
  if (o.density_cell && !(*o.density_cell > 0 && std::isfinite(*o.density_cell)))
    throw Error(fmt::format("density cell {}: it must be positive", *o.density_cell));
  if (o.density_radius && !(*o.density_radius > 0 && std::isfinite(*o.density_radius)))
    throw Error(fmt::format("density radius {}: it must be positive", *o.density_radius));
}

void check_mesh_output(const std::string& mesh_file) { check_mesh_path(mesh_file); }

void check_density_output(const std::string& density_file) {
  require_vdb();
  if (to_lower(std::filesystem::path(density_file).extension().string()) != ".vdb")
    throw Error(fmt::format("{}: a density is written as .vdb", density_file));
  check_writable(density_file);
}

MeshReport mesh_file(const std::string& particle_file, const std::string& mesh_file, const MeshOptions& options,
                     const RenderHooks& hooks) {
  check_mesh_options(options);
  check_mesh_output(mesh_file);
  if (!options.density_file.empty()) check_density_output(options.density_file);
  MeshWork work{options, hooks, {}, {}, {}, {}, {}, {}, {}};
  run_on_threads(options.threads, [&] {
    work.read(particle_file);
    work.make_mesh();
    if (!options.density_file.empty()) work.make_density();
    work.write(mesh_file);
  });
  work.report.cpu_seconds = cpu_seconds();
  work.report.peak_memory_bytes = peak_memory_bytes();
  return work.report;
}

std::string to_text(const MeshReport& r) {
  std::string text;
  text +=
      fmt::format("  particles  {}{}, radius {:.6g} m ({}), spacing {:.6g} m\n", r.particles,
                  r.dropped > 0 ? fmt::format(" ({} left out)", r.dropped) : "", r.radius, r.radius_source, r.spacing);
  text += fmt::format("  surface    threshold {:.6g}, influence radius {:.6g} m, {} particles recovered\n", r.threshold,
                      r.influence_radius, r.recovered);
  text += fmt::format("  mesh       {} triangles, {} vertices, {} closed pieces, from cells of {:.6g} m\n", r.triangles,
                      r.vertices, r.components, r.cell);
  if (r.density_voxels > 0)
    text += fmt::format("  density    {} voxels of {:.6g} m, {:.6g} m3 of fluid at rest density, in {:.2f} s\n",
                        r.density_voxels, r.density_cell, r.density_integral, r.density_seconds);
  text += fmt::format("  bounds     {:.6g},{:.6g},{:.6g} to {:.6g},{:.6g},{:.6g} m; volume {:.6g} m3, area {:.6g} m2\n",
                      r.low[0], r.low[1], r.low[2], r.high[0], r.high[1], r.high[2], r.volume, r.area);
  text += fmt::format(
      "  time       read {:.2f} s, measure {:.2f}, sample the field {:.2f}, extract {:.2f}, write {:.2f}; CPU {:.2f} "
      "s\n",
      r.read_seconds, r.measure_seconds, r.sample_seconds, r.extract_seconds, r.write_seconds, r.cpu_seconds);
  text += fmt::format("  machine    {} threads, {}, {:.0f} MB at most\n", r.threads, r.instruction_set,
                      r.peak_memory_bytes / 1e6);
  for (const std::string& note : r.notes) text += fmt::format("  note       {}\n", note);
  return text;
}

std::string to_json(const MeshReport& r) {
  using Json = nlohmann::ordered_json;
  Json json;
  json["version"] = r.version;
  json["input"] = r.input;
  json["format"] = r.format;
  json["machine"] = {{"threads", r.threads},
                     {"instruction_set", r.instruction_set},
                     {"peak_memory_bytes", std::llround(r.peak_memory_bytes)}};
  json["seconds"] = {{"read", r.read_seconds},       {"measure", r.measure_seconds}, {"sample", r.sample_seconds},
                     {"extract", r.extract_seconds}, {"density", r.density_seconds}, {"write", r.write_seconds},
                     {"cpu", r.cpu_seconds}};
  json["particles"] = {{"count", r.particles},
                       {"dropped", r.dropped},
                       {"recovered", r.recovered},
                       {"radius", r.radius},
                       {"radius_source", r.radius_source},
                       {"spacing", r.spacing > 0 ? Json(r.spacing) : Json()},
                       {"threshold", r.threshold},
                       {"influence_radius", r.influence_radius}};
  json["mesh"] = {{"cell", r.cell}, {"vertices", r.vertices}, {"triangles", r.triangles}, {"components", r.components},
                  {"low", r.low},   {"high", r.high},         {"volume", r.volume},       {"area", r.area}};
  if (r.density_seconds > 0)
    json["density"] = {{"cell", r.density_cell}, {"voxels", r.density_voxels}, {"integral", r.density_integral}};
  json["notes"] = r.notes;
  return json.dump(2) + "\n";
}

}  // namespace embrun

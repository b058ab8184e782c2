#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/instruction_set.h"
#include "embrun/embrun.h"
#include "io/read_particles.h"
#include "io/write_mesh.h"
#include "meshing/isosurface.h"
#include "render/default_scene.h"
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
  Vec3d low = positions.front(), high = low;
  for (const Vec3d& p : positions) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return 0.5 * (low + high);
}

void record_particles(const MeasuredParticles& measured, MeshReport& report) {
  report.particles = measured.particles.size();
  report.radius = measured.radius.radius;
  report.radius_source = to_string(measured.radius.source);
  report.spacing = measured.spacing.spacing;
  report.notes = measured.particles.notes;
}

void record_model(const SurfaceModel& model, MeshReport& report) {
  report.recovered = model.recovered.size();
  report.threshold = static_cast<double>(model.threshold);
  report.influence_radius = static_cast<double>(model.influence_radius);
}

void record_mesh(const TriangleMesh& mesh, Vec3d origin, MeshReport& report) {
  report.vertices = mesh.positions.size();
  report.triangles = mesh.triangles.size();
  report.components = component_count(mesh);
  report.volume = enclosed_volume(mesh);
  report.area = surface_area(mesh);
  Box3 box;
  for (const Vec3& p : mesh.positions) box.include(p);
  report.low = to_point(origin + to_double(box.low));
  report.high = to_point(origin + to_double(box.high));
}

}  // namespace

void check_mesh_options(const MeshOptions& o) {
  check_options(render_options(o));
  if (o.cell && !(*o.cell > 0 && std::isfinite(*o.cell)))
    throw Error(fmt::format("cell {}: it must be positive", *o.cell));
}

void check_mesh_output(const std::string& mesh_file) { check_mesh_path(mesh_file); }

MeshReport mesh_file(const std::string& particle_file, const std::string& mesh_file, const MeshOptions& options,
                     const RenderHooks& hooks) {
  check_mesh_options(options);
  check_mesh_output(mesh_file);
  MeshReport report;
  report.version = version();
  report.instruction_set = name_of(instruction_set());
  report.threads = thread_count(options.threads);
  report.input = particle_file;

  const Stopwatch reading;
  tell(hooks, "reading", 0, 0);
  ParticleSet particles = read_particles(particle_file);
  report.format = particles.format;
  report.dropped = particles.dropped_non_finite;
  report.read_seconds = reading.seconds();
  tell(hooks, "reading", 1, report.read_seconds);

  const Stopwatch meshing;
  tell(hooks, "meshing", 0, 0);
  TriangleMesh mesh;
  Vec3d origin;
  run_on_threads(options.threads, [&] {
    const std::size_t read = particles.size();
    const RenderOptions surface_options = render_options(options);
    const MeasuredParticles measured = measure(std::move(particles), surface_options, particle_file);
    check_extent(measured.particles, measured.radius.radius, particle_file);
    record_particles(measured, report);
    report.dropped += read - measured.particles.size();

    // Single precision is enough about the particles' middle.
    origin = middle_of(measured.particles.positions);
    std::vector<Vec3> positions;
    positions.reserve(measured.particles.size());
    for (const Vec3d& p : measured.particles.positions) positions.push_back(to_float(p - origin));
    const std::vector<float>& radii = measured.radius.radii;
    const SurfaceModel model = resolve_surface_model(positions, radii, surface_settings(measured, surface_options));
    record_model(model, report);
    report.measure_seconds = meshing.seconds();

    IsosurfaceSettings settings;
    report.cell = options.cell.value_or(0.5 * report.radius);
    settings.cell = static_cast<float>(report.cell);
    settings.progress = [&](double fraction) { tell(hooks, "meshing", fraction, meshing.seconds()); };
    IsosurfaceStats stats;
    mesh = extract_isosurface(positions, radii, model, settings, &stats);
    report.sample_seconds = stats.sampling_seconds;
    report.extract_seconds = stats.extraction_seconds;
  });
  record_mesh(mesh, origin, report);
  tell(hooks, "meshing", 1, meshing.seconds());

  const Stopwatch writing;
  tell(hooks, "writing", 0, 0);
  const std::string made_by = fmt::format("Embrun {}", version());
  write_mesh(mesh_file, mesh,
             {origin, 1e-3f * static_cast<float>(report.cell),
              options.command.empty() ? made_by : made_by + ": " + options.command});
  report.write_seconds = writing.seconds();
  tell(hooks, "writing", 1, report.write_seconds);
  report.cpu_seconds = cpu_seconds();
  report.peak_memory_bytes = peak_memory_bytes();
  return report;
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
                     {"extract", r.extract_seconds}, {"write", r.write_seconds},     {"cpu", r.cpu_seconds}};
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
  json["notes"] = r.notes;
  return json.dump(2) + "\n";
}

}  // namespace embrun

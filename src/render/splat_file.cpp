#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/error.h"
#include "embrun/embrun.h"
#include "io/atomic_file.h"
#include "io/read_particles.h"
#include "io/text.h"
#include "render/cloud_options.h"
#include "render/option_names.h"
#include "render/render_loop.h"
#include "render/splat_building.h"
#include "render/stopwatch.h"

namespace embrun {
namespace {

constexpr std::uint64_t most_held_points = 4'000'000;

/// What make_splats() made, as points that need nothing more.
ParticleSet points_of(SplatCloud cloud) {
  ParticleSet points;
  points.positions = std::move(cloud.particles.positions);
  Attribute normal, radius;
  normal.name = "normal";
  normal.components = 3;
  for (const Vec3& n : cloud.normals) normal.floats.insert(normal.floats.end(), {n.x, n.y, n.z});
  radius.name = "radius";
  radius.floats = std::move(cloud.radii);
  points.attributes = {std::move(normal), std::move(radius)};
  if (const Attribute* color = cloud.particles.find("color"); color != nullptr && !cloud.colours.empty())
    points.attributes.push_back(*color);
  return points;
}

/// What of the options asks for more than a file that is read in pieces can give, or null.
const char* not_in_pieces(const CloudOptions& cloud) {
  if (cloud.normals == "estimate" || cloud.neighbours) return "normals are not estimated";
  if (cloud.thin > 0) return "points are not thinned";
  return nullptr;
}

/// A file of splats in the making.
struct SplatWork {
  const SplatFileOptions& options;
  const RenderHooks& hooks;
  SplatFileReport report;
  SplatBuildOptions build;
  std::unique_ptr<PointStream> stream;

  void open(const std::string& point_file);
  void make_in_memory(const std::string& point_file);
  void write(const std::string& point_file, const std::string& splat_file);
};

void SplatWork::open(const std::string& point_file) {
  report.version = version();
  report.threads = thread_count(options.threads);
  report.input = point_file;
  build.splats = splat_options(options.cloud);
  stream = open_point_stream(point_file);
  report.streamed = stream != nullptr && (options.stream || stream->count() > most_held_points);
  if (options.stream && stream == nullptr)
    throw Error(fmt::format("{}: only binary PLY files that begin with their vertices are read in pieces", point_file));
  if (!report.streamed) {
    make_in_memory(point_file);
    return;
  }
  if (const char* why = not_in_pieces(options.cloud))
    throw Error(fmt::format("{}: of a file that is read in pieces {}", point_file, why));
}

void SplatWork::make_in_memory(const std::string& point_file) {
  const Stopwatch watch;
  tell(hooks, "reading", 0, 0);
  ParticleSet particles = read_particles(point_file);
  report.dropped = particles.dropped_non_finite;
  report.notes = particles.notes;
  SplatCloud cloud = make_splats(std::move(particles), build.splats, point_file);
  report.dropped += cloud.report.points_in - cloud.size();
  report.radius_source = to_string(cloud.report.radius);
  // From here on all is decided.
  build.splats = {};
  build.splats.closed = cloud.closed;
  build.splats.keep_duplicates = true;
  stream = stream_of(points_of(std::move(cloud)));
  report.read_seconds = watch.seconds();
  tell(hooks, "reading", 1, report.read_seconds);
}

void SplatWork::write(const std::string& point_file, const std::string& splat_file) {
  const Stopwatch watch;
  build.memory = static_cast<std::uint64_t>(options.memory * std::ldexp(1.0, 30));
  const std::filesystem::path folder = std::filesystem::path(splat_file).parent_path();
  build.scratch = folder.empty() ? std::filesystem::path(".") : folder;
  if (!options.scratch.empty()) build.scratch = options.scratch;
  SplatBuildReport built;
  stream_file_atomically(splat_file, [&](const ByteSink& sink) {
    built = write_splats_of(*stream, build, point_file, sink,
                            [&](const char* stage, double fraction) { tell(hooks, stage, fraction, watch.seconds()); });
  });
  report.points = built.points;
  report.dropped += built.dropped;
  report.splats = built.splats;
  report.nodes = built.nodes;
  report.bricks = built.bricks;
  report.runs = built.runs;
  report.sort_seconds = built.sort_seconds;
  report.build_seconds = built.build_seconds;
  report.least_radius = built.least_radius;
  report.median_radius = built.median_radius;
  report.greatest_radius = built.greatest_radius;
  if (report.radius_source.empty())
    report.radius_source = build.splats.radius ? "given" : built.estimated_radii ? "spacing" : "file";
  report.closed = built.closed;
  report.has_colors = built.has_colors;
  report.file_bytes = std::filesystem::file_size(splat_file);
  if (built.duplicates > 0)
    report.notes.push_back(fmt::format("{} points in the place of another were left out", built.duplicates));
  if (const std::uint64_t useless = built.points - built.duplicates - built.splats; useless > 0)
    report.notes.push_back(fmt::format("{} points without a usable radius were left out", useless));
  if (report.streamed && build.splats.outlier_ratio > 0)
    report.notes.push_back("read in pieces: outliers were not looked for");
}

}  // namespace

void check_splat_file_options(const SplatFileOptions& options) {
  splat_options(options.cloud);
  if (surface_from_name(options.cloud.points) == std::optional<bool>(false))
    throw Error("points \"fluid\": splats are of surfaces");
  if (ellipses_from_name(options.cloud.splat_shape))
    throw Error("shape of splats \"ellipse\": a file of splats holds discs alone");
  if (!(options.memory >= 0.001 && options.memory <= 1e6))
    throw Error(fmt::format("memory of {} GiB: it must lie between 0.001 and a million", options.memory));
  if (options.threads < 0) throw Error(fmt::format("{} threads: give 1 or more, or 0 for all", options.threads));
}

void check_splat_output(const std::string& splat_file) {
  if (to_lower(std::filesystem::path(splat_file).extension().string()) != ".splats")
    throw Error(fmt::format("{}: splats are written as .splats", splat_file));
  check_writable(splat_file);
}

SplatFileReport splat_file(const std::string& point_file, const std::string& splat_file,
                           const SplatFileOptions& options, const RenderHooks& hooks) {
  check_splat_file_options(options);
  check_splat_output(splat_file);
  SplatWork work{options, hooks, {}, {}, nullptr};
  run_on_threads(options.threads, [&] {
    work.open(point_file);
    work.write(point_file, splat_file);
  });
  work.report.cpu_seconds = cpu_seconds();
  work.report.peak_memory_bytes = peak_memory_bytes();
  return work.report;
}

std::string to_text(const SplatFileReport& r) {
  std::string text =
      fmt::format("  splats     {}{}, radius {:.6g} m (median; {:.6g} to {:.6g}), {}; {}{}\n", r.splats,
                  r.dropped > 0 ? fmt::format(" ({} points left out)", r.dropped) : "", r.median_radius, r.least_radius,
                  r.greatest_radius, r.radius_source == "spacing" ? "from the spacing" : r.radius_source,
                  r.closed ? "closed" : "open", r.has_colors ? ", with colours" : "");
  text += fmt::format("  levels     {} nodes in {} bricks; {:.1f} MB, {:.1f} bytes a splat\n", r.nodes, r.bricks,
                      static_cast<double>(r.file_bytes) / 1e6,
                      static_cast<double>(r.file_bytes) / static_cast<double>(std::max<std::uint64_t>(r.splats, 1)));
  text += fmt::format("  time       {:.2f} s: read {:.2f}, sort {:.2f}, build {:.2f}; CPU {:.2f} s\n",
                      r.read_seconds + r.sort_seconds + r.build_seconds, r.read_seconds, r.sort_seconds,
                      r.build_seconds, r.cpu_seconds);
  text += fmt::format("  machine    {} threads, {:.0f} MB at most{}\n", r.threads, r.peak_memory_bytes / 1e6,
                      r.runs > 0 ? fmt::format("; sorted in {} runs", r.runs) : "");
  for (const std::string& note : r.notes) text += fmt::format("  note       {}\n", note);
  return text;
}

std::string to_json(const SplatFileReport& r) {
  const nlohmann::ordered_json json = {
      {"version", r.version},
      {"input", r.input},
      {"streamed", r.streamed},
      {"points", r.points},
      {"dropped", r.dropped},
      {"splats", r.splats},
      {"nodes", r.nodes},
      {"bricks", r.bricks},
      {"runs", r.runs},
      {"file_bytes", r.file_bytes},
      {"radius",
       {{"source", r.radius_source}, {"min", r.least_radius}, {"median", r.median_radius}, {"max", r.greatest_radius}}},
      {"closed", r.closed},
      {"colors", r.has_colors},
      {"seconds",
       {{"read", r.read_seconds}, {"sort", r.sort_seconds}, {"build", r.build_seconds}, {"cpu", r.cpu_seconds}}},
      {"threads", r.threads},
      {"peak_memory_bytes", r.peak_memory_bytes},
      {"notes", r.notes}};
  return json.dump(2) + "\n";
}

}  // namespace embrun

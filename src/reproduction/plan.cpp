#include "reproduction/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace embrun {
namespace {

/// The thesis: at most eight bounces.
constexpr int bounces = 8;
/// Not told by the thesis: a mean free path of 12 cm, a third of the depth of the water at rest.
constexpr float extinction = 8, albedo = 0.99f;

std::string color(const Color& c) { return fmt::format("{:g},{:g},{:g}", c[0], c[1], c[2]); }
std::string point(const Point& p) { return fmt::format("{:g},{:g},{:g}", p[0], p[1], p[2]); }

const char* words(Way way) {
  switch (way) {
    case Way::direct: return "direct";
    case Way::mesh: return "mesh";
    case Way::thesis: return "thesis";
  }
  return "";
}

}  // namespace

std::vector<Row> table_rows() {
  std::vector<Row> rows;
  for (const int view : {1, 2}) {
    for (const int order : {1, 2, 3, 4}) rows.push_back({view, order, -1, false, false});
    for (const int refractions : {1, 2}) rows.push_back({view, 3, refractions, false, false});
    rows.push_back({view, 3, -1, true, false});
    rows.push_back({view, 3, -1, false, true});
  }
  return rows;
}

Scale scale_of(const ReproduceOptions& o) {
  Scale scale;
  const auto size = o.size.value_or(o.quick ? std::array<int, 2>{192, 144} : std::array<int, 2>{768, 574});
  scale.width = size[0];
  scale.height = size[1];
  scale.samples = o.samples.value_or(o.quick ? 8 : 128);
  scale.thesis_samples = o.thesis_samples.value_or(2);
  return scale;
}

PictureSpec picture_of(const Row& row, Way way, const std::string& particles, const ReproduceOptions& options) {
  const Scale scale = scale_of(options);
  PictureSpec spec;
  spec.name = fmt::format("view{}-n{}-{}{}{}-{}", row.view, row.order,
                          row.refractions < 0 ? "all" : fmt::format("{}", row.refractions), row.volume ? "-volume" : "",
                          row.gradient ? "-gradient" : "", words(way));
  spec.what = fmt::format("view {}, n = {}{}{}{}, {}", row.view, row.order,
                          row.refractions < 0 ? "" : fmt::format(", refractions {}", row.refractions),
                          row.volume ? ", volume" : "", row.gradient ? ", gradient normals" : "", words(way));
  spec.particles = particles;
  spec.samples = way == Way::thesis ? scale.thesis_samples : scale.samples;
  RenderOptions& o = spec.options;
  o.width = scale.width;
  o.height = scale.height;
  if (way == Way::thesis) {  // in minutes instead of days: its time goes with the paths
    o.width = std::max(1, o.width / thesis_shrink);
    o.height = std::max(1, o.height / thesis_shrink);
  }
  o.threads = options.threads;
  o.max_depth = bounces;
  o.radius = options.radius;
  o.view = row.view == 1 ? "front" : "three-quarter";
  o.order = row.order;
  o.refractions = row.refractions;
  if (row.gradient) o.normal = "gradient";
  if (row.volume) {
    o.extinction = Color{extinction, extinction, extinction};
    o.albedo = {albedo, albedo, albedo};
  }
  if (way == Way::mesh) o.representation = "mesh";
  if (way == Way::thesis) o.method = "thesis";
  return spec;
}

std::string flags_of(const RenderOptions& o) {
  std::string flags = fmt::format("--size {}x{} --max-depth {} --order {}", o.width, o.height, o.max_depth, o.order);
  if (o.radius) flags += fmt::format(" --radius {:g}", *o.radius);
  if (o.camera_from) {
    flags +=
        fmt::format(" --camera-from={} --camera-to={}", point(*o.camera_from), point(o.camera_to.value_or(Point{})));
    if (o.fov) flags += fmt::format(" --fov {:g}", *o.fov);
  } else {
    flags += " --view " + o.view;
  }
  if (o.refractions >= 0) flags += fmt::format(" --refractions {}", o.refractions);
  if (o.normal != "weighted") flags += " --normal " + o.normal;
  if (o.extinction) flags += fmt::format(" --extinction {} --albedo {}", color(*o.extinction), color(o.albedo));
  if (o.density_radius) flags += fmt::format(" --density-radius {:g}", *o.density_radius);
  if (o.representation != "direct") flags += " --representation " + o.representation;
  if (o.method != "fast") flags += " --method " + o.method;
  if (o.container) {
    const auto& c = *o.container;
    flags += fmt::format(" --container={:g},{:g},{:g},{:g},{:g},{:g}", c[0], c[1], c[2], c[3], c[4], c[5]);
  }
  if (o.tank) flags += fmt::format(" --tank {:g}", *o.tank);
  for (const FluidOptions& fluid : o.fluids) {
    flags += " --fluid " + fluid.file;
    if (fluid.extinction) flags += ":extinction=" + color(*fluid.extinction);
    if (fluid.albedo) flags += ":albedo=" + color(*fluid.albedo);
  }
  for (const auto& [flag, files] : {std::pair{"--foam", &o.foam}, std::pair{"--bubbles", &o.bubbles},
                                    std::pair{"--sand", &o.sand}, std::pair{"--spray", &o.spray}})
    for (const std::string& file : *files) flags += fmt::format(" {} {}", flag, file);
  return flags;
}

std::optional<std::string> find_particles(const std::string& folder, const std::string& name) {
  for (const char* extension : {".bgeo", ".ply", ".vtk", ".xyz", ".csv"}) {
    const std::filesystem::path path = std::filesystem::path(folder) / (name + extension);
    std::error_code none;
    if (std::filesystem::is_regular_file(path, none)) return path.string();
  }
  return std::nullopt;
}

}  // namespace embrun

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "embrun/reproduce.h"
#include "image/line_chart.h"
#include "io/image_write.h"
#include "io/read_particles.h"
#include "measure/splat_bench.h"
#include "particles/splat_cloud.h"
#include "render/render_loop.h"
#include "reproduction/output.h"
#include "reproduction/quadrature.h"
#include "reproduction/sphere_splats.h"

namespace embrun {
namespace {

namespace fs = std::filesystem;

/// A cloud of figure 28, and what the thesis tells of it.
struct ThesisCloud {
  const char* name;
  const char* file;  ///< null: it is generated
  const char* what;
  double ratio;         ///< all accelerations over none
  double sphere_share;  ///< of it due to bounding spheres
  bool mirror;
};

constexpr ThesisCloud clouds[] = {
    {"sphere", nullptr, "the mirror sphere of 2,562 splats, made here", 33, 0.82, true},
    {"bunny", "bunny_35947.ply", "the bunny (the thesis's has 35,945 points)", 600, 0.91, false},
    {"rabbit", "igea_70658.ply", "a head of as many points as the thesis's rabbit has", 656, 0.80, false}};

/// Ways of search that are measured besides the eight of the thesis.
struct OtherSearch {
  const char* what;
  SplatSearchKind kind;
};
constexpr OtherSearch others[] = {{"every splat, 8 lanes at a time", SplatSearchKind::blocks},
                                  {"Embree's oriented discs, one query", SplatSearchKind::embree},
                                  {"Embree's oriented discs, the nearest first", SplatSearchKind::embree_nearest},
                                  {"the tree (what users get)", SplatSearchKind::tree}};

struct CloudResult {
  const ThesisCloud* cloud = nullptr;
  std::size_t splats = 0, rays = 0;
  float least_radius = infinity, greatest_radius = 0;
  bool closed = false;
  double tree_seconds = 0, hits = 0;
  double thesis_ns[8] = {};  ///< by bits: 1 spheres, 2 grid, 4 early outs
  double other_ns[std::size(others)] = {};
  double differ = 0;  ///< share of rays on which any search found something else
  double changed = 0, removed = 0;

  double plain() const { return thesis_ns[0]; }
  double tree() const { return other_ns[std::size(others) - 1]; }
  double embree() const { return std::min(other_ns[1], other_ns[2]); }
};

SplatSearchChoice thesis_choice(int bits) {
  return {SplatSearchKind::thesis, (bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0};
}

/// A scan's splats as users get them.
std::vector<Splat> scan_splats(const std::string& path, bool& closed) {
  const SplatCloud cloud = make_splats(read_particles(path), {}, path);
  closed = cloud.closed;
  const Vec3d origin = cloud.particles.positions.front();
  std::vector<Splat> splats;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    splats.push_back({to_float(cloud.particles.positions[i] - origin), cloud.radii[i], cloud.normals[i], {}});
  return splats;
}

class SplatRun {
 public:
  SplatRun(const ReproduceSplatsOptions& options, const ReproduceHooks& hooks)
      : options_(options), hooks_(hooks), folder_(options.folder) {}

  ReproduceReport go();

 private:
  const ReproduceSplatsOptions& options_;
  const ReproduceHooks& hooks_;
  fs::path folder_;
  std::vector<CloudResult> results_;
  std::vector<std::string> missing_;
  std::string quadrature_;  ///< the section of it

  /// The clouds, and the comparison of quadrature and chance.
  static constexpr int steps = static_cast<int>(std::size(clouds)) + 1;

  bool cancelled() const { return hooks_.render.cancel != nullptr && hooks_.render.cancel->load(); }
  std::string scan_of(const ThesisCloud& cloud) const;
  bool measure(const ThesisCloud& cloud, int number);
  bool compare_integrators();
  std::string table(const CloudResult& r) const;
  std::string document() const;
  void write_chart() const;
};

/// The file, or empty where there is none in the folder of the data.
std::string SplatRun::scan_of(const ThesisCloud& cloud) const {
  const fs::path path = fs::path(options_.data) / cloud.file;
  return options_.data.empty() || !fs::exists(path) ? "" : path.string();
}

/// False: it was cancelled.
bool SplatRun::compare_integrators() {
  if (hooks_.step) hooks_.step("Gauss's quadrature beside path tracing", steps - 1, steps);
  const std::optional<std::string> section = compare_quadrature(options_, scan_of(clouds[1]), hooks_);
  quadrature_ = section.value_or("");
  return section.has_value();
}

/// False: it was cancelled.
bool SplatRun::measure(const ThesisCloud& cloud, int number) {
  CloudResult result;
  result.cloud = &cloud;
  std::vector<Splat> splats;
  if (cloud.file == nullptr) {
    splats = sphere_splats();
    result.closed = true;
  } else {
    const std::string scan = scan_of(cloud);
    if (scan.empty()) {
      missing_.push_back(cloud.file);
      return true;
    }
    splats = scan_splats(scan, result.closed);
  }
  const auto step = [&](const std::string& what) {
    if (hooks_.step) hooks_.step(fmt::format("{}: {}", cloud.name, what), number, steps);
    return !cancelled();
  };
  const SplatBench bench(splats, result.closed, options_.quick ? 128 : 512);
  result.splats = bench.splat_count();
  result.rays = bench.ray_count();
  for (const Splat& s : splats) {
    result.least_radius = std::min(result.least_radius, s.radius);
    result.greatest_radius = std::max(result.greatest_radius, s.radius);
  }
  result.tree_seconds = bench.tree_seconds();
  const double seconds = options_.quick ? 0.3 : 4;
  for (int bits = 0; bits < 8; ++bits) {
    if (!step(fmt::format("the thesis's accelerations, {} of 8", bits + 1))) return false;
    const SplatSearchTime time = bench.time(thesis_choice(bits), seconds);
    result.thesis_ns[bits] = time.ns_per_ray;
    result.differ = std::max(result.differ, bench.disagreement(thesis_choice(bits), options_.quick ? 100 : 500));
  }
  for (std::size_t i = 0; i < std::size(others); ++i) {
    if (!step(others[i].what)) return false;
    const SplatSearchTime time = bench.time({others[i].kind}, seconds);
    result.other_ns[i] = time.ns_per_ray;
    result.hits = time.hits;
    result.differ = std::max(result.differ, bench.disagreement({others[i].kind}, 20000));
  }
  write_image((folder_ / fmt::format("figure-28-{}.png", cloud.name)).string(),
              bench.picture(SplatRules::resolve, cloud.mirror, result.closed));
  const SplatRulesDifference rules = compare_splat_rules(bench);
  result.changed = rules.changed;
  result.removed = rules.removed;
  const std::pair<const char*, const Image*> parts[] = {
      {"a", &rules.without}, {"b", &rules.with}, {"c", &rules.difference}};
  for (const auto& [part, image] : parts)
    write_image((folder_ / fmt::format("figure-33{}-{}.png", part, cloud.name)).string(), *image);
  results_.push_back(result);
  return true;
}

std::string time_of(double ns) {
  return ns < 1e4   ? fmt::format("{:.0f} ns", ns)
         : ns < 1e7 ? fmt::format("{:.1f} us", ns / 1e3)
                    : fmt::format("{:.1f} ms", ns / 1e6);
}

std::string SplatRun::table(const CloudResult& r) const {
  std::string text = fmt::format(
      "## {}\n\n{}: {} splats of radii {:.3g} to {:.3g}, {}. {} rays of the picture meet the box round it, {:.0f} % of "
      "them the "
      "surface. The tree was built in {:.3f} s.\n\n",
      r.cloud->name, r.cloud->what, r.splats, r.least_radius, r.greatest_radius,
      r.closed ? "a closed cloud (both phases)" : "an open cloud (the near phase alone)", r.rays, 100 * r.hits,
      r.tree_seconds);
  text += table_head({"spheres", "grid", "early outs", "a ray", "a disc", "faster than none"});
  for (int bits = 0; bits < 8; ++bits) {
    const auto mark = [&](int bit) { return std::string((bits & bit) != 0 ? "on" : "-"); };
    // Where a grid is, not every disc is tested.
    const std::string per_disc =
        (bits & 2) != 0 ? "-" : fmt::format("{:.2f} ns", r.thesis_ns[bits] / static_cast<double>(r.splats));
    text += table_row({mark(1), mark(2), mark(4), time_of(r.thesis_ns[bits]), per_disc,
                       fmt::format("{:.3g}", r.plain() / r.thesis_ns[bits])});
  }
  for (std::size_t i = 0; i < std::size(others); ++i) {
    const std::string per_disc = others[i].kind == SplatSearchKind::blocks
                                     ? fmt::format("{:.2f} ns", r.other_ns[i] / static_cast<double>(r.splats))
                                     : "-";
    text += table_row(
        {others[i].what, "", "", time_of(r.other_ns[i]), per_disc, fmt::format("{:.3g}", r.plain() / r.other_ns[i])});
  }
  // The share of an acceleration: of the logarithm of the whole gain, what is lost where it alone is off.
  const double whole = std::log(r.plain() / r.thesis_ns[7]);
  const auto share = [&](int bit) { return 100 * std::log(r.thesis_ns[7 & ~bit] / r.thesis_ns[7]) / whole; };
  const auto alone = [&](int bit) { return r.plain() / r.thesis_ns[bit]; };
  text += fmt::format(
      "\nThe thesis's three together are {:.3g} times as fast as none (the thesis: {:g}); the tree is {:.3g} times as "
      "fast as "
      "none, and {:.2f} times as fast as the better of Embree's ways. Alone, spheres gain {:.3g}, the grid {:.3g}, "
      "early "
      "outs {:.3g}; of the whole gain (its logarithm) {:.0f} %, {:.0f} % and {:.0f} % are lost without each. The "
      "thesis has "
      "{:.0f} % due to the spheres: its test of a disc costs more than ours beside that of a sphere, it seems, and it "
      "does not "
      "say how the share is counted. On {:.2g} % of rays at most some search found something else than the tree.\n\n",
      r.plain() / r.thesis_ns[7], r.cloud->ratio, r.plain() / r.tree(), r.embree() / r.tree(), alone(1), alone(2),
      alone(4), share(1), share(2), share(4), 100 * r.cloud->sphere_share, 100 * r.differ);
  return text;
}

std::string SplatRun::document() const {
  std::string text = "# Chapter 2 of the thesis: splats\n\n";
  text += fmt::format(
      "Made by `{}`. All times are of one thread and of rays that meet the box round the cloud, so that none "
      "is spared by it: the least of three times.\n\n",
      options_.command);
  for (const std::string& file : missing_)
    text += fmt::format("- **{} is not in the folder of the data: its cloud was left out.**\n", file);
  if (!missing_.empty()) text += "\n";
  text += "## Figure 29: what the accelerations gain\n\n";
  text += table_head({"cloud", "splats", "plain loop", "its ns per disc", "8 lanes: ns per disc", "thesis's three",
                      "thesis says", "tree", "Embree / tree"});
  for (const CloudResult& r : results_) {
    const auto n = static_cast<double>(r.splats);
    text += table_row({r.cloud->name, std::to_string(r.splats), time_of(r.plain()),
                       fmt::format("{:.2f}", r.plain() / n), fmt::format("{:.2f}", r.other_ns[0] / n),
                       fmt::format("{:.3g}x", r.plain() / r.thesis_ns[7]), fmt::format("{:g}x", r.cloud->ratio),
                       fmt::format("{:.3g}x", r.plain() / r.tree()), fmt::format("{:.2f}", r.embree() / r.tree())});
  }
  text +=
      "\n![Figure 29: the time of a ray with the thesis's accelerations on and off, with the tree and with "
      "Embree.](figure-29.svg)\n\n";
  for (const CloudResult& r : results_) text += table(r);
  text += "## Figures 28 and 33\n\n";
  for (const CloudResult& r : results_) {
    const char* name = r.cloud->name;
    text += fmt::format("![Figure 28: {0}.](figure-28-{0}.png)\n\n", name);
    text += fmt::format(
        "![Figure 33a: the first hit.](figure-33a-{0}.png) ![Figure 33b: both phases.](figure-33b-{0}.png) ![Figure "
        "33c: their "
        "difference.](figure-33c-{0}.png)\n\nFigure 33 for the {0}: the rules change {1:.2f} % of the pixels that show "
        "it "
        "(by more than 0.02) and take {2:.2f} % from its silhouette.\n\n",
        name, 100 * r.changed, 100 * r.removed);
  }
  return text + quadrature_;
}

void SplatRun::write_chart() const {
  LineChart chart;
  chart.title = "Figure 29: time of a ray";
  chart.x.label = "none, spheres, grid, both, with early outs: the same four; Embree, tree";
  chart.x.low = 0.5;
  chart.x.high = 10.5;
  chart.y.label = "nanoseconds";
  chart.y.logarithmic = true;
  for (const CloudResult& r : results_) {
    ChartSeries series;
    series.name = r.cloud->name;
    series.markers = true;
    for (int bits = 0; bits < 8; ++bits) {
      series.x.push_back(bits + 1);
      series.y.push_back(r.thesis_ns[bits]);
    }
    series.x.insert(series.x.end(), {9.0, 10.0});
    series.y.insert(series.y.end(), {r.embree(), r.tree()});
    chart.series.push_back(series);
  }
  write_text_file((folder_ / "figure-29.svg").string(), to_svg(chart));
}

ReproduceReport SplatRun::go() {
  make_folder(folder_);
  if (!options_.data.empty() && !fs::is_directory(options_.data))
    throw Error(fmt::format("{}: there is no such folder of scans", options_.data));
  ReproduceReport report;
  bool done = true;
  for (std::size_t i = 0; i < std::size(clouds) && done; ++i) done = measure(clouds[i], static_cast<int>(i));
  if (!done || !compare_integrators()) {
    report.cancelled = true;
    return report;
  }
  report.rendered = static_cast<int>(results_.size());
  write_chart();
  report.document = (folder_ / "splats.md").string();
  write_text_file(report.document, document());
  return report;
}

}  // namespace

ReproduceReport reproduce_splats(const ReproduceSplatsOptions& options, const ReproduceHooks& hooks) {
  ReproduceReport report;
  run_on_threads(options.threads, [&] { report = SplatRun(options, hooks).go(); });
  return report;
}

}  // namespace embrun

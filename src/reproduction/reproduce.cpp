#include "embrun/reproduce.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "base/error.h"
#include "io/image_write.h"
#include "io/read_particles.h"
#include "reproduction/document.h"
#include "reproduction/output.h"
#include "reproduction/showcase.h"

namespace embrun {
namespace {

namespace fs = std::filesystem;

/// Extinction of the curves of figure 50, that of the volume's pictures.
constexpr double curve_extinction = 8;

/// A run, step by step.
class Run {
 public:
  Run(const ReproduceOptions& options, const ReproduceHooks& hooks)
      : options_(options), hooks_(hooks), folder_(options.folder), store_(options, hooks) {}

  ReproduceReport go();

 private:
  void prepare();
  void render_rows();
  void compare();
  void measure_search();
  void draw_curves();
  void show_pictures();
  void render_showcase();

  void step(const std::string& what) {
    if (hooks_.render.cancel != nullptr && hooks_.render.cancel->load()) throw Interrupted{};
    if (hooks_.step) hooks_.step(what, done_, total_);
    ++done_;
  }
  PictureResult make(const PictureSpec& spec) {
    step(spec.what);
    return store_.make(spec);
  }
  void write_curve(const Curve& curve) const { write_text_file((folder_ / curve.file).string(), to_svg(curve.chart)); }
  void side_by_side(const std::string& file, const std::vector<std::string>& names, const std::string& caption);
  std::string name_of(const Row& row, Way way) const { return picture_of(row, way, water_, options_).name; }

  const ReproduceOptions& options_;
  const ReproduceHooks& hooks_;
  fs::path folder_;
  PictureStore store_;
  std::string water_;  // the dam break's file
  SizedParticles sized_;
  std::vector<PictureSpec> showcase_;
  Findings findings_;
  int done_ = 0, total_ = 0;
};

void Run::prepare() {
  const auto water = find_particles(options_.data, "dam_break");
  if (!water)
    throw Error(
        fmt::format("{}: there is no dam_break.bgeo (nor .ply, .vtk, .xyz, .csv); give the folder of the sample data",
                    options_.data));
  water_ = *water;
  for (const char* part : {"renders", "figures", "picked"}) make_folder(folder_ / part);
  sized_ = size_particles(read_particles(water_), options_.radius, water_);
  showcase_ = showcase_pictures(options_, (folder_ / "picked").string(), findings_.notes);
  total_ = 2 * static_cast<int>(table_rows().size()) + 1 + static_cast<int>(showcase_.size()) + 3;
}

void Run::render_rows() {
  for (const Row& row : table_rows()) {
    RowResult result;
    result.row = row;
    result.direct = make(picture_of(row, Way::direct, water_, options_));
    result.mesh = make(picture_of(row, Way::mesh, water_, options_));
    findings_.rows.push_back(std::move(result));
  }
  findings_.thesis = make(picture_of({2, 3, -1, false, false}, Way::thesis, water_, options_));
}

void Run::compare() {
  step("comparing");
  for (RowResult& result : findings_.rows) {
    const Row& row = result.row;
    const bool shown = row.order == 3 && row.refractions < 0;
    std::string difference;
    if (shown) {
      difference = fmt::format("figures/difference-view{}{}{}.png", row.view, row.volume ? "-volume" : "",
                               row.gradient ? "-gradient" : "");
      findings_.pictures.push_back(
          {difference, fmt::format("Differences of direct and mesh, view {}{}: root mean square of display values, the "
                                   "brightest colour is {:g}.",
                                   row.view,
                                   row.volume     ? ", volume"
                                   : row.gradient ? ", gradient normals"
                                                  : "",
                                   difference_scale)});
    }
    result.difference = compare_pictures(store_, result.direct.name, result.mesh.name,
                                         difference.empty() ? "" : (folder_ / difference).string());
    if (!row.volume && !row.gradient)
      result.from_reference =
          compare_pictures(store_, result.direct.name, name_of({row.view, 3, -1, false, false}, Way::mesh));
  }
}

void Run::measure_search() {
  step("uniform grid and kd-tree");
  std::vector<Vec3> centers;
  for (const Vec3d& p : sized_.particles.positions) centers.push_back(to_float(p - sized_.particles.positions.front()));
  findings_.search =
      compare_ball_search(centers, static_cast<float>(sized_.radius.radius), options_.quick ? 20000 : 200000);
}

void Run::draw_curves() {
  step("curves");
  findings_.curves = depth_curves(sized_, curve_extinction);
  const double spacing = sized_.spacing.spacing > 0 ? sized_.spacing.spacing : 2 * sized_.radius.radius;
  for (Curve& curve : surface_curves(spacing / sized_.radius.radius)) findings_.curves.push_back(std::move(curve));
  std::vector<Curve> errors = error_curves(findings_);
  for (Curve& curve : findings_.curves) curve.file = "figures/" + curve.file;
  for (Curve& curve : errors) {
    curve.file = "figures/" + curve.file;
    write_curve(curve);
    findings_.errors.push_back({curve.file, curve.caption});
  }
  for (const Curve& curve : findings_.curves) write_curve(curve);
}

/// Joins pictures of the store, as far as they are there, with white between them.
void Run::side_by_side(const std::string& file, const std::vector<std::string>& names, const std::string& caption) {
  std::vector<Image> images;
  for (const std::string& name : names) images.push_back(store_.read(name));
  constexpr int gap = 6;
  const int width = images.front().width, height = images.front().height, count = static_cast<int>(images.size());
  Image joined = make_image(count * width + (count - 1) * gap, height, 3);
  std::fill(joined.pixels.begin(), joined.pixels.end(), 100.0f);
  for (int i = 0; i < count; ++i)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < 3; ++c)
          joined.at(i * (width + gap) + x, y, c) = images[static_cast<std::size_t>(i)].at(x, y, c);
  write_image(folder_ / file, joined);
  findings_.pictures.push_back({file, caption});
}

void Run::show_pictures() {
  const auto direct = [&](int view, int order, int refractions) {
    return name_of({view, order, refractions, false, false}, Way::direct);
  };
  const auto mesh = [&](int view) { return name_of({view, 3, -1, false, false}, Way::mesh); };
  side_by_side("figures/figure-62.png", {direct(2, 1, -1), direct(2, 2, -1), direct(2, 3, -1), mesh(2)},
               "Figure 62: the surface for n = 1, 2 and 3, and the mesh for n = 3 (view 2).");
  side_by_side("figures/figure-63.png", {direct(1, 3, 1), direct(1, 3, 2), direct(1, 3, -1), mesh(1)},
               "Figure 63: 1, 2 and all refractions, and the mesh with all (view 1).");
  side_by_side("figures/figure-64.png", {direct(2, 3, 1), direct(2, 3, 2), direct(2, 3, -1), mesh(2)},
               "Figure 64: 1, 2 and all refractions, and the mesh with all (view 2).");
  const Row volume{2, 3, -1, true, false};
  side_by_side("figures/figure-66.png", {name_of(volume, Way::direct), name_of(volume, Way::mesh)},
               "Figure 66: surface and volume, by particles and by mesh and grid (view 2).");
}

void Run::render_showcase() {
  for (const char* number : {"67", "68"}) {
    std::vector<std::string> names;
    std::string what;
    for (const PictureSpec& spec : showcase_) {
      if (spec.name.find(number) == std::string::npos) continue;
      const PictureResult made = make(spec);
      names.push_back(made.name);
      what += (what.empty() ? "" : "; ") + spec.what.substr(spec.what.find(number));
    }
    if (names.empty()) continue;
    side_by_side(
        fmt::format("figures/figure-{}.png", number), names,
        fmt::format("Figure {}: {}. Sand, and all that is in the calm pool and in the two fluids, is picked from the "
                    "water's particles.",
                    number, what));
  }
}

ReproduceReport Run::go() {
  ReproduceReport report;
  try {
    prepare();
    render_rows();
    // Before the rest of the pictures, which the tables do not need.
    show_pictures();
    compare();
    measure_search();
    draw_curves();
    render_showcase();
    const fs::path document = folder_ / "reproduction.md";
    write_text_file(document.string(), write_document(findings_, options_));
    report.document = document.string();
  } catch (const Interrupted&) {
    report.cancelled = true;
  }
  report.rendered = store_.rendered();
  report.kept = store_.kept();
  return report;
}

}  // namespace

void check_options(const ReproduceOptions& o) {
  if (o.folder.empty()) throw Error("there is no folder to write to");
  const Scale scale = scale_of(o);
  for (const int samples : {scale.samples, scale.thesis_samples})
    if (samples < 2 || samples % 2 != 0)
      throw Error(fmt::format("{} samples per pixel: give an even number, for two halves", samples));
  // FLIP and SSIM want some, and so do blocks of pixels.
  if (scale.width < 16 || scale.height < 16)
    throw Error(fmt::format("size {}x{}: give at least 16x16 pixels", scale.width, scale.height));
  check_options(picture_of({}, Way::direct, "", o).options);
}

ReproduceReport reproduce_dam_break(const ReproduceOptions& options, const ReproduceHooks& hooks) {
  check_options(options);
  return Run(options, hooks).go();
}

}  // namespace embrun

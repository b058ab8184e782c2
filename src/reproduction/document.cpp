#include "reproduction/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "reproduction/output.h"
#include "reproduction/thesis_figures.h"

namespace embrun {
namespace {

// ---- pieces ------------------------------------------------------------------------------------------------------

std::string seconds(double s) {
  if (s >= 60) return fmt::format("{:.0f} min {:02.0f} s", std::floor(s / 60), std::floor(s - 60 * std::floor(s / 60)));
  return s >= 10 ? fmt::format("{:.1f} s", s) : fmt::format("{:.2f} s", s);
}
std::string ratio(double a, double b) { return b > 0 ? fmt::format("{:.3g}", a / b) : "-"; }

/// In units of 1e-4, as the bars are told.
std::string error(double mse) { return fmt::format("{:.3g}", 1e4 * mse); }

double with_build(const PictureResult& r) { return r.build_seconds + r.render_seconds; }

/// Times and ratios of a row, as all tables have them.
const std::vector<std::string> time_columns{"direct: build", "render",        "mesh: build",
                                            "render",        "direct / mesh", "with the build"};
std::vector<std::string> time_cells(const RowResult& r) {
  return {seconds(r.direct.build_seconds),
          seconds(r.direct.render_seconds),
          seconds(r.mesh.build_seconds),
          seconds(r.mesh.render_seconds),
          ratio(r.direct.render_seconds, r.mesh.render_seconds),
          ratio(with_build(r.direct), with_build(r.mesh))};
}
std::vector<std::string> thesis_cells(double direct, double mesh) {
  if (!(direct > 0)) return {"-", "-", "-"};
  return {seconds(direct), seconds(mesh), ratio(direct, mesh)};
}
const std::vector<std::string> thesis_columns{"thesis: direct", "mesh", "ratio"};

std::vector<std::string> joined(std::initializer_list<std::vector<std::string>> lists) {
  std::vector<std::string> all;
  for (const auto& list : lists) all.insert(all.end(), list.begin(), list.end());
  return all;
}

const char* refractions_of(int count) { return count < 0 ? "all" : count == 1 ? "1" : "2"; }

// ---- sections ----------------------------------------------------------------------------------------------------

std::string introduction(const Findings& f, const ReproduceOptions& o) {
  const PictureResult& first = f.rows.front().direct;
  const Scale scale = scale_of(o);
  std::string text = "# The dam break of the thesis, again\n\n";
  text += fmt::format(
      "Chapter 5 of the thesis [Beddiaf2018] by Embrun {}{}. {} particles, R0 = {:.4g} m, rest spacing {:.4g} m; {}x{} "
      "pixels, {} samples, at most 8 bounces; {} threads, {}.{}\n\n",
      version(), o.command.empty() ? "" : fmt::format(": `{}`", o.command), first.particles, first.radius,
      first.spacing, scale.width, scale.height, scale.samples, first.threads, first.instruction_set,
      o.quick ? " **A quick run: small and noisy, its times and errors say little.**" : "");
  text +=
      "What differs from the thesis:\n\n"
      "- Its dam break (110,375 particles, by the authors of another paper) is not public. Ours is another one of "
      "about the "
      "same size (data/README.md), and views 1 and 2 are ours: `--view front` and `--view three-quarter`. So times and "
      "errors can be compared in their order of magnitude and their ratios, not in their digits.\n"
      "- It meshed its surface with Houdini, which is another surface than its own metaballs; its error holds that, "
      "too. "
      "Our mesh is of the very field that is rendered directly, by marching cubes on cells of R0/2, with the same "
      "normals at "
      "its vertices.\n"
      "- It rendered its mesh with Mitsuba, on an i7 at 2.6 GHz. Here one path tracer renders both; Embree finds the "
      "triangles.\n"
      "- Thresholds, lost particles and Algorithm 1 are as corrected (docs/manual.md, `--threshold auto`, `--recover "
      "smooth`).\n"
      "- Light and extinction are not told by it: here the default sky over a plain floor, and 8 per metre with an "
      "albedo of "
      "0.99 for the volume, each particle by its own density.\n\n"
      "Times are seconds of the processor, all threads together, which other work on the machine hardly changes. "
      "*Build* is all before the first ray: spacing, lost particles, surface or mesh, "
      "grid and "
      "tree. Each picture is the mean of two halves with seeds of their own, no two pictures share a seed, and MSE is "
      "of "
      "display values, as `embrun compare` has it, in units of 10⁻⁴; *bias* is what of it more samples would leave, "
      "with its "
      "95 % interval, and the rest is noise.\n\n";
  return text;
}

std::string table_1(const Findings& f) {
  std::string text = "## Table 1: order of the neighbourhood\n\nSurface only, all refractions.\n\n";
  text += table_head(joined({{"view", "n"}, time_columns, {"triangles"}, thesis_columns}));
  for (const int view : {1, 2}) {
    for (const int order : {1, 2, 3, 4}) {
      const RowResult& r = find_row(f, {view, order, -1, false, false});
      const bool told = view == 2 && order <= 3;
      text += table_row(joined({{std::to_string(view), std::to_string(order)},
                                time_cells(r),
                                {std::to_string(r.mesh.triangles)},
                                thesis_cells(told ? thesis::table_1_view_2[order - 1] : 0, thesis::mesh_view_2)}));
    }
  }
  return text + "\n";
}

std::string table_2(const Findings& f) {
  std::string text =
      "## Table 2: number of refractions\n\nSurface only, n = 3. The thesis's mesh has all refractions in each "
      "row.\n\n";
  text += table_head(joined({{"view", "refractions"}, time_columns, thesis_columns}));
  for (const int view : {1, 2}) {
    for (const int count : {1, 2, -1}) {
      const RowResult& r = find_row(f, {view, 3, count, false, false});
      const double told = (view == 1 ? thesis::table_2_view_1 : thesis::table_2_view_2)[count < 0 ? 2 : count - 1];
      text += table_row(joined({{std::to_string(view), refractions_of(count)},
                                time_cells(r),
                                thesis_cells(told, view == 1 ? thesis::mesh_view_1 : thesis::mesh_view_2)}));
    }
  }
  return text + "\n";
}

std::string table_3(const Findings& f) {
  std::string text =
      "## Table 3: surface and volume\n\nn = 3, all refractions; the mesh holds a grid of cells of R0/2, tracked by "
      "local "
      "majorants.\n\n";
  text += table_head(joined({{"view"}, time_columns, {"cells"}, thesis_columns}));
  for (const int view : {1, 2}) {
    const RowResult& r = find_row(f, {view, 3, -1, true, false});
    text += table_row(joined({{std::to_string(view)},
                              time_cells(r),
                              {std::to_string(r.mesh.grid_cells)},
                              thesis_cells(view == 2 ? thesis::table_3_direct : 0, thesis::table_3_mesh)}));
  }
  return text + "\n";
}

std::string thesis_tracer(const Findings& f) {
  const RowResult& fast = find_row(f, {2, 3, -1, false, false});
  const double paths = static_cast<double>(f.thesis.width) * f.thesis.height * f.thesis.samples,
               all = static_cast<double>(fast.direct.width) * fast.direct.height * fast.direct.samples;
  const double scaled = f.thesis.render_seconds * all / paths;
  std::string text = "## The thesis's own tracer\n\n";
  text += fmt::format(
      "`--method thesis`, kept as a baseline, on the surface of table 1, view 2, n = 3: **measured** are {} for {} "
      "paths (the "
      "same view with {}x{} pixels and {} samples); the table has what that makes for the {} paths of the others.\n\n",
      seconds(f.thesis.render_seconds), paths, f.thesis.width, f.thesis.height, f.thesis.samples, all);
  text += table_head({"view 2, n = 3", "build", "render", "over the mesh", "over Embrun's own"});
  text += table_row({"thesis's tracer", seconds(f.thesis.build_seconds), seconds(scaled),
                     ratio(scaled, fast.mesh.render_seconds), ratio(scaled, fast.direct.render_seconds)});
  return text + "\n";
}

std::vector<std::string> difference_cells(const PictureDifference& d) {
  return {error(d.mse), fmt::format("{} ({} to {})", error(d.bias), error(d.bias_low), error(d.bias_high)),
          error(d.noise()), fmt::format("{:.4f}", d.flip)};
}
const std::vector<std::string> difference_columns{"MSE, 10⁻⁴", "bias (95 %)", "noise", "FLIP"};

std::string figure_65(const Findings& f) {
  std::string text =
      "## Figure 65: errors\n\nDirect against the mesh of the same field, with the same normals and refractions.\n\n";
  text += table_head(joined({{"view", "n", "refractions", ""}, difference_columns, {"thesis: MSE, 10⁻⁴"}}));
  for (const RowResult& r : f.rows) {
    const Row& row = r.row;
    const bool surface = row.order == 3 && row.refractions < 0 && !row.gradient && !row.volume;
    const std::string told = row.volume && row.view == 2 ? error(thesis::mse_volume)
                             : surface                   ? error(thesis::mse_surface)
                                                         : "-";
    text += table_row(joined({{std::to_string(row.view), std::to_string(row.order), refractions_of(row.refractions),
                               row.volume     ? "volume"
                               : row.gradient ? "gradient normals"
                                              : "surface"},
                              difference_cells(r.difference),
                              {told}}));
  }
  text +=
      "\nAs in figure 65 all are compared with one reference for each view, the mesh for n = 3 with all refractions. "
      "(The "
      "thesis tells one number of its bars, 48 for n = 3, its least.)\n\n";
  text += table_head(joined({{"view", "n", "refractions"}, difference_columns}));
  for (const RowResult& r : f.rows) {
    if (!r.from_reference) continue;
    text +=
        table_row(joined({{std::to_string(r.row.view), std::to_string(r.row.order), refractions_of(r.row.refractions)},
                          difference_cells(*r.from_reference)}));
  }
  text += "\n";
  for (const FigureFile& figure : f.errors) text += fmt::format("![{0}]({1})\n\n", figure.caption, figure.file);
  return text;
}

std::string ball_search(const BallSearchFigures& s) {
  std::string text = "## Section 5.3.1: uniform grid and kd-tree\n\n";
  text += fmt::format(
      "All balls of R0 that a ray passes through, as Algorithm 1 asks for them: {} rays from random places in the "
      "particles in "
      "random directions to the end of the fluid, {:.0f} balls on a ray on average; one thread. The grid has cells of "
      "2 R0; the "
      "kd-tree is built by the surface area heuristic of [WaldHavran2006]. Both are for this comparison alone; {}. The "
      "thesis "
      "tells no numbers, but that the grid clearly wins.\n\n",
      s.rays, s.chords_per_ray, s.agree ? "they found the same balls" : "**they did not find the same balls**");
  text += table_head({"", "build", "rays per second", "bytes a particle"});
  const auto row = [](const char* name, const SearchFigures& figures) {
    return table_row({name, seconds(figures.build_seconds), fmt::format("{:.0f}", figures.rays_per_second),
                      fmt::format("{:.0f}", figures.bytes_per_ball)});
  };
  text += row("uniform grid", s.grid) + row("SAH kd-tree", s.tree);
  text += table_row({"grid / kd-tree", ratio(s.grid.build_seconds, s.tree.build_seconds),
                     ratio(s.grid.rays_per_second, s.tree.rays_per_second),
                     ratio(s.grid.bytes_per_ball, s.tree.bytes_per_ball)});
  return text + "\n";
}

std::string health(const Findings& f) {
  std::uint64_t contradictions = 0, bad = 0;
  for (const RowResult& r : f.rows) {
    contradictions += r.direct.contradictions + r.mesh.contradictions;
    bad += r.direct.bad_samples + r.mesh.bad_samples;
  }
  std::string text = fmt::format(
      "## Notes\n\n- In all rows together {} samples were bad and {} contradicted the medium.\n", bad, contradictions);
  for (const std::string& note : f.notes) text += "- " + note + "\n";
  text += "\nThe pictures' commands, without seeds and samples:\n\n";
  for (const RowResult& r : f.rows)
    text += fmt::format("- `{}`: `{}`\n- `{}`: `{}`\n", r.direct.name, r.direct.flags, r.mesh.name, r.mesh.flags);
  return text;
}

}  // namespace

const RowResult& find_row(const Findings& findings, const Row& row) {
  const auto found =
      std::find_if(findings.rows.begin(), findings.rows.end(), [&](const RowResult& r) { return r.row == row; });
  EMBRUN_CHECK(found != findings.rows.end());
  return *found;
}

std::string write_document(const Findings& f, const ReproduceOptions& options) {
  std::string text = introduction(f, options) + table_1(f) + table_2(f) + table_3(f) + thesis_tracer(f) + figure_65(f) +
                     ball_search(f.search);
  text += "## Curves: figures 50, 54, 55, 57 and 58\n\n";
  for (const Curve& curve : f.curves) text += fmt::format("![{0}]({1})\n\n{0}\n\n", curve.caption, curve.file);
  text += "## Pictures: figures 62 to 68\n\n";
  for (const FigureFile& figure : f.pictures)
    text += fmt::format("![{0}]({1})\n\n{0}\n\n", figure.caption, figure.file);
  return text + health(f);
}

std::vector<Curve> error_curves(const Findings& f) {
  const auto chart = [](const char* title, const char* x) {
    LineChart c;
    c.title = title;
    c.x.label = x;
    c.x.low = 0.5;
    c.y.label = "MSE of display values";
    c.y.logarithmic = true;
    return c;
  };
  Curve orders{"figure-65a.svg", "Figure 65a: error from the mesh of n = 3, by order", chart("Order", "n")};
  orders.chart.x.high = 4.5;
  Curve refractions{"figure-65b.svg", "Figure 65b: error from the mesh with all refractions (3 on the axis), by number",
                    chart("Refractions", "1, 2, all")};
  refractions.chart.x.high = 3.5;
  for (const int view : {1, 2}) {
    ChartSeries by_order, by_count;
    by_order.name = by_count.name = fmt::format("view {}", view);
    by_order.markers = by_count.markers = true;
    for (const int order : {1, 2, 3, 4}) {
      by_order.x.push_back(order);
      by_order.y.push_back(find_row(f, {view, order, -1, false, false}).from_reference->mse);
    }
    for (const int count : {1, 2, -1}) {
      by_count.x.push_back(count < 0 ? 3 : count);
      by_count.y.push_back(find_row(f, {view, 3, count, false, false}).from_reference->mse);
    }
    orders.chart.series.push_back(by_order);
    refractions.chart.series.push_back(by_count);
  }
  const ChartSeries told{"thesis, n = 3", {3}, {thesis::mse_surface}, false, true};
  orders.chart.series.push_back(told);
  return {orders, refractions};
}

}  // namespace embrun

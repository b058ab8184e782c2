#include "reproduction/curves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "geometry/kernels.h"
#include "media/density_walk.h"
#include "media/particle_density_build.h"

namespace embrun {
namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

// ---- figure 50 ---------------------------------------------------------------------------------------------------

/// The ends of the line's pieces of constant extinction, and the optical depth there.
struct DepthCurve {
  std::vector<double> t{0}, depth{0};

  bool operator()(const DensityCell&, float begin, float end, Rgb k) {
    if (static_cast<double>(begin) > t.back()) add(static_cast<double>(begin), depth.back());
    add(static_cast<double>(end), depth.back() + static_cast<double>(k.r) * static_cast<double>(end - begin));
    return false;
  }
  void add(double at, double value) {
    t.push_back(at);
    depth.push_back(value);
  }
};

double quantile(std::vector<double> values, double q) {
  const auto rank = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

double quantile_of(const std::vector<Vec3d>& positions, int axis, double q) {
  std::vector<double> values;
  for (const Vec3d& p : positions) values.push_back(axis == 0 ? p.x : axis == 1 ? p.y : p.z);
  return quantile(std::move(values), q);
}

LineChart chart_of(std::string title, std::string x, std::string y, std::vector<ChartSeries> series) {
  LineChart chart;
  chart.title = std::move(title);
  chart.x.label = std::move(x);
  chart.y.label = std::move(y);
  chart.series = std::move(series);
  return chart;
}

// ---- figures 54 to 58 --------------------------------------------------------------------------------------------

/// Particles of radius 1 on a lattice, four layers deep, whose uppermost lies at y = 0, and one alone beside it.
struct Block {
  std::vector<Vec3d> points;
  Vec3d drop;
  double left, right;
};

Block make_block(double spacing) {
  Block block{{}, {}, -9 * spacing, 0};
  for (int i = 0; i < 10; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = -4; k <= 4; ++k) {
        // Every other one a little off, as solvers have them: what orders smooth.
        const double lift = j == 0 && (i + k) % 2 == 0 ? 0.25 * spacing : 0;
        block.points.push_back({(i - 9) * spacing, lift - j * spacing, k * spacing});
      }
  block.drop = {4.5 * spacing, 0.5 * spacing, 0};
  block.right = block.drop.x;
  block.points.push_back(block.drop);
  return block;
}

/// D of order n, with a = 1.
double field(const Block& block, int order, Vec3d x) {
  double sum = 0;
  for (const Vec3d& p : block.points)
    sum += static_cast<double>(metaball_value(static_cast<float>(length(x - p) / (2.0 * order))));
  return sum;
}

/// Height of the topmost place on the vertical line at x where `inside` holds, from y = 4 down; not a number if there is
/// none.
double top_of(double x, const std::function<bool(Vec3d)>& inside) {
  constexpr double from = 4, to = -3, step = 0.02;
  for (double y = from; y > to; y -= step) {
    if (!inside({x, y, 0})) continue;
    double low = y, high = y + step;
    for (int i = 0; i < 20; ++i) {
      const double middle = 0.5 * (low + high);
      (inside({x, middle, 0}) ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
  return nothing;
}

ChartSeries profile(const Block& block, std::string name, const std::function<bool(Vec3d)>& inside) {
  ChartSeries series;
  series.name = std::move(name);
  constexpr int steps = 240;
  for (int i = 0; i <= steps; ++i) {
    const double x = block.left - 1 + (block.right + 2.5 - block.left) * i / steps;
    series.x.push_back(x);
    series.y.push_back(top_of(x, inside));
  }
  return series;
}

ChartSeries surface_profile(const Block& block, int order, double threshold, std::string name) {
  return profile(block, std::move(name),
                 [&block, order, threshold](Vec3d x) { return field(block, order, x) >= threshold; });
}

ChartSeries ball_profile(const Block& block) {
  return profile(block, "balls of R0", [&block](Vec3d x) {
    return std::any_of(block.points.begin(), block.points.end(), [&](const Vec3d& p) { return length(x - p) <= 1; });
  });
}

ChartSeries level(const Block& block, double value, std::string name) {
  return {std::move(name), {block.left - 1, block.right + 1.5}, {value, value}, true, false};
}

}  // namespace

std::vector<Curve> depth_curves(const SizedParticles& sized, double extinction) {
  const std::vector<Vec3d>& all = sized.particles.positions;
  const Vec3d middle{quantile_of(all, 0, 0.5), quantile_of(all, 1, 0.25), quantile_of(all, 2, 0.5)};
  const double first = quantile_of(all, 0, 0) - 2 * sized.radius.radius,
               last = quantile_of(all, 0, 1) + 2 * sized.radius.radius;
  std::vector<Vec3> positions;
  for (const Vec3d& p : all) positions.push_back(to_float(p - middle));
  DensityParticles particles;
  particles.positions = positions;
  particles.radii = sized.radius.radii;
  particles.radius = static_cast<float>(sized.radius.radius);
  particles.extinction = grey(static_cast<float>(extinction));
  const ParticleDensity density(std::span(&particles, 1), MediaOverlap::sum);
  DepthCurve curve;
  const auto length = static_cast<float>(last - first);
  walk_density(density.view(), {static_cast<float>(first - middle.x), 0, 0}, {1, 0, 0}, 0.0f, length, ~0u, curve);
  curve.add(last - first, curve.depth.back());
  std::vector<double> transmittance;
  for (const double depth : curve.depth) transmittance.push_back(std::exp(-depth));

  const std::string along = fmt::format(
      "Along the x axis through the particles at y = {:.3g}, z = {:.3g} m; each ball of radius R0 has {:g} per "
      "metre, where several overlap it is averaged, between them there is none. Exact: no steps.",
      middle.y, middle.z, extinction);
  return {{"figure-50a.svg", "Transmittance. " + along,
           chart_of("Transmittance", "metres along the ray", "transmittance", {{"", curve.t, transmittance}})},
          {"figure-50b.svg", "Density integrated. " + along,
           chart_of("Integrated density", "metres along the ray", "optical depth", {{"", curve.t, curve.depth}})}};
}

std::vector<Curve> surface_curves(double spacing) {
  const Block block = make_block(spacing);
  const double alone = static_cast<double>(metaball_value(0.5f));  // T0 = f(R0), b = 2 R0
  std::vector<Curve> curves;
  const char *x = "x / R0", *y = "height / R0";
  std::vector<ChartSeries> thresholds;
  for (const double factor : {0.4, 1.0, 2.0})
    thresholds.push_back(surface_profile(block, 1, factor * alone, fmt::format("T = {:g} T0", factor)));
  curves.push_back({"figure-54.svg",
                    "The surface of the first order for three thresholds, T0 = f(R0): a small one makes it coarse and "
                    "swollen, a large one fine, and pieces are lost.",
                    chart_of("Thresholds", x, y, thresholds)});
  curves.push_back(
      {"figure-55.svg",
       "The surface for R1 = 2 R0 and T0 beside the particles' own balls: smoother only where these overlap.",
       chart_of("First order", x, y, {ball_profile(block), surface_profile(block, 1, alone, "n = 1, T0")})});
  curves.push_back(
      {"figure-57.svg",
       "The surface for R1 = 2 * 3 * R0 and T = (2n - 1) a is smoother; the drop beside the block is lost. T = "
       "D/2, half of the field inside, is Embrun's threshold for this spacing.",
       chart_of("Third order", x, y,
                {surface_profile(block, 1, alone, "n = 1, T0"), surface_profile(block, 3, 5, "n = 3, T = 5 a"),
                 surface_profile(block, 3, 0.5 * 4 * 3.14159265358979 * 4 / 81 * std::pow(6 / spacing, 3),
                                 "n = 3, T = D/2")})});
  ChartSeries second{"D, R1 = 2 * 2 * R0", {}, {}}, first{"D', R1 = 2 R0", {}, {}};
  constexpr int steps = 300;
  for (int i = 0; i <= steps; ++i) {
    const double at = block.left - 1 + (block.right + 2.5 - block.left) * i / steps;
    const double height = block.drop.y * std::clamp((at - 0.5) / (block.right - 0.5), 0.0, 1.0);
    second.x.push_back(at);
    second.y.push_back(field(block, 2, {at, height, 0}));
    first.x.push_back(at);
    first.y.push_back(field(block, 1, {at, height, 0}));
  }
  curves.push_back(
      {"figure-58.svg",
       "The field along the block's upper row and on to the drop, whose second-order field stays below T = 3 a: "
       "it is recovered by the first-order one and T' = f(R0). (The thesis prints T' = a, which only the "
       "particle's centre reaches.)",
       chart_of("Second order", x, "field / a",
                {second, first, level(block, 3, "T = 3 a"), level(block, alone, "T' = f(R0)")})});
  return curves;
}

}  // namespace embrun

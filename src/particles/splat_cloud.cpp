#include "particles/splat_cloud.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "math/median.h"
#include "math/srgb.h"
#include "particles/cloud_cleaning.h"
#include "particles/cloud_closedness.h"
#include "particles/point_tree.h"
#include "particles/splat_attributes.h"

namespace embrun {

namespace {

[[noreturn]] void fail(std::string_view file, std::string_view what, const std::string& message) {
  throw Error(std::string(file) + ": " + std::string(what) + ": " + message);
}

bool is_length(double x) {
  return x >= static_cast<double>(std::numeric_limits<float>::min()) &&
         x <= static_cast<double>(std::numeric_limits<float>::max());
}

void check_options(const SplatOptions& options, std::string_view file) {
  constexpr std::size_t fewest = 3, most = 256;
  if (options.neighbours && (*options.neighbours < fewest || *options.neighbours > most)) {
    fail(file, "neighbours", std::to_string(*options.neighbours) + " is not from 3 to 256");
  }
  if (options.radius && !is_length(*options.radius)) fail(file, "splat radius", "it must be a positive number");
  if (!is_length(options.radius_scale)) fail(file, "scale of the splat radii", "it must be a positive number");
  if (!(options.outlier_ratio >= 0) || std::isinf(options.outlier_ratio)) {
    fail(file, "outlier ratio", "it must be a number, 0 or greater");
  }
  if (options.thin != 0 && !is_length(options.thin)) fail(file, "thinning", "the edge must be a positive number");
}

/// The points of a cloud with a tree over them that is made when first asked for.
class TreedPoints {
 public:
  explicit TreedPoints(ParticleSet& particles) : particles_(particles) {}
  const PointTree& tree() {
    if (!tree_) {
      constexpr std::size_t neighbours = 24;  // no step asks for more as a rule
      tree_ = std::make_unique<PointTree>(particles_.positions);
      tree_->remember_neighbours(neighbours);
    }
    return *tree_;
  }
  std::size_t keep(const PointSelection& selection) {
    if (selection.removed == 0) return 0;
    keep_particles(particles_, selection.keep);
    tree_.reset();
    return selection.removed;
  }

 private:
  ParticleSet& particles_;
  std::unique_ptr<PointTree> tree_;
};

/// Estimates the normals that are zero, on the side of their neighbours' normals; returns how many there were.
std::size_t fill_normals(const PointTree& tree, std::span<const Vec3d> points, std::span<Vec3> normals) {
  std::vector<std::uint32_t> empty;
  for (std::uint32_t i = 0; i < normals.size(); ++i) {
    if (normals[i] == Vec3{}) empty.push_back(i);
  }
  if (empty.empty()) return 0;
  constexpr std::size_t neighbours = 16;
  std::vector<Vec3> filled(empty.size());
  parallel_for(empty.size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<PointTree::Neighbour> found(neighbours);
    for (std::size_t e = begin; e < end; ++e) {
      const std::uint32_t i = empty[e];
      const std::size_t count = tree.nearest_others(i, found);
      filled[e] = estimate_normal(tree, points, i, neighbours);
      Vec3 sum;
      for (std::size_t k = 0; k < count; ++k) sum += normals[found[k].index];
      if (dot(sum, filled[e]) < 0) filled[e] = -filled[e];
    }
  });
  for (std::size_t e = 0; e < empty.size(); ++e) normals[empty[e]] = filled[e];
  return empty.size();
}

void take_normals(SplatCloud& cloud, const PointTree& tree, const SplatOptions& options, std::string_view file) {
  SplatReport& report = cloud.report;
  const std::span<const Vec3d> points = cloud.particles.positions;
  if (options.normals != NormalChoice::estimate) cloud.normals = normals_of_points(cloud.particles);
  if (!cloud.normals.empty()) {
    report.normals = NormalSource::file;
    report.replaced_normals = fill_normals(tree, points, cloud.normals);
    report.normal_difference = mean_normal_difference(tree, points, cloud.normals, report.shape.neighbours);
    if (options.sensor) report.turned_normals = orient_towards(*options.sensor, points, cloud.normals);
    return;
  }
  if (options.normals == NormalChoice::file) fail(file, "normals", "the file has none; let them be estimated");
  if (points.size() < 3) {
    fail(file, "normals", "the file has none, and fewer than 3 different points have no surface to estimate them from");
  }
  report.neighbours = options.neighbours.value_or(report.shape.neighbours);
  cloud.normals = estimate_normals(tree, points, report.neighbours);
  if (const std::optional<Vec3d> sensor = options.sensor ? options.sensor : cloud.particles.sensor) {
    report.normals = NormalSource::estimated_to_sensor;
    orient_towards(*sensor, points, cloud.normals);
  } else {
    report.normals = NormalSource::estimated_outwards;
    report.pieces = orient_consistently(tree, points, cloud.normals);
  }
}

/// Gives splats without a usable radius the median one of the others.
void mend_radii(SplatCloud& cloud, std::string_view file) {
  const auto usable = [](float radius) { return is_length(static_cast<double>(radius)); };
  std::vector<float> good;
  std::copy_if(cloud.radii.begin(), cloud.radii.end(), std::back_inserter(good), usable);
  if (good.empty()) {
    fail(file, "splat radius", "there are no two different points to take one from; give one (--splat-radius)");
  }
  SplatReport& report = cloud.report;
  report.replaced_radii = cloud.radii.size() - good.size();
  report.median_radius = static_cast<double>(median_of(good));
  for (std::size_t i = 0; i < cloud.radii.size() && report.replaced_radii > 0; ++i) {
    if (usable(cloud.radii[i])) continue;
    cloud.radii[i] = static_cast<float>(report.median_radius);
    if (!cloud.axes.empty()) cloud.axes[i] = disc_axes(cloud.normals[i], cloud.radii[i]);
  }
  report.least_radius = static_cast<double>(*std::min_element(cloud.radii.begin(), cloud.radii.end()));
  report.greatest_radius = static_cast<double>(*std::max_element(cloud.radii.begin(), cloud.radii.end()));
}

void take_radii(SplatCloud& cloud, const PointTree& tree, const SplatOptions& options, std::string_view file) {
  SplatReport& report = cloud.report;
  const std::size_t count = cloud.particles.size();
  if (options.radius) {
    report.radius = SplatRadiusSource::given;
    cloud.radii.assign(count, static_cast<float>(*options.radius));
  } else if (const Attribute* attribute = number_attribute(cloud.particles, "radius", 1)) {
    report.radius = SplatRadiusSource::file;
    cloud.radii.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      cloud.radii[i] = static_cast<float>(attribute->value(i) * options.radius_scale);
    }
  } else {
    report.radius = SplatRadiusSource::spacing;
    SplatSizes sizes = estimate_splats(tree, cloud.particles.positions, cloud.normals, options.ellipses);
    cloud.radii = std::move(sizes.radii);
    cloud.axes = std::move(sizes.axes);
    report.at_border = sizes.at_border;
    const auto scale = static_cast<float>(options.radius_scale);
    for (float& radius : cloud.radii) radius *= scale;
    for (SplatAxes& axes : cloud.axes) axes = {axes.major * scale, axes.minor * scale};
    for (std::size_t i = 0; i < cloud.axes.size(); ++i) cloud.radii[i] = length(cloud.axes[i].major);
  }
  mend_radii(cloud, file);
}

/// Linear colours of the attribute, which holds sRGB from 0 to 1, or to 255 where floats of a file do so.
std::vector<Rgb> take_colours(const ParticleSet& particles) {
  const Attribute* attribute = number_attribute(particles, "color", 3);
  if (!attribute) return {};
  double greatest = 0;
  for (std::size_t i = 0; i < attribute->value_count(); ++i) greatest = std::max(greatest, attribute->value(i));
  const double scale = color_scale(greatest);
  std::vector<Rgb> colours(particles.size());
  for (std::size_t i = 0; i < colours.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const auto value = static_cast<float>(scale * attribute->value(3 * i + static_cast<std::size_t>(c)));
      colours[i][c] = srgb_decode(clamp(value, 0.0f, 1.0f));
    }
  }
  return colours;
}

}  // namespace

const char* to_string(SplatRadiusSource source) {
  return source == SplatRadiusSource::given ? "given" : source == SplatRadiusSource::file ? "file" : "spacing";
}

SplatCloud make_splats(ParticleSet particles, const SplatOptions& options, std::string_view file) {
  check_options(options, file);
  SplatCloud cloud;
  cloud.particles = std::move(particles);
  SplatReport& report = cloud.report;
  report.points_in = cloud.particles.size();
  const std::vector<Vec3d>& points = cloud.particles.positions;
  if (points.empty()) fail(file, "points", "there are none");

  reorder_particles(cloud.particles, order_along_curve(points));
  TreedPoints treed(cloud.particles);
  if (!options.keep_duplicates) report.duplicates = treed.keep(without_duplicates(points));
  constexpr std::size_t outlier_neighbours = 16;
  if (options.outlier_ratio > 0) {
    report.outliers = treed.keep(without_outliers(treed.tree(), points, outlier_neighbours, options.outlier_ratio));
  }
  if (options.thin > 0) report.thinned = treed.keep(thinned_by_voxels(points, options.thin));

  const PointTree& tree = treed.tree();
  report.shape = measure_cloud(tree, points);
  take_normals(cloud, tree, options, file);
  take_radii(cloud, tree, options, file);
  cloud.colours = take_colours(cloud.particles);
  report.closed_given = options.closed.has_value();
  if (options.closed) {
    cloud.closed = *options.closed;
  } else {
    const CloudClosedness found = look_for_holes(points, cloud.normals, cloud.radii, tree.order());
    cloud.closed = found.closed;
    report.open_share = found.open_share;
  }
  return cloud;
}

}  // namespace embrun

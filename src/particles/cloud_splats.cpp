#include "particles/cloud_splats.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"

namespace embrun {

namespace {

struct Point2 {
  double x = 0, y = 0;
};
double dot2(Point2 a, Point2 b) { return a.x * b.x + a.y * b.y; }

/// A convex polygon that is cut by half planes.
class Cell {
 public:
  void start(double half_width) {
    const double w = half_width;
    corners_.assign({{-w, -w}, {w, -w}, {w, w}, {-w, w}});
  }
  /// Keeps what is nearer to the origin than to `site`.
  void cut(Point2 site) {
    const double limit = 0.5 * dot2(site, site);
    cut_.clear();
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const Point2 a = corners_[i], b = corners_[i + 1 < corners_.size() ? i + 1 : 0];
      const double from = dot2(a, site) - limit, to = dot2(b, site) - limit;
      if (from <= 0) cut_.push_back(a);
      if ((from < 0 && to > 0) || (from > 0 && to < 0)) {
        const double t = from / (from - to);
        cut_.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
      }
    }
    std::swap(corners_, cut_);
  }
  std::span<const Point2> corners() const { return corners_; }
  double farthest_squared() const {
    double farthest = 0;
    for (const Point2 corner : corners_) farthest = std::max(farthest, dot2(corner, corner));
    return farthest;
  }

 private:
  std::vector<Point2> corners_, cut_;
};

/// A covariance round the origin: its principal axes, the greater at `angle` from x.
struct Spread2 {
  double great = 0, small = 0, angle = 0;
};

Spread2 principal_spread(double xx, double yy, double xy) {
  const double half = 0.5 * std::hypot(xx - yy, 2 * xy), middle = 0.5 * (xx + yy);
  return {middle + half, std::max(middle - half, 0.0), 0.5 * std::atan2(2 * xy, xx - yy)};
}

/// Shape of the ellipse of the least area round the origin that holds the points: that of their covariance under the weights
/// that an iteration finds which gives more to points farther out [Titterington1978]. It need not converge: who takes
/// the shape scales it to hold all.
Spread2 least_ellipse(std::span<const Point2> points) {
  constexpr int rounds = 24;
  std::vector<double> weights(points.size(), 1 / static_cast<double>(points.size()));
  double xx = 0, yy = 0, xy = 0;
  for (int round = 0; round < rounds; ++round) {
    xx = yy = xy = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point2 p = points[i];
      xx += weights[i] * p.x * p.x, yy += weights[i] * p.y * p.y, xy += weights[i] * p.x * p.y;
    }
    const double determinant = xx * yy - xy * xy;
    if (!(determinant > 0)) break;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point2 p = points[i];
      weights[i] *= 0.5 * (yy * p.x * p.x - 2 * xy * p.x * p.y + xx * p.y * p.y) / determinant;
    }
  }
  return principal_spread(xx, yy, xy);
}

constexpr std::size_t few_neighbours = 24, most_neighbours = 96;  // doubled from one to the other

/// Measures one point after another; holds the arrays that this takes.
class SplatMeasure {
 public:
  SplatMeasure(const PointTree& tree, std::span<const Vec3d> points, std::span<const Vec3> normals)
      : tree_(tree), points_(points), normals_(normals), found_(most_neighbours) {}

  /// Makes the cell of point i; false when it is open.
  bool make_cell(std::uint32_t i) {
    const Vec3d n = to_double(normals_[i]);
    tangents_ = tangents_of(n);
    for (std::size_t k = few_neighbours;; k *= 2) {
      const std::size_t count = tree_.nearest_others(i, std::span(found_).first(k));
      if (count == 0) return reach_ = 0, false;
      const double farthest = std::sqrt(found_[count - 1].distance_squared);
      reach_ = 0.5 * farthest;
      place_sites(i, n, count);
      cell_.start(2 * farthest);
      // From the nearest on, until they are too far to reach any corner.
      for (const Point2 site : sites_) {
        if (dot2(site, site) > 4 * cell_.farthest_squared()) break;
        cell_.cut(site);
      }
      if (cell_.farthest_squared() <= reach_ * reach_) return true;
      if (k == most_neighbours || count < k) return false;
    }
  }

  /// The distance to the farthest corner within reach; to the nearest neighbour where there is none.
  double radius() const {
    double greatest = 0;
    for (const Point2 corner : cell_.corners()) {
      const double squared = dot2(corner, corner);
      if (squared <= reach_ * reach_) greatest = std::max(greatest, squared);
    }
    if (greatest == 0 && reach_ > 0) greatest = found_[0].distance_squared;
    return std::sqrt(greatest);
  }

  /// The ellipse round a closed cell, or the disc of that radius where it is no smaller.
  SplatAxes axes(double radius, bool closed) const {
    const SplatAxes disc{to_float(tangents_.u * radius), to_float(tangents_.v * radius)};
    if (!closed || !(radius > 0)) return disc;
    const Spread2 spread = least_ellipse(cell_.corners());
    constexpr double most_ratio = 3;
    if (!(spread.great > 0)) return disc;
    const double ratio = std::sqrt(std::max(spread.small / spread.great, 1 / (most_ratio * most_ratio)));
    const double c = std::cos(spread.angle), s = std::sin(spread.angle);
    double scale = 0;
    for (const Point2 corner : cell_.corners()) {
      scale = std::max(scale, std::hypot(c * corner.x + s * corner.y, (c * corner.y - s * corner.x) / ratio));
    }
    if (scale * scale * ratio >= radius * radius) return disc;
    const Vec3d major = tangents_.u * c + tangents_.v * s, minor = tangents_.v * c - tangents_.u * s;
    return {to_float(major * scale), to_float(minor * (scale * ratio))};
  }

 private:
  const PointTree& tree_;
  std::span<const Vec3d> points_;
  std::span<const Vec3> normals_;
  std::vector<PointTree::Neighbour> found_;
  std::vector<Point2> sites_;
  Tangents tangents_;
  Cell cell_;
  double reach_ = 0;  // cells are certain within

  void place_sites(std::uint32_t i, Vec3d n, std::size_t count) {
    sites_.clear();
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t j = found_[k].index;
      const Vec3d offset = points_[j] - points_[i];
      if (!(dot(n, to_double(normals_[j])) > 0)) continue;
      const Point2 flat{dot(offset, tangents_.u), dot(offset, tangents_.v)};
      const double beside = std::sqrt(dot2(flat, flat)), whole = std::sqrt(found_[k].distance_squared);
      constexpr double least_beside = 0.5;
      if (!(beside > least_beside * whole)) continue;
      const double stretch = whole / beside;
      sites_.push_back({flat.x * stretch, flat.y * stretch});
    }
  }
};

/// Keeps splats at the border from reaching over it farther than their neighbours reach.
void limit_open_cells(const PointTree& tree, std::span<const Vec3d> points, const std::vector<std::uint8_t>& closed,
                      SplatSizes& sizes) {
  const std::vector<float> measured = sizes.radii;
  constexpr std::size_t looked_at = 32, wanted = 8, grain = 4096;
  parallel_for(points.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<PointTree::Neighbour> found(looked_at);
    for (std::size_t place = begin; place < end; ++place) {
      const std::uint32_t i = tree.order()[place];
      if (closed[i]) continue;
      const std::size_t count = tree.nearest_others(i, found);
      float greatest = 0;
      std::size_t seen = 0;
      for (std::size_t k = 0; k < count && seen < wanted; ++k) {
        const std::uint32_t j = found[k].index;
        if (!closed[j]) continue;
        greatest = std::max(greatest, measured[j]);
        ++seen;
      }
      if (seen == 0 || measured[i] <= greatest) continue;
      sizes.radii[i] = greatest;
      if (sizes.axes.empty()) continue;
      const float scale = greatest / measured[i];
      sizes.axes[i] = {sizes.axes[i].major * scale, sizes.axes[i].minor * scale};
    }
  });
}

}  // namespace

SplatAxes disc_axes(Vec3 normal, float radius) {
  const Tangents tangents = tangents_of(to_double(normal));
  const double size = static_cast<double>(radius);
  return {to_float(tangents.u * size), to_float(tangents.v * size)};
}

SplatSizes estimate_splats(const PointTree& tree, std::span<const Vec3d> points, std::span<const Vec3> normals,
                           bool ellipses) {
  EMBRUN_CHECK(points.size() == normals.size());
  SplatSizes sizes;
  sizes.radii.resize(points.size());
  if (ellipses) sizes.axes.resize(points.size());
  std::vector<std::uint8_t> closed(points.size());
  constexpr std::size_t grain = 512;
  parallel_for(points.size(), grain, [&](std::size_t begin, std::size_t end) {
    SplatMeasure measure(tree, points, normals);
    for (std::size_t place = begin; place < end; ++place) {
      const std::uint32_t i = tree.order()[place];
      closed[i] = measure.make_cell(i);
      const double radius = measure.radius();
      sizes.radii[i] = splat_overlap * static_cast<float>(radius);
      if (!ellipses) continue;
      const SplatAxes axes = measure.axes(radius, closed[i] != 0);
      sizes.axes[i] = {splat_overlap * axes.major, splat_overlap * axes.minor};
    }
  });
  limit_open_cells(tree, points, closed, sizes);
  sizes.at_border = static_cast<std::size_t>(std::count(closed.begin(), closed.end(), std::uint8_t{0}));
  return sizes;
}

}  // namespace embrun

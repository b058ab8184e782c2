#include "particles/cloud_normals.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "base/parallel.h"
#include "math/median.h"
#include "particles/covariance.h"

namespace embrun {

namespace {

constexpr double pi_d = 3.14159265358979323846;

/// Principal axes of a point and the first `k` of its neighbours.
PrincipalAxes axes_of(std::span<const Vec3d> points, std::size_t i, std::span<const PointTree::Neighbour> neighbours,
                      std::size_t k) {
  CovarianceSums sums;
  sums.add({});
  for (const auto& neighbour : neighbours.first(std::min(k, neighbours.size()))) {
    sums.add(points[neighbour.index] - points[i]);
  }
  return principal_axes(sums);
}

/// Whether points spread in a second direction.
bool is_wide(const PrincipalAxes& axes) { return axes.variance[1] > CloudShape::least_width * axes.variance[2]; }

Vec3 to_unit(Vec3d direction) { return normalize(to_float(direction)); }

/// The normal of a point whose k nearest neighbours lie on a line, from more of them.
Vec3 normal_off_lines(const PointTree& tree, std::span<const Vec3d> points, std::uint32_t i, std::size_t k) {
  constexpr std::size_t most = 256;
  std::vector<PointTree::Neighbour> found;
  PrincipalAxes axes;
  do {
    k = std::min(2 * k, most);
    found.resize(k);
    const std::size_t count = tree.nearest_others(i, found);
    axes = axes_of(points, i, std::span(found).first(count), k);
  } while (!is_wide(axes) && k < std::min(most, points.size()));
  return to_unit(axes.direction[0]);
}

/// The normal of a point from its k nearest neighbours, or more of them where those lie on a line.
Vec3 normal_from(const PointTree& tree, std::span<const Vec3d> points, std::uint32_t i,
                 std::span<const PointTree::Neighbour> neighbours, std::size_t k) {
  const PrincipalAxes axes = axes_of(points, i, neighbours, k);
  return is_wide(axes) ? to_unit(axes.direction[0]) : normal_off_lines(tree, points, i, k);
}

/// Shapes are measured at a sample of the points, evenly along the tree's order.
constexpr std::size_t most_samples = 4096, sample_grain = 64;
std::uint32_t sampled_point(const PointTree& tree, std::size_t s, std::size_t samples) {
  return tree.order()[s * tree.size() / samples];
}

struct LocalShape {
  double variation = 0, width = 0, spacing = 0, noise_squared = 0, curvature = 0;
};

/// `scale` neighbours tell the shape, half and twice as many the noise.
LocalShape measure_point(std::span<const Vec3d> points, std::size_t i, std::span<const PointTree::Neighbour> neighbours,
                         std::size_t scale) {
  LocalShape shape;
  const auto variance = axes_of(points, i, neighbours, scale).variance;
  const double total = variance[0] + variance[1] + variance[2];
  if (!(total > 0)) return shape;
  shape.variation = variance[0] / total;
  shape.width = variance[1] / variance[2];
  const auto area_radius = [&](std::size_t k) {
    return neighbours[std::min(k, neighbours.size()) - 1].distance_squared;
  };
  // A plane fitted to n points takes three of their degrees of freedom.
  const auto off_plane = [&](std::size_t k) {
    const double n = static_cast<double>(std::min(k, neighbours.size()) + 1);
    return axes_of(points, i, neighbours, k).variance[0] * n / (n - 3);
  };
  const std::size_t near_scale = scale / 2, far_scale = 2 * scale;
  const double near = off_plane(near_scale), far = off_plane(far_scale);
  const double near_square = area_radius(near_scale), far_square = area_radius(far_scale);
  const double growth = far_square * far_square - near_square * near_square;
  const double bend = growth > 0 ? std::max((far - near) / growth, 0.0) : 0;
  shape.noise_squared = std::max(near - bend * near_square * near_square, 0.0);
  shape.curvature = std::sqrt(48 * bend);
  shape.spacing = std::sqrt(pi_d * near_square / static_cast<double>(near_scale));
  return shape;
}

/// Sets joined one by one, each member knowing whether it is turned over against its set's root.
class SignedForest {
 public:
  explicit SignedForest(std::size_t count) : parent_(count), turned_(count), size_(count, 1) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }
  struct Root {
    std::uint32_t index;
    std::uint8_t turned;
  };
  Root find(std::uint32_t i) {
    std::uint8_t turned = 0;
    std::uint32_t root = i;
    for (; parent_[root] != root; root = parent_[root]) turned ^= turned_[root];
    // Everything on the way is hung on the root.
    for (std::uint8_t rest = turned; parent_[i] != i && parent_[i] != root;) {
      const std::uint32_t next = parent_[i];
      const std::uint8_t own = turned_[i];
      parent_[i] = root;
      turned_[i] = rest;
      rest ^= own;
      i = next;
    }
    return {root, turned};
  }
  void join(std::uint32_t a, std::uint32_t b, bool opposite) {
    Root x = find(a), y = find(b);
    if (x.index == y.index) return;
    if (size_[x.index] < size_[y.index]) std::swap(x, y);
    parent_[y.index] = x.index;
    turned_[y.index] = static_cast<std::uint8_t>(x.turned ^ y.turned ^ static_cast<std::uint8_t>(opposite));
    size_[x.index] += size_[y.index];
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> turned_;
  std::vector<std::uint32_t> size_;
};

struct Edge {
  float cost = 0;
  std::uint32_t a = 0, b = 0;
  bool operator<(const Edge& other) const {
    if (cost != other.cost) return cost < other.cost;
    return a != other.a ? a < other.a : b < other.b;
  }
};

float edge_cost(Vec3d offset, Vec3 a, Vec3 b) {
  const double squared = dot(offset, offset);
  const double bend = 1 - std::abs(static_cast<double>(dot(a, b)));
  if (!(squared > 0)) return static_cast<float>(bend);
  const double rise_a = dot(offset, to_double(a)), rise_b = dot(offset, to_double(b));
  return static_cast<float>(bend + (rise_a * rise_a + rise_b * rise_b) / squared);
}

/// The spanning forest of the least cost [Kruskal1956]. The cheapest edges join almost everything, so that few of the others are
/// left to sort once those within a set are gone [Osipov2009].
SignedForest spanning_forest(std::vector<Edge> edges, std::span<const Vec3> normals) {
  SignedForest forest(normals.size());
  const auto join = [&](std::vector<Edge>& some) {
    parallel_sort(some);
    for (const Edge& edge : some) forest.join(edge.a, edge.b, dot(normals[edge.a], normals[edge.b]) < 0);
  };
  const auto cheap_end = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 4);
  std::nth_element(edges.begin(), cheap_end, edges.end());
  std::vector<Edge> cheap(edges.begin(), cheap_end);
  join(cheap);
  edges.erase(edges.begin(), cheap_end);
  std::erase_if(edges, [&](const Edge& edge) { return forest.find(edge.a).index == forest.find(edge.b).index; });
  join(edges);
  return forest;
}

/// What a piece of the forest encloses.
struct Piece {
  double count = 0, volume = 0;
  Vec3d centre;
};

/// All but the number of neighbours for normals.
CloudShape measure_at_scale(const PointTree& tree, std::span<const Vec3d> points, std::size_t scale) {
  CloudShape shape;
  shape.scale = scale;
  const std::size_t samples = std::min(points.size(), most_samples);
  std::vector<LocalShape> found(samples);
  parallel_for(samples, sample_grain, [&](std::size_t begin, std::size_t end) {
    std::vector<PointTree::Neighbour> neighbours(std::min(2 * scale, points.size() - 1));
    for (std::size_t s = begin; s < end; ++s) {
      const std::uint32_t i = sampled_point(tree, s, samples);
      tree.nearest_others(i, neighbours);
      found[s] = measure_point(points, i, neighbours, scale);
    }
  });
  const auto middle = [&](double LocalShape::*member) {
    std::vector<double> values;
    for (const LocalShape& local : found) values.push_back(local.*member);
    return median_of(values);
  };
  shape.variation = middle(&LocalShape::variation);
  shape.width = middle(&LocalShape::width);
  shape.spacing = middle(&LocalShape::spacing);
  shape.noise = std::sqrt(middle(&LocalShape::noise_squared));
  shape.curvature = middle(&LocalShape::curvature);
  const auto is_flat = [](const LocalShape& local) {
    return local.variation < CloudShape::most_variation && local.width > CloudShape::least_width;
  };
  shape.flat_share =
      static_cast<double>(std::count_if(found.begin(), found.end(), is_flat)) / static_cast<double>(samples);
  shape.is_surface =
      shape.spacing > 0 && shape.variation < CloudShape::most_variation && shape.width > CloudShape::least_width;
  return shape;
}

}  // namespace

CloudShape measure_cloud(const PointTree& tree, std::span<const Vec3d> points) {
  if (points.size() < CloudShape::least_points) return {};
  CloudShape shape = measure_at_scale(tree, points, CloudShape::least_scale);
  // Noise as great as the spacing hides a surface from few neighbours; a few layers of a fluid hide in many.
  for (std::size_t scale = 2 * CloudShape::least_scale; !shape.is_surface && scale <= CloudShape::greatest_scale;
       scale *= 2) {
    if (points.size() < 4 * scale) break;
    const CloudShape wider = measure_at_scale(tree, points, scale);
    if (wider.is_surface) shape = wider;
  }
  if (!shape.is_surface) return shape;
  constexpr double wanted_error = 1 * pi_d / 180, most_bend = 0.6, fewest = 16, most = 256;
  double k = 4.44 * shape.noise / (wanted_error * shape.spacing);
  if (shape.curvature > 0) k = std::min(k, pi_d * std::pow(most_bend / (shape.curvature * shape.spacing), 2));
  shape.neighbours = static_cast<std::size_t>(std::clamp(std::ceil(k), fewest, most));
  return shape;
}

std::vector<Vec3> estimate_normals(const PointTree& tree, std::span<const Vec3d> points, std::size_t k) {
  std::vector<Vec3> normals(points.size());
  for_each_neighbourhood(tree, k, [&](std::uint32_t i, std::span<const PointTree::Neighbour> neighbours) {
    normals[i] = normal_from(tree, points, i, neighbours, k);
  });
  return normals;
}

Vec3 estimate_normal(const PointTree& tree, std::span<const Vec3d> points, std::uint32_t i, std::size_t k) {
  std::vector<PointTree::Neighbour> found(k);
  const std::size_t count = tree.nearest_others(i, found);
  return normal_from(tree, points, i, std::span(found).first(count), k);
}

double mean_normal_difference(const PointTree& tree, std::span<const Vec3d> points, std::span<const Vec3> normals,
                              std::size_t k) {
  EMBRUN_CHECK(points.size() == normals.size());
  if (points.size() < CloudShape::least_points) return 0;
  const std::size_t samples = std::min(points.size(), most_samples);
  std::vector<double> angles(samples);
  parallel_for(samples, sample_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const std::uint32_t i = sampled_point(tree, s, samples);
      const double cosine = std::abs(static_cast<double>(dot(estimate_normal(tree, points, i, k), normals[i])));
      angles[s] = std::acos(std::min(cosine, 1.0)) * 180 / pi_d;
    }
  });
  return std::accumulate(angles.begin(), angles.end(), 0.0) / static_cast<double>(samples);
}

std::size_t orient_consistently(const PointTree& tree, std::span<const Vec3d> points, std::span<Vec3> normals) {
  EMBRUN_CHECK(points.size() == normals.size());
  if (points.empty()) return 0;
  constexpr std::size_t most_edges = 12;
  const std::size_t k = std::min(most_edges, points.size() - 1);
  std::vector<Edge> edges(points.size() * k);
  std::vector<double> areas(points.size(), 1);
  for_each_neighbourhood(tree, k, [&](std::size_t i, std::span<const PointTree::Neighbour> neighbours) {
    for (std::size_t e = 0; e < neighbours.size(); ++e) {
      const std::uint32_t j = neighbours[e].index;
      edges[i * k + e] = {edge_cost(points[j] - points[i], normals[i], normals[j]), static_cast<std::uint32_t>(i), j};
    }
    if (!neighbours.empty()) areas[i] = neighbours.back().distance_squared;
  });
  SignedForest forest = spanning_forest(std::move(edges), normals);

  std::vector<Piece> pieces(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const auto root = forest.find(i);
    if (root.turned) normals[i] = -normals[i];
    pieces[root.index].count += 1;
    pieces[root.index].centre = pieces[root.index].centre + points[i];
  }
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    Piece& piece = pieces[forest.find(i).index];
    const Vec3d from_centre = points[i] - piece.centre * (1 / piece.count);
    piece.volume += areas[i] * dot(to_double(normals[i]), from_centre);
  }
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (pieces[forest.find(i).index].volume < 0) normals[i] = -normals[i];
  }
  return static_cast<std::size_t>(
      std::count_if(pieces.begin(), pieces.end(), [](const Piece& piece) { return piece.count > 0; }));
}

std::size_t orient_towards(Vec3d sensor, std::span<const Vec3d> points, std::span<Vec3> normals) {
  EMBRUN_CHECK(points.size() == normals.size());
  std::size_t turned = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(dot(to_double(normals[i]), sensor - points[i]) < 0)) continue;
    normals[i] = -normals[i];
    ++turned;
  }
  return turned;
}

}  // namespace embrun

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "math/vec.h"
#include "particles/point_tree.h"

namespace embrun {

/// What a cloud looks like near its points, from a fixed sample of them.
struct CloudShape {
  /// Whether the points lie on surfaces. So it is when, at one of the scales, the median surface variation is below
  /// `most_variation` and the median of middle over greatest variance is above `least_width` (below it they lie on lines).
  /// Half a ball cut by a plane, as at a fluid's free surface, has a variation of 0.13, a ball 1/3. Of a sheet with noise s
  /// times its spacing it is about s^2 / (s^2 + k / (2 pi)).
  bool is_surface = false;
  /// How many neighbours the shape was measured from: 32 where those are flat, else 64 or 128 if those are; 32 if none.
  std::size_t scale = 32;
  /// Median over the sample of lambda_0 / (lambda_0 + lambda_1 + lambda_2), the variances along the principal axes of a
  /// point's nearest neighbours in ascending order [Pauly2002].
  double variation = 0;
  double width = 0;             ///< median of lambda_1 / lambda_2
  double flat_share = 0;        ///< share of the sample whose own neighbourhood is flat by the two bounds
  double spacing = 0;           ///< metres: 1 / sqrt(points per square metre)
  double noise = 0;             ///< metres: standard deviation of the points off their surface
  double curvature = 0;         ///< 1/m: root mean square over directions, of a typical point
  std::size_t neighbours = 16;  ///< how many normals are best taken from

  static constexpr std::size_t least_scale = 32, greatest_scale = 128;
  static constexpr double most_variation = 0.06, least_width = 0.05;
  static constexpr std::size_t least_points = 50;  ///< fewer are not told from a volume
};

/// Measures the cloud. Noise s and curvature are told apart by the least variance at two scales: in a disc of radius R it is
/// s^2 + (curvature R^2)^2 / 48. A normal from k points is off by 4.44 s / (k spacing) on average (least squares of a
/// plane), so k is chosen to make that 1 degree, but so that the disc does not bend by more than 0.6 rad, as
/// Mitra and Nguyen weigh the two [MitraNguyen2003]; from 16 to 256.
CloudShape measure_cloud(const PointTree& tree, std::span<const Vec3d> points);

/// Unit normals, up to their sign, by principal components of each point and its k nearest neighbours [Hoppe1992]. Where
/// those lie on a line, as along the lines of a scanner, twice as many are taken, again and again up to 256.
std::vector<Vec3> estimate_normals(const PointTree& tree, std::span<const Vec3d> points, std::size_t k);
/// The normal of one point.
Vec3 estimate_normal(const PointTree& tree, std::span<const Vec3d> points, std::uint32_t i, std::size_t k);

/// Mean angle, degrees, between the lines of `normals` and of estimated ones, over a fixed sample.
double mean_normal_difference(const PointTree& tree, std::span<const Vec3d> points, std::span<const Vec3> normals,
                              std::size_t k);

/// Turns normals so that neighbours agree: the signs run along a minimum spanning forest of the graph of the 12 nearest
/// neighbours, an edge costing 1 - |n_i.n_j| [Hoppe1992] and the squares of the sines by which the edge leaves the two tangent
/// planes, which keeps the two sides of a thin wall apart. Each piece of the forest is then turned to enclose a
/// positive volume (by the divergence theorem, sum of area n.(p - centre)): outwards on closed objects and on the convex
/// side of open ones. Returns the number of pieces.
std::size_t orient_consistently(const PointTree& tree, std::span<const Vec3d> points, std::span<Vec3> normals);

/// Turns each normal to the side of the scanner; returns how many were turned.
std::size_t orient_towards(Vec3d sensor, std::span<const Vec3d> points, std::span<Vec3> normals);

}  // namespace embrun

#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "math/vec.h"

namespace embrun {

/// Sums of points for their covariance, taken relative to a point near them so that little cancels.
struct CovarianceSums {
  double count = 0;
  Vec3d sum;
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

  void add(Vec3d d) {
    count += 1;
    sum = sum + d;
    xx += d.x * d.x, yy += d.y * d.y, zz += d.z * d.z;
    xy += d.x * d.y, xz += d.x * d.z, yz += d.y * d.z;
  }
};

/// Principal axes of points: variances in ascending order and the unit directions that belong to them.
struct PrincipalAxes {
  std::array<double, 3> variance{};
  std::array<Vec3d, 3> direction{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
};

/// Eigenvectors of the covariance by Jacobi's rotations, which keep small eigenvalues accurate. `sums.count` > 0.
inline PrincipalAxes principal_axes(const CovarianceSums& sums) {
  const double n = 1 / sums.count;
  const Vec3d mean = sums.sum * n;
  std::array<std::array<double, 3>, 3> a{};
  a[0][0] = sums.xx * n - mean.x * mean.x;
  a[1][1] = sums.yy * n - mean.y * mean.y;
  a[2][2] = sums.zz * n - mean.z * mean.z;
  a[0][1] = a[1][0] = sums.xy * n - mean.x * mean.y;
  a[0][2] = a[2][0] = sums.xz * n - mean.x * mean.z;
  a[1][2] = a[2][1] = sums.yz * n - mean.y * mean.z;
  std::array<std::array<double, 3>, 3> v{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  constexpr int most_sweeps = 16;
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    const double off = std::abs(a[0][1]) + std::abs(a[0][2]) + std::abs(a[1][2]);
    if (!(off > 0)) break;
    for (std::size_t p = 0; p < 2; ++p) {
      for (std::size_t q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        const double shift = t * a[p][q];
        a[p][p] -= shift;
        a[q][q] += shift;
        a[p][q] = a[q][p] = 0;
        const std::size_t r = 3 - p - q;
        const double rp = a[r][p], rq = a[r][q];
        a[r][p] = a[p][r] = c * rp - s * rq;
        a[r][q] = a[q][r] = s * rp + c * rq;
        for (auto& row : v) {
          const double vp = row[p], vq = row[q];
          row[p] = c * vp - s * vq;
          row[q] = s * vp + c * vq;
        }
      }
    }
  }
  std::array<std::size_t, 3> order{0, 1, 2};
  const auto put_in_order = [&](std::size_t i, std::size_t j) {
    if (a[order[j]][order[j]] < a[order[i]][order[i]]) std::swap(order[i], order[j]);
  };
  put_in_order(0, 1);
  put_in_order(1, 2);
  put_in_order(0, 1);
  PrincipalAxes axes;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t k = order[i];
    axes.variance[i] = a[k][k] > 0 ? a[k][k] : 0;
    axes.direction[i] = {v[0][k], v[1][k], v[2][k]};
  }
  return axes;
}

}  // namespace embrun

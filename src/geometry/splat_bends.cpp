#include "geometry/splat_bends.h"

#include <cmath>

#include "base/parallel.h"
#include "math/median.h"
#include "particles/neighbour_grid.h"

namespace embrun {
namespace {

/// The sums of a least squares fit of three unknowns.
struct NormalEquations {
  double a[3][3] = {}, b[3] = {};
  int count = 0;

  void add(double x, double y, double z, double value, double weight) {
    const double row[3] = {x, y, z};
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) a[i][k] += weight * row[i] * row[k];
      b[i] += weight * row[i] * value;
    }
  }

  /// By Cramer's rule; zeros where the neighbours lie on a line.
  SplatBend solve() const {
    const auto determinant = [](const double m[3][3]) {
      return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    };
    const double whole = determinant(a), scale = a[0][0] + a[1][1] + a[2][2];
    if (count < 3 || !(whole > 1e-9 * scale * scale * scale)) return {};
    float x[3];
    for (int column = 0; column < 3; ++column) {
      double m[3][3];
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) m[i][k] = k == column ? b[i] : a[i][k];
      x[column] = static_cast<float>(determinant(m) / whole);
    }
    return {x[0], x[1], x[2]};
  }
};

}  // namespace

std::vector<SplatBend> bend_normals(const std::vector<Splat>& splats) {
  std::vector<SplatBend> bends(splats.size());
  if (splats.empty()) return bends;
  std::vector<Vec3d> centers;
  std::vector<float> radii;
  for (const Splat& s : splats) {
    centers.push_back(to_double(s.center));
    radii.push_back(s.radius);
  }
  const NeighbourGrid grid(centers, 2 * static_cast<double>(median_of(radii)));
  parallel_for(splats.size(), 1 << 10, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Splat& own = splats[i];
      const Frame frame(own.normal);
      NormalEquations equations;
      const double reach = 2 * static_cast<double>(own.radius);
      grid.for_each_within(centers[i], reach, [&](std::size_t k, Vec3d, double squared) {
        const Splat& other = splats[k];
        const float cosine = dot(other.normal, own.normal);
        if (k == i || cosine < 0.5f) return;
        // The gnomonic projection of the normal: a linear field is one before it is normalised.
        const Vec3 turned = other.normal / cosine, at = other.center - own.center;
        const double s = static_cast<double>(dot(at, frame.s)), t = static_cast<double>(dot(at, frame.t));
        const double weight = 1 - std::sqrt(squared) / reach;
        equations.add(s, t, 0, static_cast<double>(dot(turned, frame.s)), weight);
        equations.add(0, s, t, static_cast<double>(dot(turned, frame.t)), weight);
        ++equations.count;
      });
      bends[i] = equations.solve();
    }
  });
  return bends;
}

}  // namespace embrun

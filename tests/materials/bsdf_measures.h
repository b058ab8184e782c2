#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "materials/bsdf.h"
#include "support/chi_square.h"

// What the tests of every BSDF ask of it.

namespace embrun::bsdf_measures {

inline Sample2 direction_numbers(int i, uint32_t seed = 5) {
  return sample_2d(SamplerKind::independent, {seed, 0, static_cast<uint32_t>(i), 0}, Dimension::bsdf_direction);
}
inline float lobe_number(int i, uint32_t seed = 5) {
  return sample_1d(SamplerKind::independent, {seed, 0, static_cast<uint32_t>(i), 0}, Dimension::bsdf_lobe);
}

/// Unit vectors all round.
class Directions {
 public:
  explicit Directions(unsigned seed) : random_(seed) {}
  Vec3 operator()() { return normalize(Vec3{normal_(random_), normal_(random_), normal_(random_)}); }

 private:
  std::mt19937 random_;
  std::normal_distribution<float> normal_;
};

/// Direction in the x-z plane, degrees from +z.
inline Vec3 tilted(double degrees, double turn = 0) {
  const double a = degrees * M_PI / 180, t = turn * M_PI / 180;
  return to_float({std::sin(a) * std::cos(t), std::sin(a) * std::sin(t), std::cos(a)});
}

/// The samples that are no single directions follow pdf_bsdf; what is lost or specular is missing from it. The chart has
/// its poles along x, away from the lobes, so that its bins are even where these are narrow.
inline testing_support::ChiSquareResult samples_against_pdf(const char* name, const Bsdf& bsdf,
                                                            const SurfaceNormals& normals, Vec3 wo) {
  testing_support::SphereChiSquareTest test;
  test.name = name;
  test.partial = true;
  test.columns = 40;
  test.rows = 40;
  test.points_per_side = 20;
  test.tests_in_program = 100;
  test.sample = [=](int i) -> std::optional<Vec3> {
    const BsdfSample s = sample_bsdf(bsdf, normals, wo, lobe_number(i), direction_numbers(i));
    if (!s.valid || s.specular) return std::nullopt;
    return Vec3{s.wi.z, s.wi.y, s.wi.x};
  };
  test.density = [=](Vec3 d) { return static_cast<double>(pdf_bsdf(bsdf, normals, wo, {d.z, d.y, d.x})); };
  return run_chi_square(test);
}

/// The integral over the sphere of what a function of direction says, by the midpoint rule in cosine and longitude, with
/// `n` heights above and below the plane z = 0.
inline double over_sphere(const std::function<double(Vec3)>& f, int n = 400) {
  double sum = 0;
  for (int i = 0; i < 2 * n; ++i)
    for (int j = 0; j < 2 * n; ++j) {
      const double z = (i + 0.5) / n - 1, a = M_PI * (j + 0.5) / n, r = std::sqrt(1 - z * z);
      sum += f(to_float({r * std::cos(a), r * std::sin(a), z}));
    }
  return sum * M_PI / (static_cast<double>(n) * n);
}

/// What is seen along wo in a furnace: radiance 1 on the near side, index^2 on the far one.
struct Furnace {
  double mean = 0, error = 0;
};
inline Furnace furnace(const Bsdf& bsdf, Vec3 wo, int samples = 100000) {
  const Vec3 n{0, 0, 1};
  double sum = 0, squares = 0;
  for (int i = 0; i < samples; ++i) {
    const BsdfSample s = sample_bsdf(bsdf, {n, n}, wo, lobe_number(i, 9), direction_numbers(i, 9));
    if (!s.valid) continue;
    const bool refracted = s.transmitted && bsdf.kind != BsdfKind::thin_dielectric;
    const double light = refracted ? static_cast<double>(bsdf.relative_index) * bsdf.relative_index : 1;
    sum += static_cast<double>(s.weight.g) * light;
    squares += std::pow(static_cast<double>(s.weight.g) * light, 2);
  }
  const double mean = sum / samples;
  return {mean, std::sqrt(std::max(squares / samples - mean * mean, 0.0) / samples)};
}

/// weight = value / pdf, and the pdf is that of pdf_bsdf, for the samples that are no single directions. Returns how many
/// were so compared; `worst` receives the largest relative deviation of either.
inline int compare_weights(const Bsdf& bsdf, const SurfaceNormals& normals, Vec3 wo, double& worst) {
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const BsdfSample s = sample_bsdf(bsdf, normals, wo, lobe_number(i), direction_numbers(i));
    if (!s.valid || s.specular) continue;
    const Rgb value = eval_bsdf(bsdf, normals, wo, s.wi);
    const double pdf = static_cast<double>(pdf_bsdf(bsdf, normals, wo, s.wi));
    worst = std::max(worst, std::abs(pdf / static_cast<double>(s.pdf) - 1));
    for (int c = 0; c < 3; ++c)
      worst = std::max(worst, std::abs(static_cast<double>(value[c]) / pdf - static_cast<double>(s.weight[c])) /
                                  (static_cast<double>(s.weight[c]) + 1e-3));
    ++compared;
  }
  return compared;
}

}  // namespace embrun::bsdf_measures

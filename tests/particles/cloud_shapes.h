#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "math/vec.h"

namespace embrun::test {

/// Points of a known surface, which `noise` moves along all axes, and its normals where it is nearest to the moved points (on
/// the box: where they were).
struct SampledSurface {
  std::vector<Vec3d> points;
  std::vector<Vec3d> normals;
  std::vector<Vec3d> exact;  ///< the points before noise
};

inline Vec3d random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return normalize(Vec3d{x, y, z});
}

inline void add_noise(SampledSurface& surface, double deviation, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, deviation);
  surface.exact = surface.points;
  for (Vec3d& p : surface.points) {
    const double x = normal(random), y = normal(random), z = normal(random);
    p = p + Vec3d{x, y, z};
  }
}

/// Unit sphere, points independent and uniform.
inline SampledSurface sample_sphere(std::size_t count, double noise, std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  SampledSurface surface;
  for (std::size_t i = 0; i < count; ++i) surface.points.push_back(random_direction(random));
  add_noise(surface, noise, random);
  for (const Vec3d p : surface.points) surface.normals.push_back(normalize(p));
  return surface;
}

/// Torus round the z axis of radii 1 and 0.4: uniform by area through rejection by 1 + 0.4 cos t.
inline SampledSurface sample_torus(std::size_t count, double noise, std::uint64_t seed = 2) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  SampledSurface surface;
  while (surface.points.size() < count) {
    const double s = 2 * 3.14159265358979 * unit(random), t = 2 * 3.14159265358979 * unit(random);
    if (1.4 * unit(random) > 1 + 0.4 * std::cos(t)) continue;
    const Vec3d out{std::cos(s) * std::cos(t), std::sin(s) * std::cos(t), std::sin(t)};
    surface.points.push_back(Vec3d{std::cos(s), std::sin(s), 0} + out * 0.4);
  }
  add_noise(surface, noise, random);
  for (const Vec3d p : surface.points) {
    surface.normals.push_back(normalize(p - normalize(Vec3d{p.x, p.y, 0})));
  }
  return surface;
}

/// The faces of the cube [-1, 1]^3.
inline SampledSurface sample_box(std::size_t count, double noise, std::uint64_t seed = 3) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> side(-1, 1);
  SampledSurface surface;
  for (std::size_t i = 0; i < count; ++i) {
    const double a = side(random), b = side(random), sign = random() % 2 ? 1 : -1;
    const std::size_t axis = random() % 3;
    surface.points.push_back(axis == 0 ? Vec3d{sign, a, b} : axis == 1 ? Vec3d{b, sign, a} : Vec3d{a, b, sign});
    surface.normals.push_back(axis == 0 ? Vec3d{sign, 0, 0} : axis == 1 ? Vec3d{0, sign, 0} : Vec3d{0, 0, sign});
  }
  add_noise(surface, noise, random);
  return surface;
}

}  // namespace embrun::test

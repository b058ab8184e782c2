#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "geometry/splat_tree.h"

// Clouds that the tests of splats share.

namespace embrun {

/// A sphere by an icosahedron whose triangles were divided `steps` times: 10 * 4^steps + 2 points.
inline std::vector<Vec3> icosphere(int steps) {
  const float g = 0.5f * (1.0f + std::sqrt(5.0f));
  std::vector<Vec3> points;
  for (const float a : {-1.0f, 1.0f})
    for (const float b : {-g, g}) {
      points.push_back(normalize(Vec3{0, a, b}));
      points.push_back(normalize(Vec3{a, b, 0}));
      points.push_back(normalize(Vec3{b, 0, a}));
    }
  std::vector<std::array<std::size_t, 3>> triangles;
  for (std::size_t i = 0; i < 12; ++i)
    for (std::size_t j = i + 1; j < 12; ++j)
      for (std::size_t k = j + 1; k < 12; ++k) {
        const auto joined = [&](std::size_t a, std::size_t b) { return length(points[a] - points[b]) < 1.1f; };
        if (joined(i, j) && joined(j, k) && joined(k, i)) triangles.push_back({i, j, k});
      }
  for (int step = 0; step < steps; ++step) {
    std::map<std::array<std::size_t, 2>, std::size_t> middles;
    const auto middle = [&](std::size_t a, std::size_t b) {
      const auto [at, added] = middles.try_emplace({std::min(a, b), std::max(a, b)}, points.size());
      if (added) points.push_back(normalize(points[a] + points[b]));
      return at->second;
    };
    std::vector<std::array<std::size_t, 3>> finer;
    for (const auto& [a, b, c] : triangles) {
      const std::size_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  return points;
}

inline Splat disc(Vec3 center, Vec3 normal, float radius) { return {center, radius, normalize(normal), {}}; }

/// The sphere of 2,562 splats of the thesis.
inline std::vector<Splat> splat_sphere(float radius = 0.055f) {
  std::vector<Splat> splats;
  for (const Vec3& p : icosphere(4)) splats.push_back(disc(p, p, radius));
  return splats;
}

/// An ellipse with the greater half axis along some direction of its plane.
inline Splat ellipse(Vec3 center, Vec3 normal, float major, float minor, float turn) {
  const Frame frame(normalize(normal));
  const Vec3 lesser = std::cos(turn) * frame.s + std::sin(turn) * frame.t;
  return {center, major, frame.n, lesser * std::sqrt(1 / (minor * minor) - 1 / (major * major))};
}

inline SplatSet set_of(const SplatTree& tree, bool closed) {
  SplatSet set;
  set.blocks = tree.blocks.data();
  set.block_count = static_cast<std::uint32_t>(tree.blocks.size());
  set.bounds = tree.bounds;
  set.closed = closed;
  return set;
}

/// Rays from round a box to points in it.
inline std::vector<Ray> rays_at(const Box3& box, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  const Vec3 middle = 0.5f * (box.low + box.high);
  const float reach = 0.5f * length(box.high - box.low);
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    Vec3 from{unit(random), unit(random), unit(random)};
    while (length(from) > 1 || length(from) < 0.1f) from = {unit(random), unit(random), unit(random)};
    ray.origin = middle + 2.5f * reach * normalize(from);
    const Vec3 to = middle + 0.6f * reach * Vec3{unit(random), unit(random), unit(random)};
    ray.direction = normalize(to - ray.origin);
  }
  return rays;
}

/// A scanned cloud (binary little-endian PLY of x y z nx ny nz) of the folder that EMBRUN_CLOUD_DATA names, all splats of
/// one radius; empty where it is not there.
inline std::vector<Splat> scanned_cloud(const std::string& name, float radius) {
  const char* folder = std::getenv("EMBRUN_CLOUD_DATA");
  if (folder == nullptr) return {};
  std::ifstream file(std::string(folder) + "/" + name, std::ios::binary);
  std::size_t count = 0;
  for (std::string line; std::getline(file, line) && line != "end_header";)
    if (line.rfind("element vertex ", 0) == 0) count = std::stoul(line.substr(15));
  std::vector<Splat> splats;
  for (std::size_t i = 0; i < count; ++i) {
    float v[6];
    if (!file.read(reinterpret_cast<char*>(v), sizeof v)) return {};
    splats.push_back(disc({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, radius));
  }
  return splats;
}

#define EMBRUN_SKIP_WITHOUT(cloud, name) \
  if ((cloud).empty()) GTEST_SKIP() << "EMBRUN_CLOUD_DATA names no folder with " << (name)

}  // namespace embrun

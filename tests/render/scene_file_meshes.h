#pragma once

#include <array>
#include <cstring>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "math/vec.h"

// The meshes that the reference renderers' scene files name, made anew.

namespace embrun::testing_support {

/// A mesh as a PLY file.
inline std::string ply_of(const std::vector<Vec3d>& positions, const std::vector<std::array<int, 3>>& triangles) {
  std::ostringstream out;
  out << "ply\nformat ascii 1.0\nelement vertex " << positions.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << triangles.size()
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3d& p : positions) out << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (const auto& t : triangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  return out.str();
}

/// The light or dark cells of the references' floor, as a mesh that is seen from above.
inline std::string floor_ply(double extent, double cell, bool light) {
  std::vector<Vec3d> positions;
  std::vector<std::array<int, 3>> triangles;
  const int half = static_cast<int>(extent / cell);
  for (int i = -half; i < half; ++i)
    for (int j = -half; j < half; ++j) {
      if (((i + j) % 2 == 0) != light) continue;
      const int first = static_cast<int>(positions.size());
      for (const auto& [a, b] : {std::pair{0, 0}, {0, 1}, {1, 1}, {1, 0}})
        positions.push_back({(i + a) * cell, -0.05, (j + b) * cell});
      triangles.push_back({first, first + 1, first + 2});
      triangles.push_back({first, first + 2, first + 3});
    }
  return ply_of(positions, triangles);
}

/// A closed box.
inline std::string box_ply(Vec3d low, Vec3d high) {
  std::vector<Vec3d> positions;
  for (int i = 0; i < 8; ++i)
    positions.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  return ply_of(positions, {{0, 4, 6},
                            {0, 6, 2},
                            {1, 3, 7},
                            {1, 7, 5},
                            {0, 1, 5},
                            {0, 5, 4},
                            {2, 6, 7},
                            {2, 7, 3},
                            {0, 2, 3},
                            {0, 3, 1},
                            {4, 5, 7},
                            {4, 7, 6}});
}

inline std::vector<std::byte> bytes_of(const std::string& text) {
  std::vector<std::byte> bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

}  // namespace embrun::testing_support

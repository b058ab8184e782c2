#include "reproduction/sphere_splats.h"

#include <cmath>
#include <cstddef>

namespace embrun {

std::vector<Splat> sphere_splats() {
  // The points of the divided icosahedron, found by its edges' middles.
  const float g = 0.5f * (1 + std::sqrt(5.0f));
  std::vector<Vec3> corners;
  for (const float a : {-1.0f, 1.0f})
    for (const float b : {-g, g}) corners.insert(corners.end(), {Vec3{0, a, b}, Vec3{a, b, 0}, Vec3{b, 0, a}});
  std::vector<Splat> splats;
  const auto add = [&](Vec3 p) {
    const Vec3 n = normalize(p);
    for (const Splat& s : splats)
      if (length_squared(s.center - n) < 1e-6f) return;
    splats.push_back({n, 0.055f, n, {}});
  };
  // Four divisions by halves, each projected to the sphere, as the triangles of the usual icosphere are.
  const auto divide = [&](const auto& self, Vec3 a, Vec3 b, Vec3 c, int depth) -> void {
    if (depth == 0) {
      add(a), add(b), add(c);
      return;
    }
    const Vec3 ab = normalize(a + b), bc = normalize(b + c), ca = normalize(c + a);
    self(self, a, ab, ca, depth - 1);
    self(self, ab, b, bc, depth - 1);
    self(self, ca, bc, c, depth - 1);
    self(self, ab, bc, ca, depth - 1);
  };
  for (std::size_t i = 0; i < corners.size(); ++i)
    for (std::size_t j = i + 1; j < corners.size(); ++j)
      for (std::size_t k = j + 1; k < corners.size(); ++k) {
        const auto joined = [&](std::size_t a, std::size_t b) { return length(corners[a] - corners[b]) < 2.1f; };
        if (joined(i, j) && joined(j, k) && joined(k, i))
          divide(divide, normalize(corners[i]), normalize(corners[j]), normalize(corners[k]), 4);
      }
  return splats;
}

}  // namespace embrun

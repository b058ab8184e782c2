#include "scene/tank.h"

#include <algorithm>
#include <array>

#include "base/error.h"

namespace embrun {
namespace {

/// The corner of a box whose bits say which sides are high: 1 x, 2 y, 4 z.
Vec3 corner(const Box3d& box, Vec3d middle, unsigned bits) {
  return to_float(
      Vec3d{bits & 1 ? box.high.x : box.low.x, bits & 2 ? box.high.y : box.low.y, bits & 4 ? box.high.z : box.low.z} -
      middle);
}

}  // namespace

MeshDescription make_tank(const Box3d& inside, double thickness, UpAxis up, const MaterialDescription& material) {
  MeshDescription tank;
  tank.material = material;
  // About its middle, as the mesh's coordinates are in single precision.
  tank.placement.origin = 0.5 * (inside.low + inside.high);
  const Vec3d wall{thickness, thickness, thickness};
  Box3d outside{inside.low - wall, inside.high + wall};
  const int up_index = up == UpAxis::y ? 1 : 2;
  (up == UpAxis::y ? outside.high.y : outside.high.z) = up == UpAxis::y ? inside.high.y : inside.high.z;
  for (const Box3d& box : {outside, inside})
    for (unsigned bits = 0; bits < 8; ++bits) tank.mesh.positions.push_back(corner(box, tank.placement.origin, bits));

  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    tank.mesh.triangles.push_back({a, b, c});
    tank.mesh.triangles.push_back({a, c, d});
  };
  for (unsigned axis = 0; axis < 3; ++axis) {
    // With the next two axes it is right-handed.
    const unsigned n = 1u << axis, u = 1u << (axis + 1) % 3, v = 1u << (axis + 2) % 3;
    const bool vertical = static_cast<int>(axis) == up_index;
    quad(0, v, u + v, u);
    if (!vertical) quad(n, n + u, n + u + v, n + v);
    // The inner faces are seen from within.
    quad(8, 8 + u, 8 + u + v, 8 + v);
    if (!vertical) quad(8 + n, 8 + n + v, 8 + n + u + v, 8 + n + u);
    if (!vertical) continue;
    // The rim, between the two open tops.
    const std::array<unsigned, 4> round = {n, n + u, n + u + v, n + v};
    for (std::size_t i = 0; i < 4; ++i) {
      const unsigned a = round[i], b = round[(i + 1) % 4];
      quad(a, b, 8 + b, 8 + a);
    }
  }
  return tank;
}

void press_into_walls(FluidDescription& fluid, double thickness) {
  EMBRUN_CHECK(fluid.container.has_value());
  fluid.wall_overlap = std::min(0.5 * thickness, 0.25 * static_cast<double>(fluid.surface.radius));
}

}  // namespace embrun

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "math/vec.h"

namespace embrun {

/// An indexed triangle mesh in its own space, metres.
struct TriangleMesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;  ///< unit, one per position; empty: the mesh is flat-shaded
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Vec2> coordinates;  ///< (u, v) of textures, one per position; empty: it has none

  bool operator==(const TriangleMesh&) const = default;
};

}  // namespace embrun

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "math/vec.h"

namespace embrun {

/// Whether splats bound a body.
struct CloudClosedness {
  bool closed = false;
  /// Of all that is seen of the splats from all around, the share where their backs stand in front: through a hole one
  /// sees the inside. Strips as narrow as a splat do not count: there splats reach over an edge.
  double open_share = 0;

  static constexpr double most_open = 1e-4;  ///< of a closed cloud
};

/// Of a great cloud every so manieth splat is looked at, grown to cover as much.
struct SplatThinning {
  std::size_t step = 1;
  float growth = 1;  ///< of radii

  explicit SplatThinning(std::size_t splats);
};

/// Looks at the splats (discs) from 32 directions spread over the sphere, without perspective, and asks for fronts
/// everywhere. A hole is seen where it is wider than about six splat radii, or 1/85 of the cloud. `order` lists all
/// points so that those near each other stand together (PointTree::order): a great cloud is thinned along it, see
/// SplatThinning.
CloudClosedness look_for_holes(std::span<const Vec3d> points, std::span<const Vec3> normals,
                               std::span<const float> radii, std::span<const std::uint32_t> order);

}  // namespace embrun

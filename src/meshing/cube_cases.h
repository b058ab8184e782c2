#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace embrun {

/// Marching cubes' 256 cases [LorensenCline1987], derived by program and free of cracks: on every face the segments
/// are those round each run of inside corners (so an ambiguous face separates its two), which both cells that share
/// the face see alike; the segments close to loops; and a loop is cut into triangles by diagonals that never lie in a
/// face. So every edge of the mesh belongs to exactly two triangles.
///
/// Corner c of a cell is at (c & 1, c >> 1 & 1, c >> 2 & 1); bit c of a case says that it is inside. Edge 4 a + k runs
/// along axis a from the corner whose other two coordinates, in rising order of axis, are k & 1 and k >> 1.
class CubeCases {
 public:
  using Triangle = std::array<std::uint8_t, 3>;  ///< edges; counter-clockwise seen from outside the body

  CubeCases();
  const std::vector<Triangle>& of(unsigned corner_bits) const { return triangles_[corner_bits]; }

 private:
  std::array<std::vector<Triangle>, 256> triangles_;
};

const CubeCases& cube_cases();

/// The corner from which an edge runs along its axis (edge >> 2).
constexpr unsigned edge_base_corner(unsigned edge) {
  const unsigned axis = edge >> 2;
  const unsigned first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
  return (edge & 1u) << first | (edge >> 1 & 1u) << second;
}

}  // namespace embrun

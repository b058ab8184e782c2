#include "meshing/cube_cases.h"

#include <limits>

namespace embrun {

namespace {

unsigned edge_between(unsigned a, unsigned b) {
  const unsigned base = a < b ? a : b;
  const unsigned axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  const unsigned first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
  return axis * 4 + (base >> first & 1u) + 2 * (base >> second & 1u);
}

/// Corners of the six faces, counter-clockwise seen from outside the cell.
std::array<std::array<unsigned, 4>, 6> make_faces() {
  std::array<std::array<unsigned, 4>, 6> faces{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    const unsigned u = (axis + 1) % 3, v = (axis + 2) % 3;
    const std::array<unsigned, 4> turn{0, 1u << u, 1u << u | 1u << v, 1u << v};
    for (unsigned i = 0; i < 4; ++i) {
      faces[2 * axis + 1][i] = turn[i] | 1u << axis;
      faces[2 * axis][i] = turn[3 - i];
    }
  }
  return faces;
}

bool on_common_face(unsigned edge_a, unsigned edge_b) {
  const unsigned a0 = edge_base_corner(edge_a), a1 = a0 | 1u << (edge_a >> 2);
  const unsigned b0 = edge_base_corner(edge_b), b1 = b0 | 1u << (edge_b >> 2);
  // On a face all four corners agree in one coordinate.
  return ((a0 & a1 & b0 & b1) | (~a0 & ~a1 & ~b0 & ~b1 & 7u)) != 0;
}

/// Cuts loop[first..last] into triangles with as few diagonals in faces as possible; returns their number.
int cut_polygon(const std::vector<unsigned>& loop, std::size_t first, std::size_t last,
                std::vector<CubeCases::Triangle>& triangles) {
  if (last - first < 2) return 0;
  int least = std::numeric_limits<int>::max();
  std::vector<CubeCases::Triangle> best;
  for (std::size_t middle = first + 1; middle < last; ++middle) {
    std::vector<CubeCases::Triangle> parts;
    int in_faces = cut_polygon(loop, first, middle, parts) + cut_polygon(loop, middle, last, parts);
    // Sides of the loop lie in faces by right.
    if (middle > first + 1) in_faces += on_common_face(loop[first], loop[middle]);
    if (middle + 1 < last) in_faces += on_common_face(loop[middle], loop[last]);
    if (in_faces >= least) continue;
    least = in_faces;
    parts.push_back({static_cast<std::uint8_t>(loop[first]), static_cast<std::uint8_t>(loop[middle]),
                     static_cast<std::uint8_t>(loop[last])});
    best.swap(parts);
  }
  triangles.insert(triangles.end(), best.begin(), best.end());
  return least;
}

std::vector<CubeCases::Triangle> triangulate(unsigned corner_bits) {
  static const std::array<std::array<unsigned, 4>, 6> faces = make_faces();
  const auto inside = [corner_bits](unsigned corner) { return (corner_bits >> corner & 1u) != 0; };

  // On each face, one segment round each run of inside corners: from the edge that enters it to the edge that leaves.
  constexpr unsigned none = 12;
  std::array<unsigned, 12> next;
  next.fill(none);
  for (const std::array<unsigned, 4>& face : faces) {
    for (unsigned i = 0; i < 4; ++i) {
      if (inside(face[i]) || !inside(face[(i + 1) % 4])) continue;
      unsigned end = (i + 1) % 4;
      while (inside(face[(end + 1) % 4])) end = (end + 1) % 4;
      next[edge_between(face[i], face[(i + 1) % 4])] = edge_between(face[end], face[(end + 1) % 4]);
    }
  }

  // The segments close to loops.
  std::vector<CubeCases::Triangle> triangles;
  for (unsigned start = 0; start < 12; ++start) {
    if (next[start] == none) continue;
    std::vector<unsigned> loop;
    for (unsigned edge = start; next[edge] != none;) {
      loop.push_back(edge);
      const unsigned following = next[edge];
      next[edge] = none;
      edge = following;
    }
    cut_polygon(loop, 0, loop.size() - 1, triangles);
  }
  return triangles;
}

}  // namespace

CubeCases::CubeCases() {
  for (unsigned bits = 0; bits < 256; ++bits) triangles_[bits] = triangulate(bits);
}

const CubeCases& cube_cases() {
  static const CubeCases cases;
  return cases;
}

}  // namespace embrun

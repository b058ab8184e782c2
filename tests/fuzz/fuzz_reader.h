#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "base/error.h"
#include "geometry/triangle_mesh.h"
#include "particles/particle_set.h"

namespace embrun::fuzz {

/// Ends the run as a finding.
inline void require(bool condition) {
  if (!condition) std::abort();
}

inline void check(const ParticleSet& set) {
  require(set.size() > 0);
  for (const Vec3d p : set.positions) require(std::abs(p.x) <= 1e15 && std::abs(p.y) <= 1e15 && std::abs(p.z) <= 1e15);
  for (const Attribute& attribute : set.attributes) {
    require(attribute.components > 0);
    require(attribute.value_count() == set.size() * static_cast<std::size_t>(attribute.components));
    for (const float value : attribute.floats) require(is_finite(value));
    require(set.find(attribute.name) == &attribute);  // reachable
  }
}

inline void check(const TriangleMesh& mesh) {
  require(!mesh.triangles.empty());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) require(corner < mesh.positions.size());
  }
  for (const Vec3 p : mesh.positions) require(is_finite(p));
  require(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
  for (const Vec3 n : mesh.normals) require(std::abs(length(n) - 1) < 1e-4f);
}

/// Reads the input: the result must be sound, or there must be one Error that begins with the file's name.
template <class Reader>
int run(const std::uint8_t* data, std::size_t size, const Reader& reader) {
  constexpr std::string_view name = "input";
  try {
    check(reader(std::as_bytes(std::span(data, size)), name));
  } catch (const Error& error) {
    require(std::string_view(error.what()).starts_with("input: "));
  }
  return 0;
}

}  // namespace embrun::fuzz

#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace embrun {

/// Of a binary, little-endian PLY file of so many vertices; a property is its type and its name.
inline std::string ply_header(std::uint64_t count, const std::vector<std::string>& properties) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) + "\n";
  for (const std::string& property : properties) header += "property " + property + "\n";
  return header + "end_header\n";
}

}  // namespace embrun

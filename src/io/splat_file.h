#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "geometry/splat_hierarchy.h"

// Files of a cloud's splats with their levels of detail (.splats): what rays touch, as it lies in memory, so that a cloud is
// mapped and not read, and only the parts that rays come by are ever in memory.
//
// A head of 64 bytes (magic "EMBRUNSP", version, byte order mark); then without gaps but for alignment to 64 bytes the
// blocks of splats, those of stand-ins, the colours of both in the same order (where there are any), the nodes; then
// SplatFileTail. Little-endian.

namespace embrun {

inline constexpr std::string_view splat_file_magic = "EMBRUNSP";
inline constexpr std::size_t splat_file_alignment = 64;

/// The first bytes of a file.
struct SplatFileHead {
  char magic[8] = {};
  std::uint32_t version = 1, byte_order = 0x01020304;
  std::byte unused[48] = {};
};

/// The last bytes of a file.
struct SplatFileTail {
  std::uint64_t splat_count = 0;
  std::uint32_t splat_blocks = 0, node_count = 0;
  std::uint32_t has_colors = 0, closed = 0;
  double center[3] = {};
  float low[3] = {}, high[3] = {};  ///< bounds, relative to the centre
  float median_radius = 0;
  std::uint32_t unused = 0;
  char magic[8] = {};
};

/// True when a file begins as files of splats do. False for what is none, or cannot be opened.
bool is_splat_file(const std::string& path);

/// Maps a file. Sizes and links are checked, so that no search leaves the arrays or goes on for ever, whatever the file
/// holds; splats are not looked at. Throws Error, naming the file and the place.
std::shared_ptr<const SplatHierarchy> open_splat_file(const std::string& path);

/// The same of a file in memory, which must lie at a multiple of 64 bytes and stay.
SplatHierarchy view_splat_file(std::span<const std::byte> file, std::string_view name);

}  // namespace embrun

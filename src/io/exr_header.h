#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace embrun {

/// Walks the header of an OpenEXR file before OpenEXR sees it: every attribute lies inside the file, the picture has
/// at most 2^28 pixels, and neither it nor a tile is larger than the file's length can justify (OpenEXR takes
/// memory by what the header says). Throws Error that names the file; deep files are refused.
void check_exr_header(std::span<const std::byte> bytes, const std::string& file);

}  // namespace embrun

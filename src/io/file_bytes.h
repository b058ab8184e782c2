#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace embrun {

/// All bytes of a regular file. Throws Error naming the path when it is missing, a directory or another thing that
/// is no regular file, unreadable, or changes size while it is read.
std::vector<std::byte> read_file_bytes(const std::string& path);

}  // namespace embrun

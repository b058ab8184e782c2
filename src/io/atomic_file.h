#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>

namespace embrun {

/// Writes a whole file so that its name holds either the old content or all of the new one, whatever happens: the
/// bytes go to a temporary file in the same folder, are flushed to the disk, and the temporary is renamed. A
/// symbolic link is followed. On failure the temporary is removed and an Error says the path and why (no such
/// folder, no permission, disk full, ...).
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// The same as write_file_atomically for what is made piece by piece: `fill` hands them to the sink it is given, in order.
using ByteSink = std::function<void(std::span<const std::byte> bytes)>;
void stream_file_atomically(const std::filesystem::path& path, const std::function<void(const ByteSink& sink)>& fill);

/// Throws Error when write_file_atomically(path, ...) could not succeed as things are: the folder is missing or is
/// no folder or cannot be written to, or the path is itself a folder. For use before hours of rendering.
void check_writable(const std::filesystem::path& path);

}  // namespace embrun

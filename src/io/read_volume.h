#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace embrun {

/// Numbers on a grid of cells, as a file has them: they may be negative or not finite.
struct VolumeFile {
  int nx = 0, ny = 0, nz = 0;
  int channels = 1;           ///< 1 or 3
  std::vector<float> values;  ///< [((z ny + y) nx + x) channels + channel]
  /// The box that the file says the cells fill, x, y, z each. Often it says nothing sensible.
  double low[3]{0, 0, 0}, high[3]{1, 1, 1};
};

/// A grid in Mitsuba's binary format (.vol, version 3): single-precision numbers, or bytes, whose 255 is 1. May be gzipped.
/// Throws Error, naming the file and the offset, for anything else: other encodings, numbers of channels but 1 and 3, a
/// file that is shorter or longer than its grid.
VolumeFile read_volume_from_memory(std::span<const std::byte> file, std::string_view name);

}  // namespace embrun

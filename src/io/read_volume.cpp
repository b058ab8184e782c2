#include "io/read_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include "io/byte_stream.h"
#include "io/column.h"

namespace embrun {
namespace {

enum Encoding : std::int64_t { float_encoding = 1, byte_encoding = 3 };
constexpr std::int64_t most_cells_a_side = 1 << 20;

std::int64_t read_integer(ByteStream& stream, std::string_view what) {
  std::array<std::byte, 4> bytes;
  stream.read(bytes, what);
  return load_integer(bytes.data(), ScalarType::int32, false);
}

int read_size(ByteStream& stream, std::string_view what) {
  const std::int64_t size = read_integer(stream, what);
  if (size < 1 || size > most_cells_a_side)
    stream.fail(what, fmt::format("{} is not in [1, {}]", size, most_cells_a_side));
  return static_cast<int>(size);
}

/// Little-endian floats.
void read_floats(ByteStream& stream, std::span<float> out, std::string_view what) {
  stream.read(std::as_writable_bytes(out), what);
}

void read_box(ByteStream& stream, VolumeFile& volume) {
  std::array<float, 6> box;
  read_floats(stream, box, "bounding box");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    volume.low[axis] = static_cast<double>(box[axis]);
    volume.high[axis] = static_cast<double>(box[axis + 3]);
  }
}

/// Bytes in turn, a block at a time.
void read_bytes_as_shares(ByteStream& stream, std::span<float> out) {
  std::array<std::byte, 4096> block;
  for (std::size_t done = 0; done < out.size();) {
    const std::size_t count = std::min(block.size(), out.size() - done);
    stream.read(std::span(block).first(count), "cells");
    for (std::size_t i = 0; i < count; ++i)
      out[done + i] = static_cast<float>(std::to_integer<unsigned>(block[i])) * (1.0f / 255);
    done += count;
  }
}

}  // namespace

VolumeFile read_volume_from_memory(std::span<const std::byte> file, std::string_view name) {
  static_assert(std::endian::native == std::endian::little, "floats are read as they are");
  ByteStream stream(file, name);
  std::array<char, 4> magic{};
  stream.read(std::as_writable_bytes(std::span(magic)), "header");
  if (std::memcmp(magic.data(), "VOL", 3) != 0)
    stream.fail("header", "this is not the start of a volume grid (\"VOL\")");
  if (magic[3] != 3)
    stream.fail("version", fmt::format("{} is not supported, only 3", static_cast<unsigned char>(magic[3])));
  const std::int64_t encoding = read_integer(stream, "encoding");
  if (encoding != float_encoding && encoding != byte_encoding)
    stream.fail("encoding", fmt::format("{} is not supported: there are 1 (float32) and 3 (uint8)", encoding));

  VolumeFile volume;
  volume.nx = read_size(stream, "cells along x");
  volume.ny = read_size(stream, "cells along y");
  volume.nz = read_size(stream, "cells along z");
  const std::int64_t channels = read_integer(stream, "channels");
  if (channels != 1 && channels != 3)
    stream.fail("channels", fmt::format("{} are not supported: there are 1 and 3", channels));
  volume.channels = static_cast<int>(channels);
  read_box(stream, volume);

  const std::uint64_t rows = static_cast<std::uint64_t>(volume.ny) * static_cast<std::uint64_t>(volume.nz);
  const std::uint64_t row = static_cast<std::uint64_t>(volume.nx) * static_cast<std::uint64_t>(channels);
  stream.require(rows, row * (encoding == float_encoding ? 4 : 1), "cells");
  volume.values.resize(rows * row);
  if (encoding == float_encoding)
    read_floats(stream, volume.values, "cells");
  else
    read_bytes_as_shares(stream, volume.values);
  std::byte more;
  if (stream.read_some(std::span(&more, 1)) > 0) stream.fail("cells", "the file goes on behind the last of them");
  return volume;
}

}  // namespace embrun

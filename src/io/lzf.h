#pragma once

#include <cstddef>
#include <span>

namespace embrun {

/// The most bytes that a byte packed by LZF may stand for: a reference of three bytes copies up to 264.
inline constexpr std::size_t most_lzf_expansion = 88;

/// Unpacks LZF (Marc Lehmann's format, as in PCD files) into all of `unpacked`. A control byte c < 32 is followed by
/// c + 1 bytes as they are; any other copies (c >> 5) + 2 bytes from (c & 31) * 256 + 1 + the last byte of the
/// reference back, where a length field of 7 has the next byte added. False when the data are damaged: they end within a
/// reference, reach back before the start, or do not fill `unpacked` exactly.
bool unpack_lzf(std::span<const std::byte> packed, std::span<std::byte> unpacked);

}  // namespace embrun

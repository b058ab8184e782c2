#include "io/lzf.h"

#include <algorithm>

namespace embrun {

bool unpack_lzf(std::span<const std::byte> packed, std::span<std::byte> unpacked) {
  std::size_t in = 0, out = 0;
  while (in < packed.size()) {
    const std::size_t control = std::to_integer<std::size_t>(packed[in++]);
    if (control < 32) {
      const std::size_t count = control + 1;
      if (count > packed.size() - in || count > unpacked.size() - out) return false;
      std::copy_n(packed.data() + in, count, unpacked.data() + out);
      in += count;
      out += count;
      continue;
    }
    std::size_t count = (control >> 5) + 2;
    if (control >> 5 == 7) {
      if (in == packed.size()) return false;
      count += std::to_integer<std::size_t>(packed[in++]);
    }
    if (in == packed.size()) return false;
    const std::size_t back = (control & 31) * 256 + 1 + std::to_integer<std::size_t>(packed[in++]);
    if (back > out || count > unpacked.size() - out) return false;
    // Byte by byte: the source may reach into what is being written, which repeats it.
    for (const std::size_t end = out + count; out < end; ++out) unpacked[out] = unpacked[out - back];
  }
  return out == unpacked.size();
}

}  // namespace embrun

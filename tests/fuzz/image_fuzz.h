#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "base/error.h"
#include "io/image_formats.h"

namespace embrun {

/// Runs one picture reader on the fuzzer's bytes: an Error is a proper answer, anything else that is thrown is not,
/// and a picture must have the pixels that its size says.
template <class Decode>
int fuzz_picture(const std::uint8_t* data, std::size_t size, const Decode& decode) {
  try {
    const Image image = decode(std::as_bytes(std::span(data, size)));
    if (image.pixels.size() != image.pixel_count() * static_cast<std::size_t>(image.channels)) {
      std::abort();
    }
  } catch (const Error&) {
  }
  return 0;
}

}  // namespace embrun

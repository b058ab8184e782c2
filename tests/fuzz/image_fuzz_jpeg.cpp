#include "fuzz/image_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return embrun::fuzz_picture(data, size, [](embrun::Bytes bytes) { return embrun::decode_jpeg(bytes, "fuzz"); });
}

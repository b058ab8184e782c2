#include "fuzz_reader.h"
#include "io/particle_readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return embrun::fuzz::run(data, size, embrun::read_pcd);
}

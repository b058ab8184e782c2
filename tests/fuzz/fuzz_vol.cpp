#include "fuzz_reader.h"
#include "io/read_volume.h"

namespace embrun {

/// Found by the type of its argument.
inline void check(const VolumeFile& volume) {
  fuzz::require(volume.nx > 0 && volume.ny > 0 && volume.nz > 0 && (volume.channels == 1 || volume.channels == 3));
  fuzz::require(volume.values.size() == static_cast<std::size_t>(volume.nx) * static_cast<std::size_t>(volume.ny) *
                                            static_cast<std::size_t>(volume.nz) *
                                            static_cast<std::size_t>(volume.channels));
}

}  // namespace embrun

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return embrun::fuzz::run(data, size, embrun::read_volume_from_memory);
}

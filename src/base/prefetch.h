#pragma once

#include <cstddef>

#include "base/host_device.h"

namespace embrun {

/// Asks for what lies at an address, long before it is read.
EMBRUN_FN void prefetch([[maybe_unused]] const void* address) {
#if !defined(__CUDA_ARCH__)
  __builtin_prefetch(address);
#endif
}
EMBRUN_FN void prefetch_range(const void* from, std::size_t bytes) {
  for (std::size_t at = 0; at < bytes; at += 64) prefetch(static_cast<const char*>(from) + at);
}

}  // namespace embrun

#pragma once

#include <cstdint>

#include "base/host_device.h"

namespace embrun {

/// The next larger number after one that is not negative.
EMBRUN_FN float next_float(float v) {
  std::uint32_t bits;
  __builtin_memcpy(&bits, &v, sizeof bits);
  ++bits;
  __builtin_memcpy(&v, &bits, sizeof bits);
  return v;
}

}  // namespace embrun

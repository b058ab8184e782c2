#pragma once

#include <cstdint>

#include "base/host_device.h"

namespace embrun {

/// Bijective 64-bit mixer (David Stafford's variant 13 of the MurmurHash3 finaliser) [Steele2014].
EMBRUN_FN uint64_t mix_bits(uint64_t v) {
  v ^= v >> 30;
  v *= 0xbf58476d1ce4e5b9ull;
  v ^= v >> 27;
  v *= 0x94d049bb133111ebull;
  v ^= v >> 31;
  return v;
}

/// Order-dependent hash of four 32-bit words.
EMBRUN_FN uint64_t hash_words(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  const uint64_t first = mix_bits((static_cast<uint64_t>(b) << 32 | a) + 0x9e3779b97f4a7c15ull);
  return mix_bits(first + (static_cast<uint64_t>(d) << 32 | c) * 0xd1342543de82ef95ull);
}

EMBRUN_FN uint32_t low_word(uint64_t v) { return static_cast<uint32_t>(v); }
EMBRUN_FN uint32_t high_word(uint64_t v) { return static_cast<uint32_t>(v >> 32); }

/// Uniform float in [0, 1) from the upper 24 bits: every value is exact, 1 is never reached.
EMBRUN_FN float unit_float(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

EMBRUN_FN uint32_t reverse_bits(uint32_t v) {
#if defined(__CUDA_ARCH__)
  return __brev(v);
#else
  v = (v >> 1 & 0x55555555u) | (v & 0x55555555u) << 1;
  v = (v >> 2 & 0x33333333u) | (v & 0x33333333u) << 2;
  v = (v >> 4 & 0x0f0f0f0fu) | (v & 0x0f0f0f0fu) << 4;
  return __builtin_bswap32(v);
#endif
}

}  // namespace embrun

#pragma once

#include <cstdint>

#include "sampling/hash.h"

namespace embrun {

/// Second coordinate of the Sobol (0,2)-sequence, with its bits reversed (the first coordinate, reversed, is
/// the index itself). Its generator is the Pascal matrix modulo 2 [Sobol1967], the fifth Kronecker power of
/// ((1, 1), (0, 1)), so the product is five shift-and-xor steps, one per factor.
EMBRUN_FN uint32_t sobol_second_reversed(uint32_t index) {
  index ^= index >> 1 & 0x55555555u;
  index ^= index >> 2 & 0x33333333u;
  index ^= index >> 4 & 0x0f0f0f0fu;
  index ^= index >> 8 & 0x00ff00ffu;
  index ^= index >> 16;
  return index;
}

/// Owen scrambling of a number whose bits are reversed: each bit is flipped by a hash of the bits below it
/// (the more significant digits of the number) and `seed`. Construction of [Laine2011], used as in
/// [Burley2020], with the multipliers that [Vegdahl2021] found by optimisation.
EMBRUN_FN uint32_t owen_scramble_reversed(uint32_t v, uint32_t seed) {
  v ^= v * 0x3d20adeau;
  v += seed;
  v *= seed >> 16 | 1u;
  v ^= v * 0x05526c56u;
  v ^= v * 0x53a22864u;
  return v;
}

/// Permutes the order of a sequence so that every aligned block of 2^k indices stays one: shuffled sequences
/// keep their stratification and are independent of each other [Burley2020].
EMBRUN_FN uint32_t owen_shuffle(uint32_t index, uint32_t seed) {
  return reverse_bits(owen_scramble_reversed(reverse_bits(index), seed));
}

}  // namespace embrun

#pragma once

#include "sampling/sampler.h"

namespace embrun {

/// As many independent uniform numbers as a loop of unknown length needs, a pure function of whose they are: the vertex of
/// a path, the named dimension and, for several streams of one name, their number.
struct RandomStream {
  std::uint64_t state = 0;

  RandomStream() = default;
  EMBRUN_FN RandomStream(SampleKey key, Dimension dimension, std::uint32_t number = 0)
      : state(hash_words(key.seed, key.pixel, static_cast<std::uint32_t>(dimension) << 16 ^ key.bounce, key.sample) +
              mix_bits(number + 1ull)) {}

  /// Two uniform numbers in [0, 1).
  EMBRUN_FN Sample2 next_pair() {
    state += 0x9e3779b97f4a7c15ull;
    const std::uint64_t bits = mix_bits(state);
    return {unit_float(low_word(bits)), unit_float(high_word(bits))};
  }
};

}  // namespace embrun

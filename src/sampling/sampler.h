#pragma once

#include <cstdint>

#include "sampling/hash.h"
#include "sampling/sobol.h"

namespace embrun {

/// A point of the unit square [0, 1)^2.
struct Sample2 {
  float x = 0, y = 0;
};

/// Who draws a random number. One name, one use: two stages never share numbers. The values are part of what
/// a seed means, so new ones are appended and old ones never renumbered.
enum class Dimension : uint32_t {
  camera_film = 0,       ///< 2D: place in the pixel's filter
  camera_lens = 1,       ///< 2D: place on the aperture
  time = 2,              ///< 1D: moment of the shutter interval
  bsdf_lobe = 3,         ///< 1D: reflection or transmission
  bsdf_direction = 4,    ///< 2D: direction within the lobe
  light_choice = 5,      ///< 1D: which light
  light_position = 6,    ///< 2D: where on the light
  roulette = 7,          ///< 1D: Russian roulette
  free_flight = 8,       ///< 1D: optical depth of the next collision
  phase_direction = 9,   ///< 2D: direction from a phase function
  channel = 10,          ///< 1D: colour channel that drives a choice
  medium_choice = 11,    ///< 1D: which medium of a mixture collides
  tracking = 12,         ///< stream: tentative collisions of a flight
  shadow_tracking = 13,  ///< stream: those of a shadow ray
  on_the_way = 14,       ///< stream: a point on the way that a lamp lights, and its light
};

enum class SamplerKind : uint8_t {
  independent,  ///< uniform, independent numbers by hashing
  sobol,        ///< Owen-scrambled Sobol (0,2)-sequence per dimension, padded
};

/// Names one sample's vertex. Every random number is a pure function of this and the dimension, so any sample
/// of any pixel can be replayed alone, on any thread or machine.
struct SampleKey {
  uint32_t seed = 0;
  uint32_t pixel = 0;   ///< index in the full frame, y * width + x, whatever the crop
  uint32_t sample = 0;  ///< index within the pixel, from 0
  uint32_t bounce = 0;  ///< vertex of the path, 0 for the camera
};

/// Two uniform numbers in [0, 1). With `sobol`, samples 0 .. 2^k - 1 of one (seed, pixel, bounce, dimension) have
/// exactly one point in each elementary interval of area 2^-k.
EMBRUN_FN Sample2 sample_2d(SamplerKind kind, SampleKey key, Dimension dimension) {
  const uint32_t use = static_cast<uint32_t>(dimension) << 16 ^ key.bounce;
  if (kind == SamplerKind::independent) {
    const uint64_t bits = hash_words(key.seed, key.pixel, use, key.sample);
    return {unit_float(low_word(bits)), unit_float(high_word(bits))};
  }
  const uint64_t seeds = hash_words(key.seed, key.pixel, use, 0x5be0cd19u);
  const uint32_t second_seed = high_word(seeds * 0x9e3779b97f4a7c15ull);
  const uint32_t index = owen_shuffle(key.sample, low_word(seeds));
  return {unit_float(reverse_bits(owen_scramble_reversed(index, high_word(seeds)))),
          unit_float(reverse_bits(owen_scramble_reversed(sobol_second_reversed(index), second_seed)))};
}

/// One uniform number in [0, 1); with `sobol`, samples 0 .. 2^k - 1 have one in each interval of length 2^-k.
EMBRUN_FN float sample_1d(SamplerKind kind, SampleKey key, Dimension dimension) {
  return sample_2d(kind, key, dimension).x;
}

}  // namespace embrun

#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "math/vec.h"

namespace embrun {

// Particles in the lists of an implicit surface's cells, eight by eight. Positions are relative to the middle of the list's
// box.

/// A position on a list's lattice in 64 bits: x and y at the top of the two numbers, in 21 bits each, and below them z, its
/// lowest 11 bits in the first and the rest, with its sign, in the second.
struct PackedPosition {
  std::int32_t xz, yz;
};

/// The largest coordinate. Where there is no particle all three are, beyond the support of every point of the list's box.
inline constexpr std::int32_t packed_end = (1 << 20) - 1;

/// Of coordinates in [-2^20, 2^20 - 1].
constexpr PackedPosition pack_position(std::int32_t x, std::int32_t y, std::int32_t z) {
  const auto bits = [](std::int32_t high, std::int32_t low) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(high) << 11 |
                                     (static_cast<std::uint32_t>(low) & 0x7ffu));
  };
  return {bits(x, z), bits(y, z >> 11)};
}
inline constexpr PackedPosition packed_nowhere = pack_position(packed_end, packed_end, packed_end);

/// The coordinates of a position; `Int` is an integer of 32 bits or a register of them.
template <class Int>
EMBRUN_FN Int packed_x(Int xz) {
  return xz >> 11;
}
template <class Int>
EMBRUN_FN Int packed_y(Int yz) {
  return yz >> 11;
}
template <class Int>
EMBRUN_FN Int packed_z(Int xz, Int yz) {
  return ((yz << 21) >> 10) | (xz & 0x7ff);
}

/// A coordinate, in grid units, where there is no particle.
inline constexpr float far_away = 1e9f;

/// Of equal radii: a cache line.
struct alignas(64) PackedEight {
  std::int32_t xz[8], yz[8];
};
/// Recovered particles of equal radii, with their weights w.
struct alignas(32) PackedRecoveredEight {
  std::int32_t xz[8], yz[8];
  float weight[8];
};
/// Of radii that differ: grid units.
struct alignas(64) WideEight {
  float x[8], y[8], z[8], inverse_influence[8];
};
struct alignas(32) WideRecoveredEight {
  float x[8], y[8], z[8], inverse_influence[8], weight[8];
};

/// Puts a position into a lane of an eight.
template <class Eight>
void put_position(Eight& eight, std::size_t lane, PackedPosition position) {
  eight.xz[lane] = position.xz;
  eight.yz[lane] = position.yz;
}
template <class Eight>
void put_position(Eight& eight, std::size_t lane, Vec3 position, float inverse_influence) {
  eight.x[lane] = position.x;
  eight.y[lane] = position.y;
  eight.z[lane] = position.z;
  eight.inverse_influence[lane] = inverse_influence;
}

}  // namespace embrun

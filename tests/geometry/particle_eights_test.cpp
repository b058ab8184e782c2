#include "geometry/particle_eights.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

namespace embrun {
namespace {

void expect_kept(std::int32_t x, std::int32_t y, std::int32_t z) {
  const PackedPosition p = pack_position(x, y, z);
  ASSERT_EQ(packed_x(p.xz), x) << y << ' ' << z;
  ASSERT_EQ(packed_y(p.yz), y) << x << ' ' << z;
  ASSERT_EQ(packed_z(p.xz, p.yz), z) << x << ' ' << y;
}

TEST(ParticleEights, KeepPositionsOf21Bits) {
  const std::int32_t ends[] = {-packed_end - 1, -packed_end, -2049, -2048, -1, 0, 1, 2047, 2048,
                               packed_end - 1,  packed_end};
  for (const std::int32_t x : ends)
    for (const std::int32_t y : ends)
      for (const std::int32_t z : ends) expect_kept(x, y, z);
  std::mt19937 random(3);
  const auto any = [&] { return static_cast<std::int32_t>(random() >> 11) - packed_end - 1; };
  for (int i = 0; i < 10000; ++i) expect_kept(any(), any(), any());
}

}  // namespace
}  // namespace embrun

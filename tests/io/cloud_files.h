#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "particles/particle_set.h"

namespace embrun::test {

/// What the writers below put into a file, independently of the readers: coordinates that floats hold exactly.
struct CloudPoint {
  float x = 0, y = 0, z = 0;
  std::uint8_t red = 0, green = 0, blue = 0;
  std::uint16_t intensity = 0;
};
std::vector<CloudPoint> cloud_points(std::size_t count);

enum class PcdKind { ascii, binary, compressed };
/// Fields x y z rgb intensity (uint16), a padding of three bytes, and a histogram of two floats (i, -i) for point i.
std::string as_pcd(const std::vector<CloudPoint>& points, PcdKind kind);

/// The bytes packed by LZF: greedy, by search, with runs and overlapping references.
std::string lzf_packed(std::string_view bytes);

struct LasKind {
  int minor = 2;
  int format = 0;
  int extra_bytes = 0;
};
/// Scale 0.001, offset (500000, 4000000, 100); coordinates in steps of millimetres; see the test for the other fields.
std::string as_las(const std::vector<CloudPoint>& points, LasKind kind);

std::string as_obj_cloud(const std::vector<CloudPoint>& points, bool colours, bool normals);

}  // namespace embrun::test

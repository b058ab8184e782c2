// Writes the cloud that levels of detail are measured on: a bumpy ball, closed, with normals and colours, in binary PLY.
//
//   synthetic_cloud POINTS OUT.ply [radius]
//
// Points lie along a spiral on the sphere, evenly, but for what the bumps stretch them, and in an order that has nothing to
// do with where they are. With "radius" each has that of a splat that overlaps its neighbours.

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "math/vec.h"
#include "ply_header.h"

namespace embrun {
namespace {

/// A wave of the ball's surface: height x sine of the direction's part along `across`.
struct Wave {
  Vec3d across;
  double height, phase;
};
constexpr std::array<Wave, 6> waves{{{{5, 3, 2}, 0.05, 0.3},
                                     {{-4, 7, 3}, 0.04, 1.1},
                                     {{11, -6, 14}, 0.015, 2.0},
                                     {{-17, 21, 9}, 0.01, 0.7},
                                     {{45, 37, -52}, 0.003, 4.0},
                                     {{-88, 61, 104}, 0.001, 5.0}}};

struct Point {
  Vec3d position, normal;
  double stretch = 1;  ///< of areas
  std::array<std::uint8_t, 3> color;
};

Point point_at(std::uint64_t i, std::uint64_t count) {
  const double golden = M_PI * (3 - std::sqrt(5.0));
  const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
  const double turn = golden * static_cast<double>(i), side = std::sqrt(1 - z * z);
  const Vec3d direction{side * std::cos(turn), z, side * std::sin(turn)};
  double radius = 1;
  Vec3d slope;
  for (const Wave& wave : waves) {
    const double angle = dot(wave.across, direction) + wave.phase;
    radius += wave.height * std::sin(angle);
    slope = slope + wave.height * std::cos(angle) * wave.across;
  }
  slope = slope - dot(slope, direction) * direction;
  // The gradient of |p| - radius(p / |p|).
  const Vec3d gradient = direction - (1 / radius) * slope;
  Point point{radius * direction, normalize(gradient), radius * radius * length(gradient), {}};
  for (std::size_t c = 0; c < 3; ++c) {
    const double band = std::sin(9 * direction.y + 2 * std::sin(6 * direction.x) + 2 * static_cast<double>(c));
    point.color[c] = static_cast<std::uint8_t>(std::lround(150 + 70 * band));
  }
  return point;
}

void append(std::vector<char>& bytes, const void* data, std::size_t size) {
  const std::size_t at = bytes.size();
  bytes.resize(at + size);
  std::memcpy(bytes.data() + at, data, size);
}

int write_cloud(std::uint64_t count, const char* path, bool with_radius) {
  std::FILE* file = std::fopen(path, "wb");
  if (file == nullptr) {
    std::perror(path);
    return 1;
  }
  std::vector<std::string> properties{"float x",  "float y",   "float z",     "float nx",  "float ny",
                                      "float nz", "uchar red", "uchar green", "uchar blue"};
  if (with_radius) properties.push_back("float radius");
  const std::string header = ply_header(count, properties);
  bool good = std::fwrite(header.data(), 1, header.size(), file) == header.size();
  std::vector<char> bytes;
  const double usual = 0.9 * std::sqrt(4 * M_PI / static_cast<double>(count));
  for (std::uint64_t i = 0; i < count && good; ++i) {
    const Point point = point_at(i, count);
    const Vec3 values[2] = {to_float(point.position), to_float(point.normal)};
    append(bytes, values, sizeof values);
    append(bytes, point.color.data(), point.color.size());
    const auto radius = static_cast<float>(usual * std::sqrt(point.stretch) * 1.1);
    if (with_radius) append(bytes, &radius, sizeof radius);
    constexpr std::size_t piece = std::size_t{1} << 22;
    if (bytes.size() < piece && i + 1 < count) continue;
    good = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    bytes.clear();
  }
  good = std::fclose(file) == 0 && good;
  if (!good) std::perror(path);
  return good ? 0 : 1;
}

}  // namespace
}  // namespace embrun

int main(int argc, char** argv) {
  const std::uint64_t count = argc >= 3 ? std::strtoull(argv[1], nullptr, 10) : 0;
  const bool with_radius = argc == 4 && std::strcmp(argv[3], "radius") == 0;
  if (count < 10 || argc > 4 || (argc == 4 && !with_radius)) {
    std::fprintf(stderr, "usage: synthetic_cloud POINTS OUT.ply [radius]\n");
    return 2;
  }
  return embrun::write_cloud(count, argv[2], with_radius);
}

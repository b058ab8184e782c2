// Writes a particle file's particles many times over, side by side along x and z, as binary PLY: what scale is measured on.
//
//   tiled_particles FILE COLUMNS ROWS OUT.ply
//
// From one tile to the next it is as far as the particles extend and a rest spacing, so that they join.

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "geometry/box.h"
#include "io/read_particles.h"
#include "math/vec.h"
#include "particles/radius.h"
#include "ply_header.h"

namespace embrun {
namespace {

bool write_tiles(const std::vector<Vec3d>& positions, Vec3d pitch, int columns, int rows, const char* path) {
  std::FILE* file = std::fopen(path, "wb");
  if (file == nullptr) return false;
  const std::size_t count = positions.size() * static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const std::string header = ply_header(count, {"float x", "float y", "float z"});
  bool good = std::fwrite(header.data(), 1, header.size(), file) == header.size();
  std::vector<Vec3> tile(positions.size());
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns && good; ++column) {
      const Vec3d offset{pitch.x * column, 0.0, pitch.z * row};
      for (std::size_t i = 0; i < tile.size(); ++i) tile[i] = to_float(positions[i] + offset);
      good = std::fwrite(tile.data(), sizeof(Vec3), tile.size(), file) == tile.size();
    }
  }
  return std::fclose(file) == 0 && good;
}

int run(const char* from, int columns, int rows, const char* to) {
  const SizedParticles sized = size_particles(read_particles(from), std::nullopt, from);
  Box3 bounds;
  for (const Vec3d& p : sized.particles.positions) bounds.include(to_float(p));
  const Vec3 extent = bounds.high - bounds.low;
  const double spacing = sized.spacing.spacing;
  const Vec3d pitch{static_cast<double>(extent.x) + spacing, 0.0, static_cast<double>(extent.z) + spacing};
  if (!write_tiles(sized.particles.positions, pitch, columns, rows, to)) {
    std::perror(to);
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace embrun

int main(int argc, char** argv) {
  const int columns = argc == 5 ? std::atoi(argv[2]) : 0, rows = argc == 5 ? std::atoi(argv[3]) : 0;
  if (columns < 1 || rows < 1 || columns > 1000 || rows > 1000) {
    std::fprintf(stderr, "usage: tiled_particles FILE COLUMNS ROWS OUT.ply\n");
    return 2;
  }
  try {
    return embrun::run(argv[1], columns, rows, argv[4]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tiled_particles: %s\n", error.what());
    return 1;
  }
}

// What is written is read by OpenVDB itself.

#include "meshing/density_vdb.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "embrun/embrun.h"
#include "image/scratch_folder.h"

namespace embrun {
namespace {

TEST(DensityVdb, IsReadByOpenVdb) {
  const ScratchFolder folder;
  DensityGrid grid;
  grid.cell = 0.25f;
  grid.origin = {2, -4, 6};
  grid.tiles = {{{0, 1, 2}}, {{3, 0, 1}}, {{1, 1, 1}}};
  grid.extinction.resize(3 * DensityGrid::tile_cells);
  const auto at = [&](std::size_t tile, std::size_t x, std::size_t y, std::size_t z) -> float& {
    return grid.extinction[tile * DensityGrid::tile_cells + x + 8 * y + 64 * z];
  };
  at(0, 1, 2, 3) = 0.5f;
  at(0, 7, 7, 7) = 2;
  at(1, 0, 0, 0) = 1.25f;
  const std::string path = (folder / "d.vdb").string();
  const Vec3d origin{1e6, 0, -1e6};
  std::ofstream(path, std::ios::binary) << encode_vdb(grid, origin, "made by hand");

  openvdb::initialize();
  openvdb::io::File file(path);
  file.open();
  const auto read = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(read->background(), 0.0f);
  EXPECT_EQ(read->metaValue<std::string>("comment"), "made by hand");
  EXPECT_EQ(read->activeVoxelCount(), 3u);
  EXPECT_EQ(read->tree().leafCount(), 2u);  // the third tile is empty
  const auto accessor = read->getConstAccessor();
  EXPECT_EQ(accessor.getValue({1, 8 + 2, 16 + 3}), 0.5f);
  EXPECT_EQ(accessor.getValue({7, 15, 23}), 2.0f);
  EXPECT_EQ(accessor.getValue({24, 0, 8}), 1.25f);
  EXPECT_EQ(accessor.getValue({2, 10, 19}), 0.0f);
  EXPECT_DOUBLE_EQ(read->voxelSize().x(), 0.25);
  // The middle of cell (1, 10, 19): 1e6 + 2 + 1.5/4, -4 + 10.5/4, -1e6 + 6 + 19.5/4.
  const openvdb::Vec3d place = read->indexToWorld(openvdb::Coord(1, 10, 19));
  EXPECT_DOUBLE_EQ(place.x(), 1e6 + 2.375);
  EXPECT_DOUBLE_EQ(place.y(), -1.375);
  EXPECT_DOUBLE_EQ(place.z(), -1e6 + 10.875);
}

// All the way from a file of particles far from the origin: voxels hold, where OpenVDB says that they are, the mean over 4^3
// points of the definition, in double.
TEST(DensityVdb, OfAFileIsTheDensityThere) {
  const ScratchFolder folder;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0, 0.5);
  std::vector<Vec3d> particles;
  std::ofstream file(folder / "p.xyz");
  file.precision(12);
  for (int i = 0; i < 120; ++i) {
    particles.push_back({1000 + uniform(random), -500 + uniform(random), uniform(random)});
    file << particles.back().x << ' ' << particles.back().y << ' ' << particles.back().z << '\n';
  }
  file.close();
  MeshOptions options;
  options.radius = 0.06;
  options.density_file = (folder / "p.vdb").string();
  options.density_radius = 0.08;
  const MeshReport report = mesh_file((folder / "p.xyz").string(), (folder / "p.ply").string(), options);
  EXPECT_DOUBLE_EQ(report.density_cell, 0.03);

  openvdb::initialize();
  openvdb::io::File vdb(options.density_file);
  vdb.open();
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(vdb.readGrid("density"));
  EXPECT_EQ(grid->activeVoxelCount(), report.density_voxels);
  const double cell = grid->voxelSize().x();
  EXPECT_NEAR(cell, 0.03, 1e-8);
  const auto mean_at = [&](const openvdb::Vec3d& middle) {
    int inside = 0;
    for (int i = 0; i < 64; ++i) {
      const Vec3d x =
          Vec3d{middle.x(), middle.y(), middle.z()} + 0.25 * cell * Vec3d{i % 4 - 1.5, i / 4 % 4 - 1.5, i / 16 - 1.5};
      inside += std::any_of(particles.begin(), particles.end(), [&](const Vec3d& p) { return length(x - p) < 0.08; });
    }
    return inside / 64.0;
  };
  const auto accessor = grid->getConstAccessor();
  const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
  double sum = 0;
  int wrong = 0, filled = 0;
  // One voxel in seven, those beyond the outermost as well.
  for (int x = box.min().x() - 2; x <= box.max().x() + 2; ++x)
    for (int y = box.min().y() - 2; y <= box.max().y() + 2; ++y)
      for (int z = box.min().z() - 2 + (x + 3 * y) % 7; z <= box.max().z() + 2; z += 7) {
        const openvdb::Coord at(x, y, z);
        const double value = static_cast<double>(accessor.getValue(at)), wanted = mean_at(grid->indexToWorld(at));
        // A point at the very edge of a ball may fall on either side of it.
        EXPECT_NEAR(value, wanted, 1.01 / 64);
        wrong += std::abs(value - wanted) > 1e-6;
        filled += wanted > 0;
        sum += wanted;
      }
  EXPECT_GT(filled, 500);
  EXPECT_LT(wrong, filled / 50);
  EXPECT_NEAR(7 * sum * cell * cell * cell / report.density_integral, 1.0, 0.03);
}

}  // namespace
}  // namespace embrun

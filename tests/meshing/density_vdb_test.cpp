// What is written is read by OpenVDB itself.

#include "meshing/density_vdb.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <string>

#include "base/error.h"
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
  write_vdb(path, grid, origin, "made by hand");

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

  EXPECT_THROW(write_vdb((folder / "no/d.vdb").string(), grid, origin, ""), Error);
}

}  // namespace
}  // namespace embrun

#include "meshing/density_vdb.h"

#include "base/error.h"

#if defined(EMBRUN_HAS_OPENVDB)
#include <openvdb/openvdb.h>

#include <algorithm>
#include <sstream>
#include <utility>
#endif

namespace embrun {

#if defined(EMBRUN_HAS_OPENVDB)

namespace {

openvdb::FloatGrid::Ptr make_grid(const DensityGrid& grid, Vec3d origin, const std::string& comment) {
  auto result = openvdb::FloatGrid::create(0.0f);
  result->setName("density");
  result->setGridClass(openvdb::GRID_FOG_VOLUME);
  result->insertMeta("comment", openvdb::StringMetadata(comment));
  // Voxel (0, 0, 0) is the first cell of tile (0, 0, 0); its place is that of the cell's middle.
  const double cell = static_cast<double>(grid.cell);
  const Vec3d middle = origin + to_double(grid.origin) + 0.5 * cell * Vec3d{1, 1, 1};
  auto transform = openvdb::math::Transform::createLinearTransform(cell);
  transform->postTranslate({middle.x, middle.y, middle.z});
  result->setTransform(transform);

  // Our tiles are OpenVDB's leaves, but for the order of the axes.
  using Leaf = openvdb::FloatTree::LeafNodeType;
  static_assert(Leaf::DIM == DensityGrid::tile_side);
  for (std::size_t tile = 0; tile < grid.tiles.size(); ++tile) {
    const float* values = grid.extinction.data() + tile * DensityGrid::tile_cells;
    if (std::all_of(values, values + DensityGrid::tile_cells, [](float v) { return v == 0; })) continue;
    const auto& [x, y, z] = grid.tiles[tile];
    constexpr int side = DensityGrid::tile_side;
    auto* leaf = new Leaf(openvdb::Coord(x * side, y * side, z * side), 0.0f, false);
    for (openvdb::Index cell_of_tile = 0; cell_of_tile < Leaf::SIZE; ++cell_of_tile) {
      const auto i = cell_of_tile % side, j = cell_of_tile / side % side, k = cell_of_tile / side / side;
      if (values[cell_of_tile] != 0) leaf->setValueOn((i * side + j) * side + k, values[cell_of_tile]);
    }
    result->tree().addLeaf(leaf);
  }
  return result;
}

/// Its class of files opens them by itself, and does not notice when a disk is full.
class VdbEncoder : public openvdb::io::Archive {
 public:
  std::string encode(const openvdb::FloatGrid::Ptr& grid) const {
    std::ostringstream bytes(std::ios::binary);
    bytes.exceptions(std::ios::badbit | std::ios::failbit);
    write(bytes, openvdb::GridCPtrVec{grid}, true);
    return std::move(bytes).str();
  }
};

}  // namespace

bool can_write_vdb() { return true; }

void require_vdb() {}

std::string encode_vdb(const DensityGrid& grid, Vec3d origin, const std::string& comment) {
  EMBRUN_CHECK(grid.channels == 1);
  openvdb::initialize();
  return VdbEncoder().encode(make_grid(grid, origin, comment));
}

#else

bool can_write_vdb() { return false; }

void require_vdb() {
  throw Error(
      "this build has no OpenVDB, which writes density grids: install it (on Debian: apt-get install libopenvdb-dev "
      "libboost-dev), configure and build again");
}

std::string encode_vdb(const DensityGrid&, Vec3d, const std::string&) {
  require_vdb();
  return {};
}

#endif

}  // namespace embrun

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/cell_model.h"
#include "geometry/cell_words.h"
#include "geometry/implicit_surface_storage.h"
#include "geometry/particle_blocks.h"
#include "geometry/surface_grid.h"
#include "geometry/surface_model.h"

namespace embrun {

struct RecoveredSource {
  Vec3d position;        ///< grid units
  float inverse_radius;  ///< 1/b'
  float weight;          ///< w / T'
};

/// Records and lists of one piece of tiles, with offsets from its own beginnings.
struct SurfacePiece {
  SurfaceRecords records;
  std::uint64_t list_entries = 0;
  std::uint64_t near_leaves = 0;

  /// Empties it but keeps its room.
  void clear() {
    records.clear();
    list_entries = near_leaves = 0;
  }
};

/// Growing arrays of particles with room for a few more, reused from box to box.
struct ParticleScratch {
  std::vector<float> x, y, z, reach;

  Vec3 position(std::size_t i) const { return {x[i], y[i], z[i]}; }
  ParticleArrays arrays() { return {x.data(), y.data(), z.data(), reach.data()}; }
  ParticleArrays with_room(std::size_t count) {
    if (x.size() < count + 32) {
      const std::size_t size = 2 * count + 64;
      x.resize(size);
      y.resize(size);
      z.resize(size);
      reach.resize(size);
    }
    return arrays();
  }
};

/// Builds the cells of one tile after the other; one for each running task. What it is given must outlive it.
class TileBuilder {
 public:
  TileBuilder(const GridPlan& plan, const SortedLattice& sorted, std::span<const Vec3> positions,
              std::span<const float> radii, const ParticleBlocks& blocks, const SurfaceModel& model,
              const ParticleBlocks& recovered_blocks, std::span<const RecoveredSource> recovered);

  /// Appends the records and lists of the tile at (tx, ty, tz) to the piece and fills `tile` in, whose first cell counts
  /// from the piece's beginning. Throws Error when a list is too long.
  void build(int tx, int ty, int tz, SurfacePiece& piece, SurfaceTile& tile);

 private:
  struct Pending {
    std::size_t record;
    Vec3 center;
    float half;
    int depth;
  };

  Vec3 cell_center(int cell) const;
  Vec3 brick_middle(int brick) const;
  /// The particles of the tile and of the cells within reach of it, relative to the tile's corner.
  std::size_t take_from_lattice();
  /// Scene box of the tile.
  void scene_box(Vec3& low, Vec3& high) const;
  std::size_t take_from_blocks();
  float grid_coordinate(float v, int axis) const;
  /// Recovered particles felt in the tile: grid units, relative to the tile's corner.
  void take_recovered();
  /// Those of `from` that are felt in the box center +- half (grid units); returns the most they can sum to there.
  float take_box_recovered(const std::vector<RecoveredParticle>& from, Vec3 center, float half,
                           std::vector<RecoveredParticle>& to) const;
  /// Decides about one of the brick's cells; for a near leaf its recovered particles are listed, and those in brick_ that it
  /// feels are marked.
  void examine_top_cell(int index, int in_its_brick, std::size_t in_brick, SurfacePiece& piece, SurfaceTile& tile);
  /// Puts the marked particles of brick_ in eights, so that each cell finds its own in few of them.
  void order_brick(std::size_t in_brick);
  /// Decides about the cell whose particles are in cell_, the recovered ones of `from` taken into account: they are
  /// left in cell_recovered_; none when they cannot reach their threshold in the cell.
  void examine(Vec3 center, float half, std::size_t listed, const std::vector<RecoveredParticle>& from,
               SurfaceCell& record);
  /// Beyond so many b' of all particles in cell_recovered_ they do not reach their threshold in the box (grid units).
  float recovered_extent(Vec3 middle, float half) const;
  /// Fills in the model of a cell that only the particles in cell_recovered_ reach; false if their body cannot.
  bool fit_recovered(Vec3 middle, float half, SurfaceCell& record) const;
  /// More than the rounding of the recovered lists' coordinates, and of what follows, in a box (grid units).
  float recovered_slack(float half) const;
  /// The particles felt in a box into cell_, from the tile's.
  std::size_t regather(Vec3 center, float half, std::size_t in_tile);
  bool is_main(const SurfaceCell& record) const;
  bool wants_split(const SurfaceCell& record, double size, std::size_t listed);
  void divide(SurfacePiece& piece, const Pending& split, std::size_t in_tile, std::vector<Pending>& splits);
  /// Writes the list of a near leaf whose particles are in cell_, for itself alone.
  void write_own_list(SurfacePiece& piece, SurfaceCell& record, Vec3 center, std::size_t listed);
  /// Writes the list that the near leaves of a brick share, and says in their records what they feel of it.
  void write_brick_list(SurfacePiece& piece, int brick, std::size_t in_brick);
  /// Appends the particles of order_ to the piece's lists, relative to `middle`, filled up to whole parts of 2^log2 eights;
  /// returns where they begin.
  std::uint32_t write_list(SurfacePiece& piece, const ParticleScratch& from, Vec3 middle, int log2);
  void write_packed(SurfacePiece& piece, const ParticleScratch& from, Vec3 middle) const;
  void write_wide(SurfacePiece& piece, const ParticleScratch& from, Vec3 middle) const;
  /// Writes the list of the recovered particles of a near leaf, which are in cell_recovered_.
  void write_recovered(SurfacePiece& piece, SurfaceCell& record, Vec3 center);
  void write_packed_recovered(SurfacePiece& piece, Vec3 center, std::size_t eights);
  void write_wide_recovered(SurfacePiece& piece, Vec3 center, std::size_t eights);

  const GridPlan& plan_;
  const SortedLattice& sorted_;
  std::span<const Vec3> positions_;
  std::span<const float> radii_;
  const ParticleBlocks& blocks_;
  float influence_factor_, recover_threshold_;
  const ParticleBlocks& recovered_blocks_;
  std::span<const RecoveredSource> recovered_;
  const CellModelLoops& loops_;
  int corner_[3] = {0, 0, 0};
  ParticleScratch all_, tile_, brick_, cell_, nearer_;
  std::vector<std::uint32_t> near_;
  std::vector<RecoveredParticle> tile_recovered_, brick_recovered_, cell_recovered_;
  Box3 recovered_box_;               ///< where in the cell those can be a body, from its centre; grid units
  std::vector<std::uint8_t> marks_;  ///< of the particles in brick_: the cells of the brick that feel them, a bit each
  std::vector<std::uint32_t> by_mark_;
  std::vector<std::uint8_t> distinct_marks_;
  std::vector<std::uint32_t> order_;       ///< a list's particles, eight by eight
  std::vector<std::uint8_t> eight_marks_;  ///< of each eight: its particles' marks together
  SurfaceCell records_[tile_cells];
};

}  // namespace embrun

#include <algorithm>
#include <limits>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/cell_words.h"
#include "geometry/implicit_surface.h"
#include "geometry/implicit_surface_storage.h"
#include "geometry/kernels.h"
#include "geometry/particle_blocks.h"
#include "geometry/surface_grid.h"
#include "geometry/surface_model.h"
#include "geometry/surface_tile_builder.h"

namespace embrun {

namespace {

/// Tiles of one piece of work; its lists are put together in the order of the pieces.
constexpr std::size_t tiles_per_piece = 8;

/// Puts the pieces' records and lists together, in order.
void join_pieces(std::vector<SurfacePiece>& pieces, std::vector<SurfaceTile>& tiles,
                 ImplicitSurface::Storage& storage) {
  struct Offsets {
    std::size_t cells = 0, packed = 0, wide = 0, packed_recovered = 0, wide_recovered = 0;
  };
  std::vector<Offsets> offsets(pieces.size());
  Offsets total;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    offsets[i] = total;
    total.cells += pieces[i].cells.size();
    total.packed += pieces[i].packed.size();
    total.wide += pieces[i].wide.size();
    total.packed_recovered += pieces[i].packed_recovered.size();
    total.wide_recovered += pieces[i].wide_recovered.size();
    storage.stats.near_cells += pieces[i].near_leaves;
    storage.stats.mean_list_length += static_cast<double>(pieces[i].list_entries);
  }
  constexpr std::size_t most = std::numeric_limits<std::uint32_t>::max();
  if (total.cells >= cell_word::inside || total.packed / packed_stride > most || total.wide / wide_stride > most) {
    throw Error("the surface has more cells than its indices can name");
  }
  storage.cells.resize(total.cells);
  storage.packed_lists.resize(total.packed);
  storage.wide_lists.resize(total.wide);
  storage.packed_recovered.resize(total.packed_recovered);
  storage.wide_recovered.resize(total.wide_recovered);
  parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      SurfacePiece& piece = pieces[i];
      const Offsets& o = offsets[i];
      for (SurfaceCell& cell : piece.cells) {
        if (cell.kind == SurfaceCellKind::split) {
          cell.list += static_cast<std::uint32_t>(o.cells);
        } else {
          cell.list += static_cast<std::uint32_t>(o.packed / packed_stride + o.wide / wide_stride);
          cell.recovered += static_cast<std::uint32_t>(o.packed_recovered / packed_recovered_stride +
                                                       o.wide_recovered / wide_recovered_stride);
        }
      }
      const auto append = [](const auto& from, auto& to, std::size_t at) {
        std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(at));
      };
      append(piece.cells, storage.cells, o.cells);
      append(piece.packed, storage.packed_lists, o.packed);
      append(piece.wide, storage.wide_lists, o.wide);
      append(piece.packed_recovered, storage.packed_recovered, o.packed_recovered);
      append(piece.wide_recovered, storage.wide_recovered, o.wide_recovered);
      piece = {};
      const std::size_t last = std::min(tiles.size(), (i + 1) * tiles_per_piece);
      for (std::size_t t = i * tiles_per_piece; t < last; ++t) {
        tiles[t].first_cell += static_cast<std::uint32_t>(o.cells);
      }
    }
  });
}

}  // namespace

ImplicitSurface build_implicit_surface(std::span<const Vec3> positions, std::span<const float> radii,
                                       const SurfaceSettings& settings, std::size_t domain) {
  const SurfaceModel model = resolve_surface_model(positions, radii, settings);
  const GridPlan plan = plan_grid(positions, radii, model, std::max(domain, positions.size()));

  SortedLattice sorted;
  ParticleBlocks blocks;
  if (plan.equal_radii) {
    sorted = sort_particles(positions, plan);
  } else {
    std::vector<float> influence(radii.begin(), radii.end());
    for (float& b : influence) b *= model.influence_factor;
    blocks = ParticleBlocks(positions, influence, {}, kernel_support(model.kernel));
  }
  std::vector<RecoveredSource> recovered(model.recovered.size());
  std::vector<Vec3> recovered_positions(recovered.size());
  std::vector<float> recovered_radii(recovered.size());
  for (std::size_t i = 0; i < recovered.size(); ++i) {
    const std::uint32_t source = model.recovered[i];
    const Vec3 p = positions[source];
    const float radius = model.recover_factor * (radii.empty() ? model.radius : radii[source]);
    recovered_positions[i] = p;
    recovered_radii[i] = radius;
    recovered[i].position = {(static_cast<double>(p.x) - plan.origin[0]) / plan.cell_size,
                             (static_cast<double>(p.y) - plan.origin[1]) / plan.cell_size,
                             (static_cast<double>(p.z) - plan.origin[2]) / plan.cell_size};
    recovered[i].inverse_radius = static_cast<float>(plan.cell_size / static_cast<double>(radius));
    recovered[i].weight = model.recovered_weights[i] / model.recover_threshold;
  }
  ParticleBlocks recovered_blocks;
  if (!recovered.empty()) {
    recovered_blocks = ParticleBlocks(recovered_positions, recovered_radii, {}, kernel_support(model.kernel));
  }

  auto storage = std::make_unique<ImplicitSurface::Storage>();
  const std::size_t tile_count = static_cast<std::size_t>(plan.tiles[0]) * static_cast<std::size_t>(plan.tiles[1]) *
                                 static_cast<std::size_t>(plan.tiles[2]);
  std::vector<SurfaceTile> tiles(tile_count);
  std::vector<SurfacePiece> pieces((tile_count + tiles_per_piece - 1) / tiles_per_piece);
  parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    TileBuilder builder(plan, sorted, positions, radii, blocks, model, recovered_blocks, recovered);
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t last = std::min(tile_count, (i + 1) * tiles_per_piece);
      for (std::size_t t = i * tiles_per_piece; t < last; ++t) {
        const auto row = static_cast<std::size_t>(plan.tiles[0]);
        const auto slab = row * static_cast<std::size_t>(plan.tiles[1]);
        builder.build(static_cast<int>(t % row), static_cast<int>(t % slab / row), static_cast<int>(t / slab),
                      pieces[i], tiles[t]);
      }
    }
  });
  join_pieces(pieces, tiles, *storage);
  storage->words = make_cell_words(tiles, plan.tiles);

  ImplicitSurfaceView& view = storage->view;
  for (int a = 0; a < 3; ++a) {
    view.origin[a] = plan.origin[a];
    view.cells[a] = plan.cells[a];
    view.tiles[a] = plan.tiles[a];
  }
  view.cell_size = static_cast<float>(plan.cell_size);
  view.cells_per_metre = 1.0 / plan.cell_size;
  view.words = storage->words.data();
  view.cell = storage->cells.data();
  view.packed_lists = storage->packed_lists.data();
  view.wide_lists = storage->wide_lists.data();
  view.packed_recovered = storage->packed_recovered.data();
  view.wide_recovered = storage->wide_recovered.data();
  view.inverse_threshold = 1.0f / model.threshold;
  view.recovered_inverse_threshold = 1.0f / model.recover_threshold;
  view.recovered_inverse_influence = static_cast<float>(plan.cell_size / static_cast<double>(model.recover_radius));
  view.inverse_influence = static_cast<float>(plan.cell_size / static_cast<double>(model.influence_radius));
  view.lattice = plan.lattice;
  view.recovered_lattice = plan.recovered_lattice;
  view.kernel = model.kernel;
  view.normal = model.normal;
  view.equal_radii = plan.equal_radii;

  ImplicitSurfaceStats& stats = storage->stats;
  stats.particles = positions.size();
  stats.recovered_particles = recovered.size();
  stats.cells = tile_count * tile_cells;
  stats.mean_list_length /= std::max<double>(1.0, static_cast<double>(stats.near_cells));
  stats.bytes = storage->words.size() * sizeof(std::uint32_t) + storage->cells.size() * sizeof(SurfaceCell) +
                storage->packed_lists.size() * sizeof(std::uint16_t) +
                storage->packed_recovered.size() * sizeof(std::uint16_t) +
                (storage->wide_lists.size() + storage->wide_recovered.size()) * sizeof(float);
  stats.influence_radius = model.influence_radius;
  stats.threshold = model.threshold;
  return ImplicitSurface(std::move(storage));
}

}  // namespace embrun

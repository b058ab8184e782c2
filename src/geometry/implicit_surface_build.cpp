#include <algorithm>
#include <limits>
#include <utility>
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

/// Tiles of one piece of work, and pieces that are worked on before their lists are put together, in order.
constexpr std::size_t tiles_per_piece = 8, pieces_per_wave = 512;

/// Appends `from` to `to`. Where it has to grow it gets room for all that is to come if it goes on as it did for
/// `done` of it, within reason: what is too much is never touched, and costs no memory.
template <class T>
void append(const std::vector<T>& from, std::vector<T>& to, double done) {
  const std::size_t size = to.size() + from.size();
  if (size > to.capacity())
    to.reserve(static_cast<std::size_t>(std::min(1.2 / done, 4.0) * static_cast<double>(size)) + 1);
  to.insert(to.end(), from.begin(), from.end());
}

/// Appends a piece's records and lists, and empties it. `tiles` are its own; after it `done` of all are.
void take_piece(SurfacePiece& piece, std::span<SurfaceTile> tiles, double done, ImplicitSurface::Storage& storage) {
  SurfaceRecords& from = piece.records;
  SurfaceRecords& to = storage.records;
  const std::size_t cells = to.cells.size(), lists = to.eights(), recovered = to.recovered_eights();
  for (SurfaceCell& cell : from.cells) {
    if (cell.kind == SurfaceCellKind::split) {
      cell.list += static_cast<std::uint32_t>(cells);
    } else {
      cell.list += static_cast<std::uint32_t>(lists);
      cell.recovered += static_cast<std::uint32_t>(recovered);
    }
  }
  for (SurfaceTile& tile : tiles) tile.first_cell += static_cast<std::uint32_t>(cells);
  append(from.cells, to.cells, done);
  append(from.packed, to.packed, done);
  append(from.wide, to.wide, done);
  append(from.packed_recovered, to.packed_recovered, done);
  append(from.wide_recovered, to.wide_recovered, done);
  storage.stats.near_cells += piece.near_leaves;
  storage.stats.mean_list_length += static_cast<double>(piece.list_entries);
  constexpr std::size_t most = std::numeric_limits<std::uint32_t>::max();
  if (to.cells.size() >= cell_word::inside || to.eights() > most || to.recovered_eights() > most) {
    throw Error("the surface has more cells than its indices can name");
  }
  piece.clear();
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
  const std::size_t piece_count = (tile_count + tiles_per_piece - 1) / tiles_per_piece;
  std::vector<SurfacePiece> pieces(std::min(piece_count, pieces_per_wave));
  for (std::size_t wave = 0; wave < piece_count; wave += pieces_per_wave) {
    const std::size_t in_wave = std::min(pieces_per_wave, piece_count - wave);
    const auto tiles_of = [&](std::size_t piece) {
      const std::size_t first = (wave + piece) * tiles_per_piece;
      return std::pair{first, std::min(tile_count, first + tiles_per_piece)};
    };
    parallel_for(in_wave, 1, [&](std::size_t begin, std::size_t end) {
      TileBuilder builder(plan, sorted, positions, radii, blocks, model, recovered_blocks, recovered);
      for (std::size_t i = begin; i < end; ++i) {
        const auto [first, last] = tiles_of(i);
        for (std::size_t t = first; t < last; ++t) {
          const auto row = static_cast<std::size_t>(plan.tiles[0]);
          const auto slab = row * static_cast<std::size_t>(plan.tiles[1]);
          builder.build(static_cast<int>(t % row), static_cast<int>(t % slab / row), static_cast<int>(t / slab),
                        pieces[i], tiles[t]);
        }
      }
    });
    for (std::size_t i = 0; i < in_wave; ++i) {
      const auto [first, last] = tiles_of(i);
      take_piece(pieces[i], std::span(tiles).subspan(first, last - first),
                 static_cast<double>(last) / static_cast<double>(tile_count), *storage);
    }
  }
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
  const SurfaceRecords& records = storage->records;
  view.cell = records.cells.data();
  view.packed = records.packed.data();
  view.wide = records.wide.data();
  view.packed_recovered = records.packed_recovered.data();
  view.wide_recovered = records.wide_recovered.data();
  view.inverse_threshold = 1.0f / model.threshold;
  view.recovered_inverse_threshold = 1.0f / model.recover_threshold;
  view.recovered_inverse_influence = static_cast<float>(plan.cell_size / static_cast<double>(model.recover_radius));
  view.inverse_influence = static_cast<float>(plan.cell_size / static_cast<double>(model.influence_radius));
  view.packed_step = view.inverse_influence / static_cast<float>(plan.units_per_grid);
  view.packed_recovered_step = view.recovered_inverse_influence / plan.recovered_units_per_grid;
  view.kernel = model.kernel;
  view.normal = model.normal;
  view.equal_radii = plan.equal_radii;

  ImplicitSurfaceStats& stats = storage->stats;
  stats.particles = positions.size();
  stats.recovered_particles = recovered.size();
  stats.cells = tile_count * tile_cells;
  stats.mean_list_length /= std::max<double>(1.0, static_cast<double>(stats.near_cells));
  stats.bytes = storage->words.size() * sizeof(std::uint32_t) + records.bytes();
  stats.influence_radius = model.influence_radius;
  stats.threshold = model.threshold;
  return ImplicitSurface(std::move(storage));
}

}  // namespace embrun

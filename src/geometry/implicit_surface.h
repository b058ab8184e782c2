#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "geometry/particle_eights.h"
#include "geometry/surface_settings.h"
#include "math/vec.h"

namespace embrun {

/// How one cell of the acceleration grid stands to the surface.
enum class SurfaceCellKind : std::uint8_t {
  outside,  ///< the field is proven below the threshold everywhere in the cell
  inside,   ///< proven above
  near,     ///< may hold the surface: `list` and `recovered` say by which particles
  split,    ///< eight child cells from `list` on, x fastest (only with radii far smaller than the cell)
};

/// How a cell stands to its particle list. The near cells of a brick of 2x2x2 top-level cells share one, of which each feels
/// some parts; a child of a split cell has its own.
struct ListPlace {
  std::uint8_t code;  ///< which cell of the brick, a bit an axis; `own`; log2 of the eights of a part from bit 4 on

  static constexpr std::uint8_t own = 8;
  EMBRUN_FN int eights_log2() const { return code >> 4; }
  /// From the middle of the list's box, a brick or a cell, to the cell's centre, in grid units. By the bits of +-0.5: which
  /// cell of its brick a ray meets next is anybody's guess, and branches would be one.
  EMBRUN_FN Vec3 offset() const {
    const std::uint32_t half = (code & own) != 0 ? 0u : 0x3f000000u;
    Vec3 from_middle;
    for (int a = 0; a < 3; ++a) {
      const std::uint32_t bits = half | (~(static_cast<std::uint32_t>(code) >> a) << 31);
      __builtin_memcpy(&from_middle[a], &bits, sizeof bits);
    }
    return from_middle;
  }
};

/// Two bounds, not below what was put in, in 16 bits each.
class SlackPair {
 public:
  SlackPair() = default;
  EMBRUN_FN SlackPair(float upper, float lower) : bits_(rounded_up(upper) | rounded_up(lower) >> 16) {}
  EMBRUN_FN float upper() const { return float_of(bits_ & 0xffff0000u); }
  EMBRUN_FN float lower() const { return float_of(bits_ << 16); }

 private:
  /// To the upper half of a float's bits: what is above 0 goes up to the next one, what is below loses the rest.
  EMBRUN_FN static std::uint32_t rounded_up(float value) {
    std::uint32_t bits;
    __builtin_memcpy(&bits, &value, sizeof bits);
    return (value > 0.0f ? bits + 0xffffu : bits) & 0xffff0000u;
  }
  EMBRUN_FN static float float_of(std::uint32_t bits) {
    float value;
    __builtin_memcpy(&value, &bits, sizeof value);
    return value;
  }
  std::uint32_t bits_ = 0;
};

/// A box in a cell, in `parts` of a grid unit from half of one below the cell's centre: the numbers of the first and the last
/// part along each axis, in five bits each, x lowest.
struct CellBox {
  std::uint32_t bits = 0;

  static constexpr int parts = 32;
  EMBRUN_FN static CellBox of(const int first[3], const int last[3]) {
    CellBox box;
    for (int a = 0; a < 3; ++a) box.bits |= static_cast<std::uint32_t>(first[a] | last[a] << 5) << (10 * a);
    return box;
  }
};

/// One cell near the surface: a cache line. Lengths are in grid units (the side of a top-level cell),
/// positions relative to the cell's centre. The quadratic
///   q(y) = c0 + c1 x + c2 y + c3 z + c4 xx + c5 yy + c6 zz + c7 xy + c8 xz + c9 yz
/// models the relative field g = D/T - 1. It is proven that q + upper >= 0 wherever in the cell g >= 0, and that
/// q - lower <= 0 wherever g <= 0. In a cell that only recovered particles reach q + upper >= 0 wherever g' >= 0.
struct alignas(64) SurfaceCell {
  float quadratic[10];
  SlackPair slack;
  CellBox recovered_box;           ///< where in the cell g' may be >= 0, if there are recovered particles
  std::uint32_t list;              ///< first eight of the particle list, or first child
  std::uint32_t list_bits;         ///< which parts of the list are felt in the cell, the first one by the lowest bit
  std::uint32_t recovered;         ///< first eight of the list of recovered particles
  std::uint16_t recovered_eights;  ///< recovered particles over 8, rounded up
  ListPlace place;
  SurfaceCellKind kind;
};
static_assert(sizeof(SurfaceCell) == 64);

/// What a ray reads of each top-level cell, one word: for a near cell the flag and the index of its record; for another
/// whether it is inside, and for each of the eight directions a ray may go (octant bit a set: up axis a) how many
/// cells on it may skip: the edge of a cube that starts at the cell, extends forward and holds no near cell, as a
/// three-bit code at bit 3 * octant.
namespace cell_word {
inline constexpr std::uint32_t near = 0x80000000u;
inline constexpr std::uint32_t inside = 0x40000000u;
/// The eight edges that the codes stand for, a byte each.
inline constexpr std::uint64_t edges = 0x180c080604030201ull;
EMBRUN_FN int skip(std::uint32_t word, int octant) {
  return static_cast<int>((edges >> (8 * ((word >> (3 * octant)) & 7u))) & 0xffu);
}
}  // namespace cell_word

/// What a ray sees of an implicit surface: flat arrays, read-only, the same on host and device.
/// The surface is max(D/T, D'/T') = 1 (D' the field of the recovered particles).
struct ImplicitSurfaceView {
  double origin[3];        ///< low corner of the grid, scene coordinates in metres
  float cell_size;         ///< metres a grid unit
  double cells_per_metre;  ///< its inverse
  int cells[3];            ///< multiples of 4
  int tiles[3];
  const std::uint32_t* words;  ///< cell_word of each cell, 64 to a tile of 4x4x4, x fastest in both
  const SurfaceCell* cell;
  // Lists: the packed ones when all radii are equal, else the wide ones.
  const PackedEight* packed;
  const PackedRecoveredEight* packed_recovered;
  const WideEight* wide;
  const WideRecoveredEight* wide_recovered;
  float inverse_threshold;            ///< 1/T
  float recovered_inverse_threshold;  ///< 1/T'
  float inverse_influence;            ///< 1/b in 1/grid units (equal radii)
  float recovered_inverse_influence;  ///< 1/b' (equal radii)
  float packed_step;                  ///< a step of the packed lists' lattice, in b
  float packed_recovered_step;        ///< of the recovered lists', in b': finer, since b' is shorter than b
  Kernel kernel;
  NormalMode normal;
  bool equal_radii;
};

/// Sizes and times of a built surface, for reports.
struct ImplicitSurfaceStats {
  std::size_t particles = 0;
  std::size_t recovered_particles = 0;
  std::size_t cells = 0;       ///< of the top grid
  std::size_t near_cells = 0;  ///< records
  std::size_t bytes = 0;       ///< at rest
  double mean_list_length = 0;
  float influence_radius = 0;  ///< b in metres
  float threshold = 0;         ///< T
};

/// An implicit surface ready for rays. Owns the arrays its view points into; immutable once built.
class ImplicitSurface {
 public:
  struct Storage;

  ImplicitSurface();
  ~ImplicitSurface();
  ImplicitSurface(ImplicitSurface&&) noexcept;
  ImplicitSurface& operator=(ImplicitSurface&&) noexcept;
  explicit ImplicitSurface(std::unique_ptr<Storage> storage);

  const ImplicitSurfaceView& view() const;
  const ImplicitSurfaceStats& stats() const;

 private:
  std::unique_ptr<Storage> storage_;
};

/// Builds the surface of the particles (method section 1).
/// `positions`: scene coordinates in metres, finite, at least one. `radii`: empty (all settings.radius) or one
/// positive finite radius a particle. The result does not depend on the number of threads.
/// `domain`: of how many particles these are some, if not all, so that the grid may have as many cells as for those.
/// Throws Error when the particles or settings cannot make a surface.
ImplicitSurface build_implicit_surface(std::span<const Vec3> positions, std::span<const float> radii,
                                       const SurfaceSettings& settings, std::size_t domain = 0);

}  // namespace embrun

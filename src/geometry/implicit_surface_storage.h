#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/implicit_surface.h"
#include "geometry/particle_eights.h"

namespace embrun {

/// Records of cells and the lists they name, of a surface or of a part of it.
struct SurfaceRecords {
  std::vector<SurfaceCell> cells;
  std::vector<PackedEight> packed;
  std::vector<PackedRecoveredEight> packed_recovered;
  std::vector<WideEight> wide;
  std::vector<WideRecoveredEight> wide_recovered;

  std::size_t eights() const { return packed.size() + wide.size(); }
  std::size_t recovered_eights() const { return packed_recovered.size() + wide_recovered.size(); }
  std::size_t bytes() const {
    const auto of = []<class T>(const std::vector<T>& array) { return array.size() * sizeof(T); };
    return of(cells) + of(packed) + of(packed_recovered) + of(wide) + of(wide_recovered);
  }
  /// Empties them but keeps their room.
  void clear() {
    cells.clear();
    packed.clear();
    packed_recovered.clear();
    wide.clear();
    wide_recovered.clear();
  }
};

/// The arrays of a built surface.
struct ImplicitSurface::Storage {
  std::vector<std::uint32_t> words;
  SurfaceRecords records;
  ImplicitSurfaceView view{};
  ImplicitSurfaceStats stats;
};

}  // namespace embrun

#pragma once

#include <cstdint>

#include "math/rgb.h"
#include "media/phase_function.h"

namespace embrun {

/// What fills the inside of a closed body: a refractive index, and what is the same everywhere in it, per metre.
struct Medium {
  float ior = 1;
  Rgb absorption;
  Rgb scattering;
  PhaseFunction phase;
  std::uint32_t fluids = 0;  ///< mask of the fluids whose particles are a medium besides, where the path is inside them
  std::int32_t grid = -1;    ///< number of the medium given on a grid that is there besides, or -1
};

/// Media are told apart by class, and the class is the priority: where bodies overlap, the highest class wins.
/// Class 0 is the air, which is everywhere and which nothing can leave.
inline constexpr int max_media_classes = 8;
inline constexpr int max_crossings = 255;
/// Solids whose inside is known as such: implicit surfaces, which are numbered first, and sets of balls.
inline constexpr int max_fluids = 32;
inline constexpr int max_solids = 64;

/// Which bodies a point of a path is in: for each class how many boundaries of it have been entered and not
/// left. Bodies of one class that overlap are one solid; a bubble (a higher class) is a hole in water, and in
/// air it is nothing. One byte per class; the byte of class 0 is not used.
struct MediaState {
  std::uint64_t counts = 0;
  /// One bit per numbered solid: set on its inside. What a ray that starts on such a surface goes by.
  std::uint64_t inside_solids = 0;

  EMBRUN_FN int count(int media_class) const { return static_cast<int>(counts >> (8 * media_class) & 0xff); }
  /// The medium that counts here: the highest class that was entered.
  EMBRUN_FN int current() const {
#if defined(__CUDA_ARCH__)
    return (63 - __clzll(static_cast<long long>(counts | 1))) >> 3;
#else
    return (63 - __builtin_clzll(counts | 1)) >> 3;
#endif
  }
  EMBRUN_FN bool inside_solid(int solid) const { return (inside_solids >> solid & 1u) != 0; }
  EMBRUN_FN bool inside_fluid(int fluid) const { return inside_solid(fluid); }
};

EMBRUN_FN std::uint64_t solid_bit(int solid) { return static_cast<std::uint64_t>(1) << solid; }

EMBRUN_FN bool operator==(MediaState a, MediaState b) {
  return a.counts == b.counts && a.inside_solids == b.inside_solids;
}

/// A boundary as a ray crosses it. `solid` is the number of the solid, or -1 for bodies that have none.
struct MediaBoundary {
  int media_class = 0;
  int solid = -1;
  bool entering = false;
};

/// True when the boundary cannot be where the state says the path is: it leaves what was never entered, or
/// enters a numbered solid from its inside.
EMBRUN_FN bool contradicts(const MediaState& state, const MediaBoundary& boundary) {
  const bool inside = boundary.solid >= 0 && state.inside_solid(boundary.solid);
  if (boundary.entering) return inside || state.count(boundary.media_class) == max_crossings;
  return state.count(boundary.media_class) == 0 || (boundary.solid >= 0 && !inside);
}

/// The state behind the boundary. A contradiction leaves the counts as they are.
EMBRUN_FN MediaState cross_boundary(MediaState state, const MediaBoundary& boundary) {
  if (contradicts(state, boundary)) return state;
  const std::uint64_t one = static_cast<std::uint64_t>(1) << (8 * boundary.media_class);
  state.counts = boundary.entering ? state.counts + one : state.counts - one;
  if (boundary.solid >= 0) state.inside_solids ^= solid_bit(boundary.solid);
  return state;
}

/// Puts the path on the side of the boundary that the boundary itself says it comes from.
EMBRUN_FN MediaState reconcile(MediaState state, const MediaBoundary& boundary) {
  const std::uint64_t one = static_cast<std::uint64_t>(1) << (8 * boundary.media_class);
  if (boundary.solid >= 0 && boundary.entering == state.inside_solid(boundary.solid)) {
    state.inside_solids ^= solid_bit(boundary.solid);
    state.counts =
        boundary.entering ? state.counts - (state.count(boundary.media_class) > 0 ? one : 0) : state.counts + one;
  }
  if (!boundary.entering && state.count(boundary.media_class) == 0) state.counts += one;
  if (boundary.entering && state.count(boundary.media_class) == max_crossings) state.counts -= one;
  return state;
}

}  // namespace embrun

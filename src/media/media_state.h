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
};

/// Media are told apart by class, and the class is the priority: where bodies overlap, the highest class wins.
/// Class 0 is the air, which is everywhere and which nothing can leave.
inline constexpr int max_media_classes = 8;
inline constexpr int max_crossings = 255;
inline constexpr int max_fluids = 32;

/// Which bodies a point of a path is in: for each class how many boundaries of it have been entered and not
/// left. Bodies of one class that overlap are one solid; a bubble (a higher class) is a hole in water, and in
/// air it is nothing. One byte per class; the byte of class 0 is not used.
struct MediaState {
  std::uint64_t counts = 0;
  /// One bit per implicit surface: set on its inside. What a ray that starts on such a surface goes by.
  std::uint32_t inside_fluids = 0;

  EMBRUN_FN int count(int media_class) const { return static_cast<int>(counts >> (8 * media_class) & 0xff); }
  /// The medium that counts here: the highest class that was entered.
  EMBRUN_FN int current() const {
#if defined(__CUDA_ARCH__)
    return (63 - __clzll(static_cast<long long>(counts | 1))) >> 3;
#else
    return (63 - __builtin_clzll(counts | 1)) >> 3;
#endif
  }
  EMBRUN_FN bool inside_fluid(int fluid) const { return (inside_fluids >> fluid & 1u) != 0; }
};

EMBRUN_FN bool operator==(MediaState a, MediaState b) {
  return a.counts == b.counts && a.inside_fluids == b.inside_fluids;
}

/// A boundary as a ray crosses it. `fluid` is the index of the implicit surface, or -1.
struct MediaBoundary {
  int media_class = 0;
  int fluid = -1;
  bool entering = false;
};

/// True when the boundary cannot be where the state says the path is: it leaves what was never entered, or
/// enters an implicit surface (a single solid) from its inside.
EMBRUN_FN bool contradicts(const MediaState& state, const MediaBoundary& boundary) {
  const bool inside_fluid = boundary.fluid >= 0 && state.inside_fluid(boundary.fluid);
  if (boundary.entering) return inside_fluid || state.count(boundary.media_class) == max_crossings;
  return state.count(boundary.media_class) == 0 || (boundary.fluid >= 0 && !inside_fluid);
}

/// The state behind the boundary. A contradiction leaves the counts as they are.
EMBRUN_FN MediaState cross_boundary(MediaState state, const MediaBoundary& boundary) {
  if (contradicts(state, boundary)) return state;
  const std::uint64_t one = static_cast<std::uint64_t>(1) << (8 * boundary.media_class);
  state.counts = boundary.entering ? state.counts + one : state.counts - one;
  if (boundary.fluid >= 0) state.inside_fluids ^= 1u << boundary.fluid;
  return state;
}

/// Puts the path on the side of the boundary that the boundary itself says it comes from.
EMBRUN_FN MediaState reconcile(MediaState state, const MediaBoundary& boundary) {
  const std::uint64_t one = static_cast<std::uint64_t>(1) << (8 * boundary.media_class);
  if (boundary.fluid >= 0 && boundary.entering == state.inside_fluid(boundary.fluid)) {
    state.inside_fluids ^= 1u << boundary.fluid;
    state.counts =
        boundary.entering ? state.counts - (state.count(boundary.media_class) > 0 ? one : 0) : state.counts + one;
  }
  if (!boundary.entering && state.count(boundary.media_class) == 0) state.counts += one;
  if (boundary.entering && state.count(boundary.media_class) == max_crossings) state.counts -= one;
  return state;
}

}  // namespace embrun

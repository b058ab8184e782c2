#pragma once

namespace embrun {

/// Kernel of the field D(x) = sum_i f(|x - p_i|); all have f(0) = 1 and influence radius b.
enum class Kernel {
  metaball,     ///< 1 - 3(r/b)^2 up to b/3, then (3/2)(1 - r/b)^2: C1, f(b/3) = 2/3
  zhu_bridson,  ///< (1 - (r/b)^2)^3
  blinn,        ///< exp(-beta r^2) with f(b/3) = 2/3, cut smoothly where it falls to 1e-3
};

enum class ThresholdMode { automatic, thesis, number };
enum class RecoverMode { smooth, thesis, off };
enum class NormalMode { weighted, gradient };

/// How the particles become a surface (the method's section 1).
struct SurfaceSettings {
  Kernel kernel = Kernel::metaball;
  int order = 3;  ///< n >= 1: the influence radius is 2 n R0
  ThresholdMode threshold_mode = ThresholdMode::automatic;
  float threshold = 0;  ///< T, for ThresholdMode::number
  RecoverMode recover = RecoverMode::smooth;
  NormalMode normal = NormalMode::weighted;
  /// Rest spacing s in metres, which sets the automatic threshold; 0: 2 R0 (no bulk to measure).
  double spacing = 0;
  /// Particle radius R0 in metres; must be positive. With per-particle radii, the reference radius.
  float radius = 0;

  bool operator==(const SurfaceSettings&) const = default;
};

}  // namespace embrun

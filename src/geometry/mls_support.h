#pragma once

namespace embrun {

/// How far a moving least squares surface feels a point, in radii of its splat, where nothing is said.
inline constexpr double mls_default_support = 3;

}  // namespace embrun

#pragma once

#include <array>
#include <cmath>

// Vectors in double precision for the oracles of point clouds, which share no header with what they judge.

namespace embrun::oracle_vectors {

using V = std::array<double, 3>;

inline V operator+(V a, V b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline V operator-(V a, V b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline V operator*(double s, V a) { return {s * a[0], s * a[1], s * a[2]}; }
inline double dot(V a, V b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline double norm(V a) { return std::sqrt(dot(a, a)); }

}  // namespace embrun::oracle_vectors

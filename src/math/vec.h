#pragma once

#include <cmath>

#include "base/host_device.h"

namespace embrun {

EMBRUN_FN float min_of(float a, float b) { return a < b ? a : b; }
EMBRUN_FN float max_of(float a, float b) { return a > b ? a : b; }
EMBRUN_FN int min_of(int a, int b) { return a < b ? a : b; }
EMBRUN_FN int max_of(int a, int b) { return a > b ? a : b; }
EMBRUN_FN double min_of(double a, double b) { return a < b ? a : b; }
EMBRUN_FN double max_of(double a, double b) { return a > b ? a : b; }
EMBRUN_FN float clamp(float x, float low, float high) { return min_of(max_of(x, low), high); }
EMBRUN_FN float square(float x) { return x * x; }

inline constexpr float pi = 3.14159265358979f;
inline constexpr float inv_pi = 0.318309886183791f;
inline constexpr float infinity = __builtin_huge_valf();

/// A point, vector or normal with single-precision components (per-ray code).
struct Vec3 {
  float x = 0, y = 0, z = 0;

  EMBRUN_FN float& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  EMBRUN_FN float operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};

EMBRUN_FN Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
EMBRUN_FN Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
EMBRUN_FN Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
EMBRUN_FN Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
EMBRUN_FN Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
EMBRUN_FN Vec3 operator*(float s, Vec3 a) { return a * s; }
EMBRUN_FN Vec3 operator/(Vec3 a, float s) { return a * (1.0f / s); }
EMBRUN_FN Vec3& operator+=(Vec3& a, Vec3 b) { return a = a + b; }
EMBRUN_FN Vec3& operator-=(Vec3& a, Vec3 b) { return a = a - b; }
EMBRUN_FN Vec3& operator*=(Vec3& a, float s) { return a = a * s; }
EMBRUN_FN bool operator==(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

EMBRUN_FN float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
EMBRUN_FN Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
EMBRUN_FN float length_squared(Vec3 a) { return dot(a, a); }
EMBRUN_FN float length(Vec3 a) { return sqrtf(dot(a, a)); }
/// Unit vector along `a`; `a` must not be zero.
EMBRUN_FN Vec3 normalize(Vec3 a) { return a * (1.0f / length(a)); }
EMBRUN_FN Vec3 min_of(Vec3 a, Vec3 b) { return {min_of(a.x, b.x), min_of(a.y, b.y), min_of(a.z, b.z)}; }
EMBRUN_FN Vec3 max_of(Vec3 a, Vec3 b) { return {max_of(a.x, b.x), max_of(a.y, b.y), max_of(a.z, b.z)}; }
EMBRUN_FN bool is_finite(float x) { return x - x == 0.0f; }
EMBRUN_FN bool is_finite(Vec3 a) { return is_finite(a.x) && is_finite(a.y) && is_finite(a.z); }

/// A point of a surface's coordinates.
struct Vec2 {
  float x = 0, y = 0;
};
EMBRUN_FN bool operator==(Vec2 a, Vec2 b) { return a.x == b.x && a.y == b.y; }

/// A point or vector in double precision: positions as files give them, before recentring.
struct Vec3d {
  double x = 0, y = 0, z = 0;
};

EMBRUN_FN Vec3d operator+(Vec3d a, Vec3d b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
EMBRUN_FN Vec3d operator-(Vec3d a, Vec3d b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
EMBRUN_FN Vec3d operator*(Vec3d a, double s) { return {a.x * s, a.y * s, a.z * s}; }
EMBRUN_FN Vec3d operator*(double s, Vec3d a) { return a * s; }
EMBRUN_FN bool operator==(Vec3d a, Vec3d b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
EMBRUN_FN double dot(Vec3d a, Vec3d b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
EMBRUN_FN Vec3d cross(Vec3d a, Vec3d b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
EMBRUN_FN double length(Vec3d a) { return std::sqrt(dot(a, a)); }
EMBRUN_FN Vec3d normalize(Vec3d a) { return a * (1.0 / length(a)); }
EMBRUN_FN Vec3d min_of(Vec3d a, Vec3d b) { return {min_of(a.x, b.x), min_of(a.y, b.y), min_of(a.z, b.z)}; }
EMBRUN_FN Vec3d max_of(Vec3d a, Vec3d b) { return {max_of(a.x, b.x), max_of(a.y, b.y), max_of(a.z, b.z)}; }

/// Two unit vectors that make a right-handed frame with a unit vector.
struct Tangents {
  Vec3d u, v;
};
EMBRUN_FN Tangents tangents_of(Vec3d n) {
  const Vec3d other = std::fabs(n.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d u = normalize(cross(other, n));
  return {u, cross(n, u)};
}

EMBRUN_FN Vec3 to_float(Vec3d a) { return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)}; }
EMBRUN_FN Vec3d to_double(Vec3 a) { return {a.x, a.y, a.z}; }

/// Axis-aligned box; empty when low > high on some axis (as a fresh one is).
struct Box3 {
  Vec3 low{infinity, infinity, infinity};
  Vec3 high{-infinity, -infinity, -infinity};

  EMBRUN_FN bool empty() const { return low.x > high.x || low.y > high.y || low.z > high.z; }
  EMBRUN_FN void include(Vec3 p) {
    low = min_of(low, p);
    high = max_of(high, p);
  }
  EMBRUN_FN void include(const Box3& other) {
    low = min_of(low, other.low);
    high = max_of(high, other.high);
  }
  EMBRUN_FN bool contains(Vec3 p) const {
    return p.x >= low.x && p.y >= low.y && p.z >= low.z && p.x <= high.x && p.y <= high.y && p.z <= high.z;
  }
};

/// Right-handed orthonormal basis whose third axis is the unit vector `n`
/// (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
struct Frame {
  Vec3 s, t, n;

  EMBRUN_FN explicit Frame(Vec3 axis) : n(axis) {
    const float sign = n.z < 0.0f ? -1.0f : 1.0f;
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    s = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
  }
  EMBRUN_FN Vec3 to_world(Vec3 v) const { return s * v.x + t * v.y + n * v.z; }
  EMBRUN_FN Vec3 to_local(Vec3 v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
};

}  // namespace embrun

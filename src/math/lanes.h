#pragma once

#include <cmath>
#include <cstdint>

#if defined(__SSE__) && !defined(__CUDACC__)
#include <immintrin.h>
#endif

#include "base/host_device.h"

namespace embrun {

/// A register of floats as wide as the instruction set of this translation unit has them, and one float on
/// the device. Lanes below are made of one or more.
#if defined(__CUDACC__)
inline constexpr int register_lanes = 1;
typedef float LaneRegister;
typedef std::int32_t LaneIntRegister;
#else
#if defined(__AVX512F__)
inline constexpr int register_lanes = 16;
#elif defined(__AVX__)
inline constexpr int register_lanes = 8;
#else
inline constexpr int register_lanes = 4;
#endif
typedef float LaneRegister __attribute__((vector_size(4 * register_lanes)));
typedef std::int32_t LaneIntRegister __attribute__((vector_size(4 * register_lanes)));
// Every function here is inlined, so how a wide vector would be passed does not matter.
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

inline constexpr int lane_registers = 16 / register_lanes;

#define EMBRUN_FOR_PARTS(n) for (int i = 0; i < (n); ++i)
#define EMBRUN_FOR_LANE_PARTS EMBRUN_FOR_PARTS(lane_registers)
#define EMBRUN_LANES_BINARY(op)                          \
  friend EMBRUN_FN Lanes operator op(Lanes a, Lanes b) { \
    Lanes r;                                             \
    EMBRUN_FOR_PARTS(parts)                              \
    r.part[i] = a.part[i] op b.part[i];                  \
    return r;                                            \
  }

// The compiler makes two instructions of the comparison, where the machine has one.
EMBRUN_FN LaneRegister larger(LaneRegister a, LaneRegister b) {
#if defined(__CUDACC__) || !defined(__SSE__)
  return a > b ? a : b;
#elif defined(__AVX512F__)
  return _mm512_maskz_max_ps(0xffff, a, b);
#elif defined(__AVX__)
  return _mm256_max_ps(a, b);
#else
  return _mm_max_ps(a, b);
#endif
}
EMBRUN_FN LaneRegister smaller(LaneRegister a, LaneRegister b) {
#if defined(__CUDACC__) || !defined(__SSE__)
  return a < b ? a : b;
#elif defined(__AVX512F__)
  return _mm512_maskz_min_ps(0xffff, a, b);
#elif defined(__AVX__)
  return _mm256_min_ps(a, b);
#else
  return _mm_min_ps(a, b);
#endif
}

/// Single-precision lanes: so many registers of them.
template <int parts>
struct Lanes {
  static constexpr int count = parts * register_lanes;
  LaneRegister part[parts];

  Lanes() = default;
  /// The same number in all lanes. Less 0, which the compiler leaves out, as it may not 0 more.
  EMBRUN_FN Lanes(float v) {  // NOLINT(google-explicit-constructor): formulas mix them
    EMBRUN_FOR_PARTS(parts) part[i] = v - LaneRegister{};
  }

  EMBRUN_LANES_BINARY(+)
  EMBRUN_LANES_BINARY(-)
  EMBRUN_LANES_BINARY(*)
  EMBRUN_LANES_BINARY(/)
  friend EMBRUN_FN Lanes& operator+=(Lanes& a, Lanes b) { return a = a + b; }
  friend EMBRUN_FN Lanes& operator-=(Lanes& a, Lanes b) { return a = a - b; }
  friend EMBRUN_FN Lanes max_of(Lanes a, Lanes b) {
    EMBRUN_FOR_PARTS(parts) a.part[i] = larger(a.part[i], b.part[i]);
    return a;
  }
  friend EMBRUN_FN Lanes min_of(Lanes a, Lanes b) {
    EMBRUN_FOR_PARTS(parts) a.part[i] = smaller(a.part[i], b.part[i]);
    return a;
  }
  /// Lane by lane: a < b ? yes : no.
  friend EMBRUN_FN Lanes select_less(Lanes a, Lanes b, Lanes yes, Lanes no) {
    EMBRUN_FOR_PARTS(parts) a.part[i] = a.part[i] < b.part[i] ? yes.part[i] : no.part[i];
    return a;
  }
};
#undef EMBRUN_LANES_BINARY

/// Sixteen lanes: the block size of the loops over particles.
using F16 = Lanes<lane_registers>;
/// One register of lanes: for loops over particles that keep many sums.
using RegisterLanes = Lanes<1>;

EMBRUN_FN F16 splat(float v) { return v; }
EMBRUN_FN LaneRegister load_register(const float* p) {
  LaneRegister r;
  __builtin_memcpy(&r, p, sizeof r);
  return r;
}
EMBRUN_FN LaneIntRegister load_register(const std::int32_t* p) {
  LaneIntRegister r;
  __builtin_memcpy(&r, p, sizeof r);
  return r;
}
// Register by register: copied whole, gcc moves it through the stack in halves, and waits for the stores.
template <class F>
EMBRUN_FN F load_lanes(const float* p) {
  F r;
  EMBRUN_FOR_PARTS(F::count / register_lanes) r.part[i] = load_register(p + i * register_lanes);
  return r;
}
EMBRUN_FN F16 load16(const float* p) { return load_lanes<F16>(p); }
EMBRUN_FN RegisterLanes to_lanes(LaneRegister a) {
  RegisterLanes r;
  r.part[0] = a;
  return r;
}
EMBRUN_FN LaneRegister to_float(LaneIntRegister a) {
#if defined(__CUDACC__)
  return static_cast<float>(a);
#else
  return __builtin_convertvector(a, LaneRegister);
#endif
}
#if !defined(__CUDACC__)
/// Sixteen numbers, a register of them where it holds as many.
template <class T>
struct Sixteen {
  typedef T Numbers __attribute__((vector_size(16 * sizeof(T))));
};
/// Two runs of eight numbers; without a second run its lanes are `none`.
template <class T>
EMBRUN_FN typename Sixteen<T>::Numbers join_eights(const T* first, const T* second, T none) {
  typedef T Eight __attribute__((vector_size(8 * sizeof(T))));
  Eight low, high = Eight{} + none;
  __builtin_memcpy(&low, first, sizeof low);
  if (second != nullptr) __builtin_memcpy(&high, second, sizeof high);
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}
#endif
EMBRUN_FN void store16(float* p, F16 v) {
  EMBRUN_FOR_LANE_PARTS __builtin_memcpy(p + i * register_lanes, &v.part[i], sizeof v.part[i]);
}
EMBRUN_FN float lane_of(const F16& v, int lane) {
  float r;
  __builtin_memcpy(&r, reinterpret_cast<const char*>(&v) + 4 * lane, sizeof r);
  return r;
}
EMBRUN_FN LaneRegister sqrt_of(LaneRegister a) {
#if defined(__CUDACC__)
  return sqrtf(a);
#elif defined(__AVX512F__)
  return _mm512_maskz_sqrt_ps(0xffff, a);
#elif defined(__AVX__)
  return _mm256_sqrt_ps(a);
#elif defined(__SSE__)
  return _mm_sqrt_ps(a);
#else
  for (int i = 0; i < register_lanes; ++i) a[i] = sqrtf(a[i]);
  return a;
#endif
}
/// Square roots of lanes that are not negative.
template <int parts>
EMBRUN_FN Lanes<parts> sqrt_of(Lanes<parts> a) {
  EMBRUN_FOR_PARTS(parts) a.part[i] = sqrt_of(a.part[i]);
  return a;
}

#if !defined(__CUDACC__)
typedef float FourLanes __attribute__((vector_size(16)));
/// Folds the lanes by halves to four; `fold` joins two registers. Left to itself the compiler goes lane by lane.
template <int parts, class Fold>
EMBRUN_FN FourLanes fold_lanes(const Lanes<parts>& v, const Fold& fold) {
  constexpr int fours = parts * register_lanes / 4;
  FourLanes part[fours];
  EMBRUN_FOR_PARTS(parts) __builtin_memcpy(part + i * register_lanes / 4, &v.part[i], sizeof v.part[i]);
  if constexpr (fours == 4) return fold(fold(part[0], part[2]), fold(part[1], part[3]));
  if constexpr (fours == 2) return fold(part[0], part[1]);
  return part[0];
}
#endif
/// Sum of the lanes.
template <int parts>
EMBRUN_FN float sum_lanes(Lanes<parts> v) {
#if defined(__CUDACC__)
  float sum = v.part[0];
  for (int i = 1; i < parts; ++i) sum += v.part[i];
  return sum;
#else
  const FourLanes s = fold_lanes(v, [](FourLanes a, FourLanes b) { return a + b; });
  return (s[0] + s[2]) + (s[1] + s[3]);
#endif
}
/// Sums of four registers' lanes.
struct LaneSums {
  float of[4];
};
EMBRUN_FN LaneSums sum_lanes(RegisterLanes a, RegisterLanes b, RegisterLanes c, RegisterLanes d) {
#if defined(__CUDACC__)
  return {{sum_lanes(a), sum_lanes(b), sum_lanes(c), sum_lanes(d)}};
#else
  // The same sums in the same order as one by one, side by side.
  const auto add = [](FourLanes x, FourLanes y) { return x + y; };
  const FourLanes x = fold_lanes(a, add), y = fold_lanes(b, add), z = fold_lanes(c, add), w = fold_lanes(d, add);
  const FourLanes xy = __builtin_shufflevector(x, y, 0, 1, 4, 5) + __builtin_shufflevector(x, y, 2, 3, 6, 7);
  const FourLanes zw = __builtin_shufflevector(z, w, 0, 1, 4, 5) + __builtin_shufflevector(z, w, 2, 3, 6, 7);
  const FourLanes all = __builtin_shufflevector(xy, zw, 0, 2, 4, 6) + __builtin_shufflevector(xy, zw, 1, 3, 5, 7);
  LaneSums sums;
  __builtin_memcpy(&sums, &all, sizeof sums);
  return sums;
#endif
}
/// Bit i: lane i of `a` is less than that of `b`.
EMBRUN_FN std::uint32_t mask_less(F16 a, F16 b) {
  std::uint32_t mask = 0;
  EMBRUN_FOR_LANE_PARTS {
#if defined(__AVX512F__) && !defined(__CUDACC__)
    const unsigned part = _mm512_cmp_ps_mask(a.part[i], b.part[i], _CMP_LT_OQ);
#elif defined(__AVX__) && !defined(__CUDACC__)
    const auto part = static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(a.part[i], b.part[i], _CMP_LT_OQ)));
#elif defined(__SSE__) && !defined(__CUDACC__)
    const auto part = static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(a.part[i], b.part[i])));
#else
    const unsigned part = a.part[i] < b.part[i] ? 1 : 0;
#endif
    mask |= part << (i * register_lanes);
  }
  return mask;
}
#if defined(__AVX2__) && !defined(__AVX512F__) && !defined(__CUDACC__)
/// Row m: the positions of the bits that are set in m, lowest first.
struct LaneOrders {
  std::uint8_t row[256][8];

  constexpr LaneOrders() : row() {
    for (unsigned mask = 0; mask < 256; ++mask) {
      int used = 0;
      for (unsigned lane = 0; lane < 8; ++lane) {
        if ((mask >> lane & 1u) != 0) row[mask][used++] = static_cast<std::uint8_t>(lane);
      }
    }
  }
};
static constexpr LaneOrders lane_orders{};
#endif
/// Writes the lanes whose bits are set one beside the other. The rest of the 16 floats at `out` may change too.
EMBRUN_FN void compress_store16(float* out, F16 v, std::uint32_t mask) {
#if defined(__AVX512F__) && !defined(__CUDACC__)
  _mm512_storeu_ps(out, _mm512_maskz_compress_ps(static_cast<__mmask16>(mask), v.part[0]));
#elif defined(__AVX2__) && !defined(__CUDACC__)
  for (int i = 0; i < 2; ++i) {
    const std::uint32_t bits = mask >> (8 * i) & 255u;
    const __m128i order = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(lane_orders.row[bits]));
    _mm256_storeu_ps(out, _mm256_permutevar8x32_ps(v.part[i], _mm256_cvtepu8_epi32(order)));
    out += __builtin_popcount(bits);
  }
#else
  for (int i = 0; i < 16; ++i) {
    *out = lane_of(v, i);
    out += mask >> i & 1u;
  }
#endif
}
/// How many lanes of `a` are less than those of `b`.
EMBRUN_FN int count_less(F16 a, F16 b) {
#if defined(__CUDACC__)
  int count = 0;
  EMBRUN_FOR_LANE_PARTS count += a.part[i] < b.part[i] ? 1 : 0;
  return count;
#else
  return __builtin_popcount(mask_less(a, b));
#endif
}
template <int parts>
EMBRUN_FN float max_lane(Lanes<parts> v) {
#if defined(__CUDACC__)
  float most = v.part[0];
  for (int i = 1; i < parts; ++i) most = v.part[i] > most ? v.part[i] : most;
  return most;
#else
  const FourLanes m = fold_lanes(v, [](FourLanes a, FourLanes b) { return a > b ? a : b; });
  const float even = m[0] > m[2] ? m[0] : m[2], odd = m[1] > m[3] ? m[1] : m[3];
  return even > odd ? even : odd;
#endif
}
template <int parts>
EMBRUN_FN float min_lane(Lanes<parts> v) {
  return -max_lane(0.0f - v);
}

/// 1 / sqrt(x) for x in [1e-30, 1e30], relative error at most 5e-6: an integer first guess and two Newton
/// steps, so that every processor and instruction set computes the same value.
template <int parts>
EMBRUN_FN Lanes<parts> rsqrt_of(Lanes<parts> x) {
  Lanes<parts> y;
  EMBRUN_FOR_PARTS(parts) {
    LaneIntRegister bits;
    __builtin_memcpy(&bits, &x.part[i], sizeof bits);
    bits = 0x5f375a86 - (bits >> 1);
    __builtin_memcpy(&y.part[i], &bits, sizeof bits);
  }
  const Lanes<parts> half = x * 0.5f;
  y = y * (1.5f - half * (y * y));
  y = y * (1.5f - half * (y * y));
  return y;
}

/// The same in fewer steps, relative error at most 6.6e-4 [Kadlec2010].
template <int parts>
EMBRUN_FN Lanes<parts> rough_rsqrt_of(Lanes<parts> x) {
  Lanes<parts> y;
  EMBRUN_FOR_PARTS(parts) {
    LaneIntRegister bits;
    __builtin_memcpy(&bits, &x.part[i], sizeof bits);
    bits = 0x5f1ffff9 - (bits >> 1);
    __builtin_memcpy(&y.part[i], &bits, sizeof bits);
  }
  return y * (1.68191391f - 0.703952253f * x * (y * y));
}

/// Square roots of positive lanes, relative error at most 6.6e-4: every second register by the divider, which is idle
/// while the multipliers do the others.
template <int parts>
EMBRUN_FN Lanes<parts> rough_sqrt_of(Lanes<parts> x) {
  EMBRUN_FOR_PARTS(parts) {
    Lanes<1> part;
    part.part[0] = x.part[i];
    x.part[i] = i % 2 == 1 ? sqrt_of(x.part[i]) : (part * rough_rsqrt_of(part)).part[0];
  }
  return x;
}

/// 2^k for lanes that hold integers k in [-126, 127].
template <int parts>
EMBRUN_FN Lanes<parts> power_of_two(Lanes<parts> k) {
  Lanes<parts> r;
  EMBRUN_FOR_PARTS(parts) {
#if defined(__CUDACC__)
    const LaneIntRegister exponent = static_cast<LaneIntRegister>(k.part[i]);
#else
    const LaneIntRegister exponent = __builtin_convertvector(k.part[i], LaneIntRegister);
#endif
    const LaneIntRegister bits = (exponent + 127) << 23;
    __builtin_memcpy(&r.part[i], &bits, sizeof bits);
  }
  return r;
}

/// Number of the lowest and of the highest bit that is set; one must be.
EMBRUN_FN int lowest_bit(std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __ffs(static_cast<int>(bits)) - 1;
#else
  return __builtin_ctz(bits);
#endif
}

EMBRUN_FN int highest_bit(std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return 31 - __clz(static_cast<int>(bits));
#else
  return 31 - __builtin_clz(bits);
#endif
}

/// Sixteen 32-bit integers; as a truth value a lane is -1 or 0.
struct I16 {
  LaneIntRegister part[lane_registers];
};

#define EMBRUN_INT_LANES_BINARY(op)                           \
  EMBRUN_FN I16 operator op(I16 a, I16 b) {                   \
    I16 r;                                                    \
    EMBRUN_FOR_LANE_PARTS r.part[i] = a.part[i] op b.part[i]; \
    return r;                                                 \
  }                                                           \
  EMBRUN_FN I16 operator op(I16 a, std::int32_t b) {          \
    I16 r;                                                    \
    EMBRUN_FOR_LANE_PARTS r.part[i] = a.part[i] op b;         \
    return r;                                                 \
  }
EMBRUN_INT_LANES_BINARY(+)
EMBRUN_INT_LANES_BINARY(-)
EMBRUN_INT_LANES_BINARY(*)
EMBRUN_INT_LANES_BINARY(&)
EMBRUN_INT_LANES_BINARY(|)
EMBRUN_INT_LANES_BINARY(^)
EMBRUN_INT_LANES_BINARY(>>)
EMBRUN_INT_LANES_BINARY(<<)
#undef EMBRUN_INT_LANES_BINARY

EMBRUN_FN I16 splat_int(std::int32_t v) {
  I16 r;
  EMBRUN_FOR_LANE_PARTS r.part[i] = LaneIntRegister{} + v;
  return r;
}
EMBRUN_FN I16 load16(const std::int32_t* p) {
  I16 r;
  EMBRUN_FOR_LANE_PARTS r.part[i] = load_register(p + i * register_lanes);
  return r;
}
EMBRUN_FN void store16(std::int32_t* p, I16 v) {
  EMBRUN_FOR_LANE_PARTS __builtin_memcpy(p + i * register_lanes, &v.part[i], sizeof v.part[i]);
}

// Comparisons give truth values.
EMBRUN_FN I16 less(F16 a, F16 b) {
  I16 r;
  EMBRUN_FOR_LANE_PARTS r.part[i] = a.part[i] < b.part[i];
  return r;
}
EMBRUN_FN I16 at_most(F16 a, F16 b) {
  I16 r;
  EMBRUN_FOR_LANE_PARTS r.part[i] = a.part[i] <= b.part[i];
  return r;
}
EMBRUN_FN I16 less(I16 a, I16 b) {
  I16 r;
  EMBRUN_FOR_LANE_PARTS r.part[i] = a.part[i] < b.part[i];
  return r;
}
EMBRUN_FN I16 equal(I16 a, I16 b) {
  I16 r;
  EMBRUN_FOR_LANE_PARTS r.part[i] = a.part[i] == b.part[i];
  return r;
}
EMBRUN_FN F16 select(I16 condition, F16 yes, F16 no) {
  EMBRUN_FOR_LANE_PARTS yes.part[i] = condition.part[i] != 0 ? yes.part[i] : no.part[i];
  return yes;
}
EMBRUN_FN I16 select(I16 condition, I16 yes, I16 no) {
  EMBRUN_FOR_LANE_PARTS yes.part[i] = condition.part[i] != 0 ? yes.part[i] : no.part[i];
  return yes;
}

EMBRUN_FN F16 to_float(I16 v) {
  F16 r;
  EMBRUN_FOR_LANE_PARTS r.part[i] = to_float(v.part[i]);
  return r;
}
/// The numbers that the bits stand for.
EMBRUN_FN F16 as_float(I16 bits) {
  F16 r;
  static_assert(sizeof r == sizeof bits);
  __builtin_memcpy(&r, &bits, sizeof r);
  return r;
}
/// Towards zero; of lanes that an integer can hold.
EMBRUN_FN I16 truncate(F16 v) {
  I16 r;
  EMBRUN_FOR_LANE_PARTS {
#if defined(__CUDACC__)
    r.part[i] = static_cast<std::int32_t>(v.part[i]);
#else
    r.part[i] = __builtin_convertvector(v.part[i], LaneIntRegister);
#endif
  }
  return r;
}
EMBRUN_FN I16 floor_of(F16 v) {
  const I16 t = truncate(v);
  return t + less(v, to_float(t));
}

/// The truth value with these bits, lane 0 lowest.
EMBRUN_FN I16 truth_of(std::uint32_t bits) {
  I16 r;
  EMBRUN_FOR_LANE_PARTS {
#if defined(__CUDACC__)
    r.part[i] = (bits >> i & 1u) != 0 ? -1 : 0;
#else
    LaneIntRegister bit;
    for (int k = 0; k < register_lanes; ++k) bit[k] = 1 << (i * register_lanes + k);
    r.part[i] = (static_cast<std::int32_t>(bits) & bit) != 0;
#endif
  }
  return r;
}

/// One bit a lane of a truth value, lane 0 lowest.
EMBRUN_FN std::uint32_t lane_bits(I16 truth) {
  std::uint32_t bits = 0;
  EMBRUN_FOR_LANE_PARTS {
#if defined(__AVX512F__) && !defined(__CUDACC__)
    bits |= static_cast<std::uint32_t>(
        _mm512_cmplt_epi32_mask(reinterpret_cast<__m512i>(truth.part[i]), _mm512_setzero_si512()));
#elif defined(__AVX__) && !defined(__CUDACC__)
    bits |= static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(truth.part[i]))) << (8 * i);
#elif defined(__SSE__) && !defined(__CUDACC__)
    bits |= static_cast<std::uint32_t>(_mm_movemask_ps(reinterpret_cast<__m128>(truth.part[i]))) << (4 * i);
#else
    bits |= (truth.part[i] != 0 ? 1u : 0u) << i;
#endif
  }
  return bits;
}

/// columns[k][i] becomes number k of row i, for the rows whose bits are set; what becomes of the others is open. Rows are
/// 16 numbers each, 64-byte aligned, as columns are.
EMBRUN_FN void transpose16(const void* const rows[16], [[maybe_unused]] std::uint32_t which, float columns[16][16]) {
#if defined(__AVX512F__) && !defined(__CUDACC__)
  __m512i r[16], u[16];
  for (int i = 0; i < 16; ++i) r[i] = _mm512_load_si512(rows[i]);
  for (int i = 0; i < 8; ++i) {
    u[2 * i] = _mm512_maskz_unpacklo_epi32(0xffff, r[2 * i], r[2 * i + 1]);
    u[2 * i + 1] = _mm512_maskz_unpackhi_epi32(0xffff, r[2 * i], r[2 * i + 1]);
  }
  // r[4 i + k]: columns k, 4 + k, 8 + k and 12 + k of rows 4 i to 4 i + 3, 128 bits each.
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 2; ++k) {
      r[4 * i + 2 * k] = _mm512_maskz_unpacklo_epi64(0xff, u[4 * i + k], u[4 * i + 2 + k]);
      r[4 * i + 2 * k + 1] = _mm512_maskz_unpackhi_epi64(0xff, u[4 * i + k], u[4 * i + 2 + k]);
    }
  }
  for (int k = 0; k < 4; ++k) {
    const __m512i even_top = _mm512_maskz_shuffle_i32x4(0xffff, r[k], r[4 + k], 0x88);
    const __m512i odd_top = _mm512_maskz_shuffle_i32x4(0xffff, r[k], r[4 + k], 0xdd);
    const __m512i even_bottom = _mm512_maskz_shuffle_i32x4(0xffff, r[8 + k], r[12 + k], 0x88);
    const __m512i odd_bottom = _mm512_maskz_shuffle_i32x4(0xffff, r[8 + k], r[12 + k], 0xdd);
    _mm512_store_si512(columns[k], _mm512_maskz_shuffle_i32x4(0xffff, even_top, even_bottom, 0x88));
    _mm512_store_si512(columns[4 + k], _mm512_maskz_shuffle_i32x4(0xffff, odd_top, odd_bottom, 0x88));
    _mm512_store_si512(columns[8 + k], _mm512_maskz_shuffle_i32x4(0xffff, even_top, even_bottom, 0xdd));
    _mm512_store_si512(columns[12 + k], _mm512_maskz_shuffle_i32x4(0xffff, odd_top, odd_bottom, 0xdd));
  }
#elif defined(__AVX__) && !defined(__CUDACC__)
  // Blocks of eight rows and eight numbers.
  for (int half = 0; half < 4; ++half) {
    const int row = 8 * (half >> 1), number = 8 * (half & 1);
    if ((which >> row & 255u) == 0) continue;
    __m256 r[8], u[8];
    for (int i = 0; i < 8; ++i) r[i] = _mm256_load_ps(static_cast<const float*>(rows[row + i]) + number);
    for (int i = 0; i < 4; ++i) {
      u[2 * i] = _mm256_unpacklo_ps(r[2 * i], r[2 * i + 1]);
      u[2 * i + 1] = _mm256_unpackhi_ps(r[2 * i], r[2 * i + 1]);
    }
    // r[4 i + k]: numbers k and 4 + k of rows 4 i to 4 i + 3, 128 bits each.
    for (int i = 0; i < 2; ++i) {
      r[4 * i] = _mm256_shuffle_ps(u[4 * i], u[4 * i + 2], 0x44);
      r[4 * i + 1] = _mm256_shuffle_ps(u[4 * i], u[4 * i + 2], 0xee);
      r[4 * i + 2] = _mm256_shuffle_ps(u[4 * i + 1], u[4 * i + 3], 0x44);
      r[4 * i + 3] = _mm256_shuffle_ps(u[4 * i + 1], u[4 * i + 3], 0xee);
    }
    for (int k = 0; k < 4; ++k) {
      _mm256_store_ps(columns[number + k] + row, _mm256_permute2f128_ps(r[k], r[4 + k], 0x20));
      _mm256_store_ps(columns[number + 4 + k] + row, _mm256_permute2f128_ps(r[k], r[4 + k], 0x31));
    }
  }
#else
  for (int i = 0; i < 16; ++i) {
    if ((which >> i & 1u) == 0) continue;
    for (int k = 0; k < 16; ++k)
      __builtin_memcpy(&columns[k][i], static_cast<const float*>(rows[i]) + k, sizeof(float));
  }
#endif
}

#undef EMBRUN_FOR_LANE_PARTS
#undef EMBRUN_FOR_PARTS

}  // namespace embrun

#pragma once

#include <cmath>
#include <cstdint>

#if defined(__SSE__) && !defined(__CUDACC__)
#include <immintrin.h>
#endif

#include "base/host_device.h"

namespace embrun {

/// A register of floats as wide as the instruction set of this translation unit has them, and one float on
/// the device. F16 below is made of as many as sixteen lanes need.
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
typedef std::uint16_t LaneShortRegister __attribute__((vector_size(2 * register_lanes)));
// Every function here is inlined, so how a wide vector would be passed does not matter.
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

inline constexpr int lane_registers = 16 / register_lanes;

/// Sixteen single-precision lanes: the block size of the loops over particles.
struct F16 {
  LaneRegister part[lane_registers];
};

#define EMBRUN_FOR_LANE_PARTS for (int i = 0; i < lane_registers; ++i)

#define EMBRUN_LANES_BINARY(op)                               \
  EMBRUN_FN F16 operator op(F16 a, F16 b) {                   \
    F16 r;                                                    \
    EMBRUN_FOR_LANE_PARTS r.part[i] = a.part[i] op b.part[i]; \
    return r;                                                 \
  }                                                           \
  EMBRUN_FN F16 operator op(F16 a, float b) {                 \
    F16 r;                                                    \
    EMBRUN_FOR_LANE_PARTS r.part[i] = a.part[i] op b;         \
    return r;                                                 \
  }                                                           \
  EMBRUN_FN F16 operator op(float a, F16 b) {                 \
    F16 r;                                                    \
    EMBRUN_FOR_LANE_PARTS r.part[i] = a op b.part[i];         \
    return r;                                                 \
  }
EMBRUN_LANES_BINARY(+)
EMBRUN_LANES_BINARY(-)
EMBRUN_LANES_BINARY(*)
EMBRUN_LANES_BINARY(/)
#undef EMBRUN_LANES_BINARY

EMBRUN_FN F16& operator+=(F16& a, F16 b) { return a = a + b; }
EMBRUN_FN F16& operator-=(F16& a, F16 b) { return a = a - b; }

EMBRUN_FN F16 splat(float v) {
  F16 r;
  EMBRUN_FOR_LANE_PARTS r.part[i] = LaneRegister{} + v;
  return r;
}
// Register by register: copied whole, gcc moves it through the stack in halves, and waits for the stores.
EMBRUN_FN F16 load16(const float* p) {
  F16 r;
  EMBRUN_FOR_LANE_PARTS __builtin_memcpy(&r.part[i], p + i * register_lanes, sizeof r.part[i]);
  return r;
}
/// Sixteen 16-bit lattice coordinates as floats.
EMBRUN_FN F16 load16(const std::uint16_t* p) {
  F16 r;
#if defined(__CUDACC__)
  for (int i = 0; i < 16; ++i) r.part[i] = static_cast<float>(p[i]);
#else
  EMBRUN_FOR_LANE_PARTS {
#if defined(__AVX512F__)
    // The compiler widens 16-bit lanes in halves.
    r.part[i] = _mm512_maskz_cvtepi32_ps(
        0xffff, _mm512_maskz_cvtepu16_epi32(0xffff, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p))));
#else
    LaneShortRegister v;
    __builtin_memcpy(&v, p + i * register_lanes, sizeof v);
    r.part[i] = __builtin_convertvector(__builtin_convertvector(v, LaneIntRegister), LaneRegister);
#endif
  }
#endif
  return r;
}
EMBRUN_FN void store16(float* p, F16 v) {
  EMBRUN_FOR_LANE_PARTS __builtin_memcpy(p + i * register_lanes, &v.part[i], sizeof v.part[i]);
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
EMBRUN_FN F16 max_of(F16 a, F16 b) {
  EMBRUN_FOR_LANE_PARTS a.part[i] = larger(a.part[i], b.part[i]);
  return a;
}
EMBRUN_FN F16 min_of(F16 a, F16 b) {
  EMBRUN_FOR_LANE_PARTS a.part[i] = smaller(a.part[i], b.part[i]);
  return a;
}
EMBRUN_FN float lane_of(const F16& v, int lane) {
  float r;
  __builtin_memcpy(&r, reinterpret_cast<const char*>(&v) + 4 * lane, sizeof r);
  return r;
}
/// Lane by lane: a < b ? yes : no.
EMBRUN_FN F16 select_less(F16 a, F16 b, F16 yes, F16 no) {
  EMBRUN_FOR_LANE_PARTS a.part[i] = a.part[i] < b.part[i] ? yes.part[i] : no.part[i];
  return a;
}

/// Square roots of lanes that are not negative.
EMBRUN_FN F16 sqrt_of(F16 a) {
  float lane[16];
  store16(lane, a);
  for (int i = 0; i < 16; ++i) lane[i] = sqrtf(lane[i]);
  return load16(lane);
}

/// Sum of the lanes, in the same order on every instruction set.
EMBRUN_FN float sum_lanes(F16 v) {
#if defined(__CUDACC__)
  float lane[16];
  store16(lane, v);
  float s[8];
  for (int i = 0; i < 8; ++i) s[i] = lane[i] + lane[i + 8];
  for (int i = 0; i < 4; ++i) s[i] += s[i + 4];
  return (s[0] + s[2]) + (s[1] + s[3]);
#else
  // Halves as registers: left to itself the compiler adds lane by lane.
  typedef float Four __attribute__((vector_size(16)));
  Four part[4];
  EMBRUN_FOR_LANE_PARTS __builtin_memcpy(part + i * register_lanes / 4, &v.part[i], sizeof v.part[i]);
  const Four s = (part[0] + part[2]) + (part[1] + part[3]);
  return (s[0] + s[2]) + (s[1] + s[3]);
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
EMBRUN_FN float max_lane(F16 v) {
  float lane[16];
  store16(lane, v);
  float m = lane[0];
  for (int i = 1; i < 16; ++i) m = lane[i] > m ? lane[i] : m;
  return m;
}
EMBRUN_FN float min_lane(F16 v) { return -max_lane(0.0f - v); }

/// 1 / sqrt(x) for x in [1e-30, 1e30], relative error at most 5e-6: an integer first guess and two Newton
/// steps, so that every processor and instruction set computes the same value.
EMBRUN_FN F16 rsqrt_of(F16 x) {
  F16 y;
  EMBRUN_FOR_LANE_PARTS {
    LaneIntRegister bits;
    __builtin_memcpy(&bits, &x.part[i], sizeof bits);
    bits = 0x5f375a86 - (bits >> 1);
    __builtin_memcpy(&y.part[i], &bits, sizeof bits);
  }
  const F16 half = x * 0.5f;
  y = y * (1.5f - half * (y * y));
  y = y * (1.5f - half * (y * y));
  return y;
}

/// The same in fewer steps, relative error at most 6.6e-4 [Kadlec2010].
EMBRUN_FN F16 rough_rsqrt_of(F16 x) {
  F16 y;
  EMBRUN_FOR_LANE_PARTS {
    LaneIntRegister bits;
    __builtin_memcpy(&bits, &x.part[i], sizeof bits);
    bits = 0x5f1ffff9 - (bits >> 1);
    __builtin_memcpy(&y.part[i], &bits, sizeof bits);
  }
  return y * (1.68191391f - 0.703952253f * x * (y * y));
}

/// 2^k for lanes that hold integers k in [-126, 127].
EMBRUN_FN F16 power_of_two(F16 k) {
  F16 r;
  EMBRUN_FOR_LANE_PARTS {
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
  EMBRUN_FOR_LANE_PARTS __builtin_memcpy(&r.part[i], p + i * register_lanes, sizeof r.part[i]);
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
  EMBRUN_FOR_LANE_PARTS {
#if defined(__CUDACC__)
    r.part[i] = static_cast<float>(v.part[i]);
#else
    r.part[i] = __builtin_convertvector(v.part[i], LaneRegister);
#endif
  }
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

/// columns[k][i] becomes number k of row i; rows are 16 numbers each, 64-byte aligned, as columns are.
EMBRUN_FN void transpose16(const void* const rows[16], float columns[16][16]) {
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
#else
  for (int i = 0; i < 16; ++i) {
    for (int k = 0; k < 16; ++k)
      __builtin_memcpy(&columns[k][i], static_cast<const float*>(rows[i]) + k, sizeof(float));
  }
#endif
}

#undef EMBRUN_FOR_LANE_PARTS

}  // namespace embrun

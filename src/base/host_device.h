#pragma once

/// Marks code that runs per ray, on the host and on the device alike.
///
/// EMBRUN_FN is for small functions (operators, formulas). They are always inlined, so that no
/// out-of-line copy compiled for one instruction set can be picked by the linker for another
/// (backend/cpu compiles the per-ray code once per instruction set).
/// EMBRUN_LOCAL_FN is for larger ones: one private copy per translation unit, same reason.
#if defined(__CUDACC__)
#define EMBRUN_FN __host__ __device__ __forceinline__
#define EMBRUN_LOCAL_FN __host__ __device__ [[maybe_unused]] static
#else
#define EMBRUN_FN inline __attribute__((always_inline))
#define EMBRUN_LOCAL_FN [[maybe_unused]] static
#endif

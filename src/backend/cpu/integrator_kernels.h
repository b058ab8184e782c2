#pragma once

#include "backend/cpu/kernel_table.h"

// The integrators besides the path tracer, compiled once per instruction set as kernels.cpp is. They are apart from it so
// that the compiler's choices for it do not depend on them.

namespace embrun::EMBRUN_ISA_NAMESPACE {

/// As KernelTable::trace_samples.
void trace_whitted(const PathScene& scene, const CpuSceneView& view, const PixelSample* samples, int count,
                   FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters);
void trace_occlusion(const PathScene& scene, const CpuSceneView& view, const PixelSample* samples, int count,
                     FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters);
void trace_gauss(const PathScene& scene, const CpuSceneView& view, const PixelSample* samples, int count,
                 FilmSample* results, bool timed, PathBatch& batch, PathCounters& counters);

}  // namespace embrun::EMBRUN_ISA_NAMESPACE

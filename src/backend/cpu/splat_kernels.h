#pragma once

#include "backend/cpu/splat_trial.h"
#include "geometry/surface_hit.h"

// Rays against one cloud of splats alone, by any search, compiled once per instruction set as kernels.cpp is.

namespace embrun::EMBRUN_ISA_NAMESPACE {

/// What each ray meets, starting outside of the cloud.
void trace_splats(const SplatTrial& trial, SplatSearchChoice choice, const Ray* rays, int count, SurfaceHit* hits,
                  bool* found);

}  // namespace embrun::EMBRUN_ISA_NAMESPACE

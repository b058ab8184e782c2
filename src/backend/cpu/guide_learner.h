#pragma once

#include "backend/cpu/kernel_table.h"
#include "sampling/distribution_builder.h"

namespace embrun {

/// Owner of a DirectionGuide's tables.
struct LearnedGuide {
  DistributionTable air, body;

  DirectionGuide view() const;
};

/// Whether a guide is worth its time: there is water to refract light, and light that is not the same all round.
bool needs_guide(const FlatScene& scene);

/// Follows up to 130,000 paths from all over the picture (whatever the crop) and notes from where the light came at the
/// first diffuse surfaces they met. Depends on the scene, the picture's size and the seed alone, so that a crop or a
/// single sample is rendered as the whole is. The scene's own guide must be empty.
LearnedGuide learn_guide(const KernelTable& kernels, const PathScene& scene, const CpuSceneView& view);

}  // namespace embrun

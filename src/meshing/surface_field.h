#pragma once

#include <span>
#include <vector>

#include "geometry/field_sums.h"
#include "geometry/particle_blocks.h"
#include "geometry/surface_model.h"

namespace embrun {

/// The field g = max(D/T, D'/T') - 1 of a surface as the mesher asks for it: positive in the body. Reads only its own
/// arrays once built, so threads may share it.
class SurfaceField {
 public:
  /// Particles of both branches that may be felt in a box.
  struct Near {
    std::vector<ParticleBlock> main, recovered;
    std::size_t main_count = 0, recovered_count = 0;
    std::vector<ParticleBlock> far;    ///< of the main branch, apart from `main` where `sample` has packed them
    std::vector<std::uint32_t> found;  ///< scratch

    bool empty() const { return main_count == 0 && recovered_count == 0; }
  };
  /// How a box stands to the body; `open`: nothing was proven.
  enum class Region { outside, inside, open };

  /// `radii` as for resolve_surface_model.
  SurfaceField(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceModel& model);

  /// Where particles are and how far each of them is felt, sixteen at a time: outside of all these g is -1.
  std::span<const ReachBox> reach() const { return main_.bounds(); }

  void find(Vec3 low, Vec3 high, Near& near) const;
  /// Of the particles `from`, found for a box that holds this one.
  void find(const Near& from, Vec3 low, Vec3 high, Near& near) const;

  /// What bounds prove of a box; `near` may have been found for a larger one.
  Region classify(Vec3 low, Vec3 high, const Near& near) const;
  /// Drops from `near`, which may have been found for a larger box, the branches that cannot reach the surface in this one.
  void drop_weak(Vec3 low, Vec3 high, Near& near) const;

  /// g at the 4 x 4 x 4 points corner + cell (i, j, k), i fastest; `near` may have been found for a larger box. Stops as
  /// soon as all points are known to be on one side.
  Region sample(const Near& near, Vec3 corner, float cell, Near& scratch, float* values) const;
  /// g and its derivative along an axis, of the larger branch.
  struct Slope {
    float value, slope;
    bool recovered;  ///< that is the larger one
  };
  Slope slope(const Near& near, Vec3 x, int axis) const;
  /// g, and the surface's outward unit normal of the model's kind, of the larger branch.
  struct Normal {
    float value = 0;
    Vec3 normal{};
    bool recovered = false;
  };
  Normal normal(const Near& near, Vec3 x) const;

 private:
  Kernel kernel_;
  NormalMode normal_;
  float inverse_threshold_, inverse_recover_threshold_;
  float smallest_influence_;
  ParticleBlocks main_, recovered_;
};

}  // namespace embrun

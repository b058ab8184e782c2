#pragma once

#include <span>
#include <vector>

#include "lights/environment_image.h"
#include "lights/light_set.h"

namespace embrun {

/// Collects a scene's lights and owns the arrays of its LightSet.
class LightSetBuilder {
 public:
  void set_constant_environment(Rgb radiance);
  /// `image` must outlive the view.
  void set_environment(const EnvironmentImage& image, UpAxis up, float turn = 0);
  /// Returns the light's index. Throws Error for a light without area or of negative or non-finite radiance.
  int add(const Light& light);
  int add_triangles(std::span<const LightTriangle> triangles, Rgb radiance, bool two_sided = false);
  /// Fixes the choice probabilities: power, where light from infinity counts over a disk of `scene_radius` (metres).
  /// Every light with power keeps at least a tenth of an equal share.
  void finish(float scene_radius);

  /// Valid after finish() and while this object lives and stays unchanged.
  LightSet view() const;
  bool empty() const { return lights_.empty(); }

 private:
  std::vector<Light> lights_;
  std::vector<LightTriangle> triangles_;
  std::vector<float> triangle_cdf_;
  std::vector<float> choice_cdf_;
  Environment environment_;
  Rgb environment_mean_;
  int environment_index_ = -1;
};

}  // namespace embrun

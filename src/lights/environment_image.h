#pragma once

#include <cstdint>
#include <vector>

#include "lights/environment.h"
#include "sampling/distribution_builder.h"

namespace embrun {

/// Owns a latitude-longitude image and what is needed to sample it.
class EnvironmentImage {
 public:
  EnvironmentImage() = default;
  /// `rgb` is width x height x 3, row 0 at the zenith (see Environment). Values that are negative or not finite count
  /// as 0; `bad_values()` says how many there were. Throws Error when the size is not positive or does not match.
  EnvironmentImage(int width, int height, std::vector<float> rgb);

  /// View for rendering; valid while this object lives and is not assigned to.
  Environment view(UpAxis up, float turn = 0) const;

  int width() const { return width_; }
  int height() const { return height_; }
  const std::vector<float>& rgb() const { return rgb_; }
  int64_t bad_values() const { return bad_values_; }
  /// Mean radiance over the sphere.
  Rgb mean_radiance() const { return mean_radiance_; }

 private:
  int width_ = 0, height_ = 0;
  std::vector<float> rgb_;
  DistributionTable pixels_;
  Rgb mean_radiance_;
  int64_t bad_values_ = 0;
};

}  // namespace embrun

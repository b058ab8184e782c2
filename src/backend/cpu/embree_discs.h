#pragma once

#include "geometry/splat_searches.h"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace embrun {

/// Splats as Embree's oriented discs, to measure against. Ellipses become discs of their greater half axis.
class EmbreeDiscs {
 public:
  /// Throws Error when Embree fails.
  explicit EmbreeDiscs(const PackedSplats& packed);
  ~EmbreeDiscs();
  EmbreeDiscs(const EmbreeDiscs&) = delete;
  EmbreeDiscs& operator=(const EmbreeDiscs&) = delete;

  RTCSceneTy* scene() const { return scene_; }

 private:
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* scene_ = nullptr;
};

}  // namespace embrun

#pragma once

#include <memory>
#include <vector>

#include "backend/cpu/splat_trial.h"
#include "image/image.h"
#include "scene/flat_scene.h"

namespace embrun {

class EmbreeDiscs;

/// What a search costs.
struct SplatSearchTime {
  double ns_per_ray = 0;  ///< of processor time
  std::size_t rays = 0;   ///< that were timed
  double hits = 0;        ///< share of them that met the surface
};

/// One cloud, and all the searches that may find what rays meet on it: what figure 29 of the thesis measures
/// [Beddiaf2018]. All of them run on one thread in the code of this machine's instruction set, and find the same hits.
class SplatBench {
 public:
  /// At least one splat. The camera of the rays looks along -z from in front of the cloud, which fills its square picture.
  SplatBench(const std::vector<Splat>& splats, bool closed, int pixels);
  ~SplatBench();

  std::size_t splat_count() const { return packed_.splats.size(); }
  /// Rays of the picture that meet the box round the cloud; the others cost no search anything and count for none.
  std::size_t ray_count() const { return rays_.size(); }
  double tree_seconds() const { return tree_seconds_; }

  /// The least of some times of all rays, or of as many of them, evenly spread, as keep within `seconds`.
  SplatSearchTime time(const SplatSearchChoice& choice, double seconds) const;
  /// The share of rays, of some, on which a search and the tree disagree by more than rounding.
  double disagreement(const SplatSearchChoice& choice, std::size_t most_rays) const;

  /// The picture under a light beside the camera; `mirror`: a mirror in a room of light and dark panels instead.
  Image picture(SplatRules rules, bool mirror, bool closed) const;
  bool closed() const { return trial_.set.closed; }

 private:
  SplatArrays arrays_;
  PackedSplats packed_;
  SplatGrid grid_;
  std::unique_ptr<EmbreeDiscs> discs_;
  SplatTrial trial_;
  std::vector<Ray> rays_;
  std::vector<std::size_t> pixels_;  ///< of the rays
  int side_ = 0;
  double tree_seconds_ = 0;
};

/// The share of figure 33's picture that the rules change, the cloud being taken for closed as the thesis does: pixels of (a) and (b) that differ, and the picture of it.
struct SplatRulesDifference {
  Image without, with, difference;
  double changed = 0;  ///< share of the pixels that show the cloud in either
  double removed = 0;  ///< share of those that show it without the rules alone
};
SplatRulesDifference compare_splat_rules(const SplatBench& bench);

}  // namespace embrun

#pragma once

#include <string>
#include <vector>

#include "math/rgb.h"
#include "particles/particle_set.h"

namespace embrun {

/// "spectrum" (blue, green, yellow, red), "heat" (dark red to white) or "grey"; throws Error for another name.
void check_color_map(const std::string& name);

/// Colours for particles by an attribute's values; vectors count by their length.
struct ColorsByAttribute {
  std::vector<Rgb> colors;     ///< linear, each channel in [0, 1]
  double least = 0, most = 0;  ///< of all values
  double low = 0, high = 0;    ///< what the ends of the map stand for: the values' first and last hundredth lie beyond
};

/// Throws Error naming `file` when the particles have no such attribute.
ColorsByAttribute color_by_attribute(const ParticleSet& particles, const std::string& attribute, const std::string& map,
                                     const std::string& file);

}  // namespace embrun

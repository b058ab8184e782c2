#pragma once

#include <string>
#include <vector>

#include "image/line_chart.h"
#include "particles/radius.h"

namespace embrun {

// The curves of the thesis's chapter 5 as charts.

/// A chart and the file it goes to.
struct Curve {
  std::string file;     ///< figure-50a.svg
  std::string caption;  ///< a sentence or two
  LineChart chart;
};

/// Figure 50: transmittance and optical depth along a line through the particles, whose balls have the extinction (1/m).
std::vector<Curve> depth_curves(const SizedParticles& sized, double extinction);

/// Figures 54, 55, 57 and 58: the surface, in section, of a block of particles spaced as in the data with a lone drop
/// beside it, for three thresholds, for the first order beside the balls themselves, and for the third; and the field of
/// the second order along a row of them. `spacing` over the radius R0 = 1.
std::vector<Curve> surface_curves(double spacing);

}  // namespace embrun

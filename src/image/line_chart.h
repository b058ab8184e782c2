#pragma once

#include <optional>
#include <string>
#include <vector>

namespace embrun {

struct ChartAxis {
  std::string label;
  bool logarithmic = false;
  std::optional<double> low, high;  ///< default: round numbers round the data
};

/// Points joined by straight lines in their order. A point that is not finite, or not positive on a logarithmic axis,
/// is left out and leaves a gap.
struct ChartSeries {
  std::string name;  ///< in the legend
  std::vector<double> x, y;
  bool line = true, markers = false;
};

struct LineChart {
  std::string title;
  ChartAxis x, y;
  std::vector<ChartSeries> series;
  int width = 720, height = 440;  ///< pixels, at least 200 each
};

/// The chart as an SVG document: title, axes with ticks, grid and labels, the series in colours that colour-blind eyes
/// can tell apart [Okabe2008], and, for more than one, a legend beside the axes. Throws Error when no point can be
/// drawn, when a series has not as many x as y, or when an axis runs from a low to no higher, or to no positive,
/// number.
std::string to_svg(const LineChart& chart);

/// Where an axis from low to high (low < high; both positive on a logarithmic one) has its ticks: multiples of 1, 2 or
/// 5 times a power of ten, about five of them; on a logarithmic axis powers of ten, or these and their 2- and 5-fold
/// where it spans less than two.
std::vector<double> axis_ticks(double low, double high, bool logarithmic);

}  // namespace embrun

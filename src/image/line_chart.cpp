#include "image/line_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/error.h"

namespace embrun {
namespace {

constexpr std::array<const char*, 7> colors{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                            "#e69f00", "#56b4e9", "#000000"};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

double scaled(double v, bool logarithmic) { return logarithmic ? std::log10(v) : v; }

bool is_drawable(double v, const ChartAxis& axis) { return std::isfinite(v) && (!axis.logarithmic || v > 0); }

/// 1, 2 or 5 times a power of ten: the largest such step that divides the span into at least four.
double round_step(double span) {
  const double decade = std::pow(10.0, std::floor(std::log10(span / 4)));
  const double rest = span / 4 / decade * (1 + 1e-9);
  return decade * (rest >= 5 ? 5 : rest >= 2 ? 2 : 1);
}

// ---- where things lie --------------------------------------------------------------------------------------------

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void add(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
};

/// The axis' ends: those given, else ticks that enclose the data.
Range axis_range(const ChartAxis& axis, Range data) {
  if (data.low > data.high) throw Error("chart: no point can be drawn");
  if (axis.logarithmic) {
    data = {std::pow(10.0, std::floor(std::log10(data.low) + 1e-9)),
            std::pow(10.0, std::ceil(std::log10(data.high) - 1e-9))};
    if (!(data.low < data.high)) data.high = 10 * data.low;
  } else {
    if (!(data.low < data.high)) {
      const double reach = data.low != 0 ? 0.5 * std::abs(data.low) : 1;
      data = {data.low - reach, data.high + reach};
    }
    const double step = round_step(data.high - data.low);
    data = {step * std::floor(data.low / step + 1e-9), step * std::ceil(data.high / step - 1e-9)};
  }
  data = {axis.low.value_or(data.low), axis.high.value_or(data.high)};
  if (!(std::isfinite(data.low) && std::isfinite(data.high) && data.low < data.high) ||
      (axis.logarithmic && data.low <= 0))
    throw Error(fmt::format("chart: the axis \"{}\" cannot run from {:g} to {:g}", axis.label, data.low, data.high));
  return data;
}

/// The plot's rectangle in the document, and the axes' ends.
struct Frame {
  const LineChart& chart;
  double left, top, right, bottom;
  Range x, y;

  static double along(const ChartAxis& axis, const Range& range, double v) {
    const double low = scaled(range.low, axis.logarithmic), high = scaled(range.high, axis.logarithmic);
    return (scaled(v, axis.logarithmic) - low) / (high - low);
  }
  double place_x(double v) const { return left + (right - left) * along(chart.x, x, v); }
  double place_y(double v) const { return bottom - (bottom - top) * along(chart.y, y, v); }
  bool contains(double px, double py) const {
    constexpr double rounding = 0.01;
    return px >= left - rounding && px <= right + rounding && py >= top - rounding && py <= bottom + rounding;
  }
};

Frame make_frame(const LineChart& chart) {
  if (chart.width < 200 || chart.height < 200)
    throw Error(fmt::format("chart: a size of {}x{} pixels is below 200x200", chart.width, chart.height));
  Range x, y;
  std::size_t longest = 0;
  for (const ChartSeries& series : chart.series) {
    if (series.x.size() != series.y.size())
      throw Error(
          fmt::format("chart: the series \"{}\" has {} x and {} y", series.name, series.x.size(), series.y.size()));
    longest = std::max(longest, series.name.size());
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (!is_drawable(series.x[i], chart.x) || !is_drawable(series.y[i], chart.y)) continue;
      x.add(series.x[i]);
      y.add(series.y[i]);
    }
  }
  // A letter is about 7 pixels wide at this size; the legend has its line before it.
  const double legend =
      chart.series.size() > 1 ? std::min(40 + 7.0 * static_cast<double>(longest), 0.4 * chart.width) : 0;
  return {chart,
          76,
          chart.title.empty() ? 20.0 : 44.0,
          chart.width - 24 - legend,
          chart.height - 56.0,
          axis_range(chart.x, x),
          axis_range(chart.y, y)};
}

// ---- drawing -----------------------------------------------------------------------------------------------------

std::string text(double x, double y, const char* anchor, const std::string& content, const char* more = "") {
  return fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     escaped(content));
}

std::string line(double x0, double y0, double x1, double y1, const char* stroke) {
  return fmt::format("<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" stroke=\"{}\"/>\n", x0, y0, x1, y1,
                     stroke);
}

std::string draw_axes(const Frame& f) {
  constexpr const char *grid = "#dddddd", *ink = "#333333";
  std::string out = "<g class=\"x-axis\">\n";
  for (const double tick : axis_ticks(f.x.low, f.x.high, f.chart.x.logarithmic)) {
    const double x = f.place_x(tick);
    out += line(x, f.top, x, f.bottom, grid) + line(x, f.bottom, x, f.bottom + 5, ink) +
           text(x, f.bottom + 20, "middle", fmt::format("{:g}", tick), " class=\"tick\"");
  }
  out += text(0.5 * (f.left + f.right), f.chart.height - 14.0, "middle", f.chart.x.label, " class=\"label\"");
  out += "</g>\n<g class=\"y-axis\">\n";
  for (const double tick : axis_ticks(f.y.low, f.y.high, f.chart.y.logarithmic)) {
    const double y = f.place_y(tick);
    out += line(f.left, y, f.right, y, grid) + line(f.left - 5, y, f.left, y, ink) +
           text(f.left - 9, y + 4, "end", fmt::format("{:g}", tick), " class=\"tick\"");
  }
  const double middle = 0.5 * (f.top + f.bottom);
  out += text(18, middle, "middle", f.chart.y.label,
              fmt::format(" class=\"label\" transform=\"rotate(-90 18 {:.2f})\"", middle).c_str());
  return out +
         fmt::format(
             "</g>\n<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"none\" stroke=\"{}\"/>\n",
             f.left, f.top, f.right - f.left, f.bottom - f.top, ink);
}

/// One polyline for each run of points that can be drawn, cut off at the axes' ends, and the markers between these.
std::string draw_series(const Frame& f, const ChartSeries& series, const char* color) {
  std::string out = fmt::format("<g class=\"series\"><title>{}</title>\n", escaped(series.name));
  std::string points, markers;
  const auto finish = [&] {
    if (series.line && !points.empty())
      out += fmt::format(
          "<polyline clip-path=\"url(#plot)\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\" points=\"{}\"/>\n", color,
          points);
    points.clear();
  };
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!is_drawable(series.x[i], f.chart.x) || !is_drawable(series.y[i], f.chart.y)) {
      finish();
      continue;
    }
    const double x = f.place_x(series.x[i]), y = f.place_y(series.y[i]);
    points += fmt::format("{}{:.2f},{:.2f}", points.empty() ? "" : " ", x, y);
    if (series.markers && f.contains(x, y))
      markers += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"3.5\" fill=\"{}\"/>\n", x, y, color);
  }
  finish();
  return out + markers + "</g>\n";
}

std::string draw_legend(const Frame& f) {
  std::string out = "<g class=\"legend\">\n";
  for (std::size_t i = 0; i < f.chart.series.size(); ++i) {
    const ChartSeries& series = f.chart.series[i];
    const char* color = colors[i % colors.size()];
    const double x = f.right + 14, y = f.top + 12 + 20 * static_cast<double>(i);
    if (series.line)
      out += fmt::format(
          "<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" stroke=\"{}\" stroke-width=\"2\"/>\n", x,
          y - 4, x + 20, y - 4, color);
    if (series.markers)
      out += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"3.5\" fill=\"{}\"/>\n", x + 10, y - 4, color);
    out += text(x + 26, y, "start", series.name);
  }
  return out + "</g>\n";
}

}  // namespace

std::vector<double> axis_ticks(double low, double high, bool logarithmic) {
  EMBRUN_CHECK(low < high && (!logarithmic || low > 0));
  std::vector<double> ticks;
  if (!logarithmic) {
    const double step = round_step(high - low);
    const double last = std::floor(high / step + 1e-9);
    for (double i = std::ceil(low / step - 1e-9); i <= last; ++i) ticks.push_back(i * step + 0.0);
    return ticks;
  }
  const double span = std::log10(high / low);
  const int stride = std::max(1, static_cast<int>(std::ceil(span / 10)));
  for (int decade = static_cast<int>(std::floor(std::log10(low) + 1e-9)); decade <= std::log10(high) + 1e-9;
       decade += stride) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double tick = factor * std::pow(10.0, decade);
      if (factor != 1 && span >= 2) continue;
      if (tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9)) ticks.push_back(tick);
    }
  }
  return ticks;
}

std::string to_svg(const LineChart& chart) {
  const Frame f = make_frame(chart);
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" font-size=\"13\" fill=\"#111111\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n"
      "<clipPath id=\"plot\"><rect x=\"{2:.2f}\" y=\"{3:.2f}\" width=\"{4:.2f}\" height=\"{5:.2f}\"/></clipPath>\n",
      chart.width, chart.height, f.left, f.top, f.right - f.left, f.bottom - f.top);
  if (!chart.title.empty())
    out += text(0.5 * chart.width, 26, "middle", chart.title, " class=\"title\" font-size=\"16\"");
  out += draw_axes(f);
  for (std::size_t i = 0; i < chart.series.size(); ++i)
    out += draw_series(f, chart.series[i], colors[i % colors.size()]);
  if (chart.series.size() > 1) out += draw_legend(f);
  return out + "</svg>\n";
}

}  // namespace embrun

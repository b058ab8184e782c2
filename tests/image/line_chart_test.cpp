#include "image/line_chart.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <pugixml.hpp>
#include <sstream>

#include "base/error.h"

namespace embrun {
namespace {

/// Two series; the second has a gap.
LineChart sample() {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  LineChart chart;
  chart.title = "Kernels & <fields>";
  chart.x.label = "r / R0";
  chart.y.label = "f";
  chart.series.push_back({"metaball", {0, 1, 2}, {0, 5, 10}, true, true});
  chart.series.push_back({"zhu-bridson", {0, 0.5, 1, 1.5, 2}, {1, 2, nan, 2, 1}});
  return chart;
}

pugi::xml_document parsed(const LineChart& chart) {
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_string(to_svg(chart).c_str());
  EXPECT_TRUE(result) << result.description();
  return document;
}

pugi::xml_node group(const pugi::xml_document& document, const char* name) {
  return document.child("svg").find_child_by_attribute("g", "class", name);
}

std::vector<double> numbers(std::string text) {
  for (char& c : text)
    if (c == ',') c = ' ';
  std::istringstream stream(text);
  std::vector<double> values;
  for (double v; stream >> v;) values.push_back(v);
  return values;
}

std::vector<std::string> tick_labels(const pugi::xml_document& document, const char* axis) {
  std::vector<std::string> labels;
  for (const pugi::xml_node text : group(document, axis).children("text"))
    if (std::string(text.attribute("class").value()) == "tick") labels.emplace_back(text.child_value());
  return labels;
}

TEST(LineChart, HasTitleAxesSeriesAndLegend) {
  const pugi::xml_document document = parsed(sample());
  const pugi::xml_node svg = document.child("svg");
  EXPECT_STREQ(svg.find_child_by_attribute("text", "class", "title").child_value(), "Kernels & <fields>");
  EXPECT_STREQ(group(document, "x-axis").find_child_by_attribute("text", "class", "label").child_value(), "r / R0");
  EXPECT_EQ(tick_labels(document, "x-axis"), (std::vector<std::string>{"0", "0.5", "1", "1.5", "2"}));
  EXPECT_EQ(tick_labels(document, "y-axis"), (std::vector<std::string>{"0", "2", "4", "6", "8", "10"}));
  std::vector<std::string> legend;
  for (const pugi::xml_node text : group(document, "legend").children("text")) legend.emplace_back(text.child_value());
  EXPECT_EQ(legend, (std::vector<std::string>{"metaball", "zhu-bridson"}));
}

// The plot's corners are those of the clip rectangle: x 0 to 2 and y 0 to 10 run over it, y upwards.
TEST(LineChart, PointsLieWhereTheAxesSay) {
  const pugi::xml_document document = parsed(sample());
  const pugi::xml_node plot = document.child("svg").child("clipPath").child("rect");
  const double left = plot.attribute("x").as_double(), top = plot.attribute("y").as_double();
  const double width = plot.attribute("width").as_double(), height = plot.attribute("height").as_double();
  const pugi::xml_node series = group(document, "series");
  const std::vector<double> points = numbers(series.child("polyline").attribute("points").value());
  ASSERT_EQ(points.size(), 6u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(points[2 * i], left + width * static_cast<double>(i) / 2, 0.011) << i;
    EXPECT_NEAR(points[2 * i + 1], top + height * (1 - static_cast<double>(i) / 2), 0.011) << i;
  }
  EXPECT_EQ(std::distance(series.children("circle").begin(), series.children("circle").end()), 3);
}

TEST(LineChart, PointsThatAreNoNumbersLeaveAGap) {
  const pugi::xml_document document = parsed(sample());
  const pugi::xml_node second = group(document, "series").next_sibling("g");
  EXPECT_STREQ(second.child("title").child_value(), "zhu-bridson");
  std::vector<std::size_t> lengths;
  for (const pugi::xml_node line : second.children("polyline"))
    lengths.push_back(numbers(line.attribute("points").value()).size() / 2);
  EXPECT_EQ(lengths, (std::vector<std::size_t>{2, 2}));
}

TEST(LineChart, LogarithmicAxesSpaceDecadesEvenly) {
  LineChart chart;
  chart.x.logarithmic = chart.y.logarithmic = true;
  chart.series.push_back({"time", {1, 10, 100, 0, 1000}, {0.01, 0.1, 1, 5, 10}});
  const pugi::xml_document document = parsed(chart);
  EXPECT_EQ(tick_labels(document, "x-axis"), (std::vector<std::string>{"1", "10", "100", "1000"}));
  EXPECT_EQ(tick_labels(document, "y-axis"), (std::vector<std::string>{"0.01", "0.1", "1", "10"}));
  EXPECT_FALSE(group(document, "legend"));  // one series needs none
  const std::vector<double> points = numbers(group(document, "series").child("polyline").attribute("points").value());
  ASSERT_EQ(points.size(), 6u);
  EXPECT_NEAR(points[2] - points[0], points[4] - points[2], 0.021);
  EXPECT_NEAR(points[1] - points[3], points[3] - points[5], 0.021);
}

void expect_ticks(double low, double high, bool logarithmic, const std::vector<double>& expected) {
  const std::vector<double> ticks = axis_ticks(low, high, logarithmic);
  ASSERT_EQ(ticks.size(), expected.size()) << low << " to " << high;
  for (std::size_t i = 0; i < ticks.size(); ++i)
    EXPECT_NEAR(ticks[i], expected[i], 1e-9 * high) << low << " to " << high;
}

TEST(LineChart, TicksAreRound) {
  expect_ticks(0, 1, false, {0, 0.2, 0.4, 0.6, 0.8, 1});
  expect_ticks(-0.3, 0.75, false, {-0.2, 0, 0.2, 0.4, 0.6});
  expect_ticks(0, 4e6, false, {0, 1e6, 2e6, 3e6, 4e6});
  expect_ticks(3, 40, true, {5, 10, 20});
  expect_ticks(0.5, 2000, true, {1, 10, 100, 1000});
  expect_ticks(1e-12, 1e9, true, {1e-12, 1e-9, 1e-6, 1e-3, 1, 1e3, 1e6, 1e9});
}

TEST(LineChart, LimitsOfAnAxisCanBeGiven) {
  LineChart chart = sample();
  chart.y.low = -10;
  chart.y.high = 30;
  EXPECT_EQ(tick_labels(parsed(chart), "y-axis"), (std::vector<std::string>{"-10", "0", "10", "20", "30"}));
}

// Whole markers on the axes' ends, none beyond them.
TEST(LineChart, MarkersEndWithTheAxes) {
  LineChart chart = sample();
  chart.y.low = 0;
  chart.y.high = 5;
  const pugi::xml_document document = parsed(chart);
  const pugi::xml_node series = group(document, "series");
  EXPECT_EQ(std::distance(series.children("circle").begin(), series.children("circle").end()), 2);
  EXPECT_STREQ(series.child("polyline").attribute("clip-path").value(), "url(#plot)");
  EXPECT_FALSE(series.attribute("clip-path"));
}

TEST(LineChart, OneValueAloneHasAxesRoundIt) {
  LineChart chart;
  chart.series.push_back({"mse", {3}, {0.0048}, false, true});
  const pugi::xml_document document = parsed(chart);
  EXPECT_GE(tick_labels(document, "y-axis").size(), 3u);
  EXPECT_FALSE(group(document, "series").child("polyline"));
  EXPECT_TRUE(group(document, "series").child("circle"));
}

TEST(LineChart, WhatCannotBeDrawnIsRefused) {
  LineChart chart;
  EXPECT_THROW(to_svg(chart), Error);
  chart.series.push_back({"a", {1, 2}, {1}});
  EXPECT_THROW(to_svg(chart), Error);
  chart.series[0].y = {-1, 0};
  chart.y.logarithmic = true;
  EXPECT_THROW(to_svg(chart), Error);
  chart.y.logarithmic = false;
  EXPECT_NO_THROW(to_svg(chart));
  chart.x.low = 5;
  chart.x.high = 4;
  EXPECT_THROW(to_svg(chart), Error);
  chart.x = {};
  chart.width = 10;
  EXPECT_THROW(to_svg(chart), Error);
}

}  // namespace
}  // namespace embrun

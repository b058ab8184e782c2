#include "io/scene/values.h"

#include <fmt/format.h>

#include <cmath>

#include "io/text.h"
#include "math/spectrum.h"

namespace embrun {
namespace {

/// sin and cos in degrees, exact for quarter turns.
struct Turn {
  double sine, cosine;
};
Turn turn_by(double degrees) {
  const double quarters = degrees / 90;
  if (quarters == std::round(quarters) && std::abs(quarters) < 1e6) {
    const int q = static_cast<int>(quarters) & 3;
    return {q == 1 ? 1.0 : q == 3 ? -1.0 : 0.0, q == 0 ? 1.0 : q == 2 ? -1.0 : 0.0};
  }
  return {std::sin(degrees * (M_PI / 180)), std::cos(degrees * (M_PI / 180))};
}

double attribute_or(const XmlTree& tree, const XmlElement& element, const char* name, double fallback) {
  const std::string* text = element.find(name);
  return text != nullptr ? parse_number(tree, element, name, *text) : fallback;
}

/// The x, y, z of an element, or the three (or one, for all) numbers of its value.
Vec3d read_components(const XmlTree& tree, const XmlElement& element, double fallback, bool one_for_all) {
  if (const std::string* text = element.find("value")) {
    const std::vector<double> v = parse_numbers(tree, element, "value", *text);
    if (v.size() == 1 && one_for_all) return {v[0], v[0], v[0]};
    if (v.size() != 3)
      tree.fail(element, element.tag, fmt::format("{} numbers in {}, where three are wanted", v.size(), quoted(*text)));
    return {v[0], v[1], v[2]};
  }
  return {attribute_or(tree, element, "x", fallback), attribute_or(tree, element, "y", fallback),
          attribute_or(tree, element, "z", fallback)};
}

Placement rotation(const XmlTree& tree, const XmlElement& element) {
  Vec3d axis = read_components(tree, element, 0, false);
  const std::string* angle = element.find("angle");
  if (angle == nullptr) tree.fail(element, "rotate", "the attribute 'angle' (degrees) is missing");
  if (!(length(axis) > 0)) tree.fail(element, "rotate", "the axis is 0,0,0");
  axis = axis * (1 / length(axis));
  const Turn t = turn_by(parse_number(tree, element, "angle", *angle));
  const auto rotated = [&](Vec3d v) {
    return v * t.cosine + cross(axis, v) * t.sine + axis * (dot(axis, v) * (1 - t.cosine));
  };
  return {rotated({1, 0, 0}), rotated({0, 1, 0}), rotated({0, 0, 1}), {}};
}

Placement matrix(const XmlTree& tree, const XmlElement& element) {
  const std::string text = element.get("value");
  const std::vector<double> m = parse_numbers(tree, element, "value", text);
  if (m.size() == 9) return {{m[0], m[3], m[6]}, {m[1], m[4], m[7]}, {m[2], m[5], m[8]}, {}};
  if (m.size() != 16)
    tree.fail(element, "matrix", fmt::format("{} numbers: 16, row by row, are wanted, or 9", m.size()));
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
    tree.fail(element, "matrix", "the last row is not 0 0 0 1: projections are not supported");
  return {{m[0], m[4], m[8]}, {m[1], m[5], m[9]}, {m[2], m[6], m[10]}, {m[3], m[7], m[11]}};
}

LookAt look_at(const XmlTree& tree, const XmlElement& element) {
  const auto point = [&](const char* name, Vec3d fallback) {
    const std::string* text = element.find(name);
    if (text == nullptr) return fallback;
    const std::vector<double> v = parse_numbers(tree, element, name, *text);
    if (v.size() != 3) tree.fail(element, "lookat", fmt::format("'{}' is not three numbers", name));
    return Vec3d{v[0], v[1], v[2]};
  };
  return {point("origin", {0, 0, 0}), point("target", {0, 0, 1}), point("up", {0, 1, 0}), false};
}

/// The frame that looks along its z axis, y up and x to the left.
Placement placement_of(const XmlTree& tree, const XmlElement& element, const LookAt& view) {
  const Vec3d along = view.target - view.origin;
  const Vec3d left = cross(view.up, along);
  if (!(length(along) > 0)) tree.fail(element, "lookat", "the origin and the target are the same point");
  if (!(length(left) > 1e-9 * length(along) * length(view.up)))
    tree.fail(element, "lookat", "the up vector is along the view");
  const Vec3d z = normalize(along), x = normalize(left);
  return {x, cross(z, x), z, view.origin};
}

bool is_look_at(const XmlElement& element) { return element.tag == "lookat" || element.tag == "lookAt"; }

Placement read_step(const XmlTree& tree, const XmlElement& step) {
  if (step.tag == "translate") return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, read_components(tree, step, 0, false)};
  if (step.tag == "rotate") return rotation(tree, step);
  if (step.tag == "matrix") return matrix(tree, step);
  if (step.tag == "scale") {
    const Vec3d s = read_components(tree, step, 1, true);
    return {{s.x, 0, 0}, {0, s.y, 0}, {0, 0, s.z}, {}};
  }
  if (is_look_at(step)) return placement_of(tree, step, look_at(tree, step));
  tree.fail(step, "transform",
            fmt::format("<{}> is not supported: there are translate, rotate, scale, matrix, lookat", step.tag));
}

/// sRGB's curve undone.
float linear_from_srgb(double v) {
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

int hexadecimal_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

}  // namespace

double parse_number(const XmlTree& tree, const XmlElement& element, std::string_view attribute, std::string_view text) {
  const std::optional<double> value = parse_double(trimmed(text));
  if (!value || !std::isfinite(*value))
    tree.fail(element, element.tag, fmt::format("'{}' is {}, which is no finite number", attribute, quoted(text)));
  return *value;
}

std::vector<double> parse_numbers(const XmlTree& tree, const XmlElement& element, std::string_view attribute,
                                  std::string_view text) {
  std::vector<double> numbers;
  std::size_t at = 0;
  const auto separates = [](char c) { return c == ',' || is_space(c); };
  while (at < text.size()) {
    std::size_t end = at;
    while (end < text.size() && !separates(text[end])) ++end;
    if (end > at) numbers.push_back(parse_number(tree, element, attribute, text.substr(at, end - at)));
    at = end + 1;
  }
  return numbers;
}

Vec3d read_vector(const XmlTree& tree, const XmlElement& element) { return read_components(tree, element, 0, false); }

Placement read_transform(const XmlTree& tree, const XmlElement& element) {
  Placement whole;
  for (const XmlElement& step : element.children) whole = compose(read_step(tree, step), whole);
  const auto finite = [](Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
  if (!finite(whole.x_axis) || !finite(whole.y_axis) || !finite(whole.z_axis) || !finite(whole.origin))
    tree.fail(element, "transform", "the product of the steps is not finite");
  return whole;
}

std::optional<LookAt> read_look_at(const XmlTree& tree, const XmlElement& transform) {
  const auto& steps = transform.children;
  const bool mirrored = steps.size() == 2 && steps[0].tag == "scale" &&
                        read_step(tree, steps[0]) == Placement{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {}};
  if (steps.empty() || !is_look_at(steps.back()) || (steps.size() != 1 && !mirrored)) return std::nullopt;
  LookAt view = look_at(tree, steps.back());
  view.mirrored = mirrored;
  return view;
}

Rgb read_rgb(const XmlTree& tree, const XmlElement& element) {
  const std::string text = element.get("value");
  if (text.starts_with('#')) {
    Rgb color;
    for (int c = 0; c < 3; ++c) {
      const std::size_t at = 1 + 2 * static_cast<std::size_t>(c);
      const int high = at + 1 < text.size() ? hexadecimal_digit(text[at]) : -1;
      const int low = at + 1 < text.size() ? hexadecimal_digit(text[at + 1]) : -1;
      if (text.size() != 7 || high < 0 || low < 0)
        tree.fail(element, "rgb", fmt::format("{} is no color #rrggbb", quoted(text)));
      color[c] = linear_from_srgb((16 * high + low) / 255.0);
    }
    return color;
  }
  const std::vector<double> v = parse_numbers(tree, element, "value", text);
  if (v.size() != 1 && v.size() != 3)
    tree.fail(element, "rgb", fmt::format("{} is neither one number nor three", quoted(text)));
  const auto channel = [&](std::size_t c) { return static_cast<float>(v.size() == 1 ? v[0] : v[c]); };
  return {channel(0), channel(1), channel(2)};
}

Rgb read_spectrum(const XmlTree& tree, const XmlElement& element, bool of_light) {
  const std::string* text = element.find("value");
  if (text == nullptr)
    tree.fail(element, "spectrum", "only a 'value' is supported: a number, or wavelength:value pairs");
  if (text->find(':') == std::string::npos)
    return grey(static_cast<float>(parse_number(tree, element, "value", *text)));
  std::vector<SpectrumSample> samples;
  std::string_view rest = *text;
  while (!trimmed(rest).empty()) {
    const std::size_t comma = rest.find(',');
    // Pairs may be separated by blanks alone.
    rest = trimmed(rest);
    std::size_t end = 0;
    while (end < rest.size() && rest[end] != ',' && !is_space(rest[end])) ++end;
    const std::string_view pair = rest.substr(0, end);
    const std::size_t colon = pair.find(':');
    if (colon == std::string_view::npos || comma == 0)
      tree.fail(element, "spectrum", fmt::format("{} is no list of wavelength:value pairs", quoted(*text)));
    const double wavelength = parse_number(tree, element, "value", pair.substr(0, colon));
    if (!samples.empty() && !(wavelength > samples.back().wavelength))
      tree.fail(element, "spectrum",
                fmt::format("the wavelength {} does not come after the one before it", wavelength));
    samples.push_back({wavelength, parse_number(tree, element, "value", pair.substr(colon + 1))});
    rest.remove_prefix(end);
    rest = trimmed(rest);
    if (rest.starts_with(',')) rest.remove_prefix(1);
  }
  return of_light ? rgb_of_light(samples) : rgb_in_daylight(samples);
}

std::string snake_case(std::string_view name) {
  std::string result;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool upper = name[i] >= 'A' && name[i] <= 'Z';
    const bool after_lower = i > 0 && !(name[i - 1] >= 'A' && name[i - 1] <= 'Z') && name[i - 1] != '_';
    if (upper && after_lower) result += '_';
    result += upper ? static_cast<char>(name[i] - 'A' + 'a') : name[i];
  }
  return result;
}

}  // namespace embrun

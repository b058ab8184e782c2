#include "render/color_by.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/error.h"

namespace embrun {
namespace {

constexpr Rgb spectrum[] = {
    {0.02f, 0.06f, 0.80f}, {0.02f, 0.60f, 0.85f}, {0.10f, 0.75f, 0.10f}, {0.95f, 0.85f, 0.05f}, {0.85f, 0.04f, 0.02f}};
constexpr Rgb heat[] = {{0.05f, 0.0f, 0.0f}, {0.70f, 0.03f, 0.0f}, {0.95f, 0.45f, 0.02f}, {1.0f, 0.97f, 0.80f}};
constexpr Rgb greys[] = {{0.02f, 0.02f, 0.02f}, {0.98f, 0.98f, 0.98f}};

std::span<const Rgb> map_from_name(const std::string& name) {
  if (name == "spectrum") return spectrum;
  if (name == "heat") return heat;
  if (name == "grey") return greys;
  throw Error("colour map \"" + name + "\" is unknown: there are spectrum, heat, grey");
}

/// The map's colour at x in [0, 1].
Rgb color_at(std::span<const Rgb> map, double x) {
  const double place = std::clamp(x, 0.0, 1.0) * static_cast<double>(map.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(place), map.size() - 2);
  const auto f = static_cast<float>(place - static_cast<double>(i));
  return map[i] * (1.0f - f) + map[i + 1] * f;
}

}  // namespace

void check_color_map(const std::string& name) { map_from_name(name); }

ColorsByAttribute color_by_attribute(const ParticleSet& particles, const std::string& attribute, const std::string& map,
                                     const std::string& file) {
  const Attribute* found = particles.find(attribute);
  if (found == nullptr || !found->strings.empty()) {
    std::string known;
    for (const Attribute& a : particles.attributes)
      if (a.strings.empty()) known += (known.empty() ? "" : ", ") + a.name;
    throw Error(file + ": the particles have no attribute \"" + attribute +
                "\" of numbers to colour by; they have: " + (known.empty() ? "none" : known));
  }
  const auto components = static_cast<std::size_t>(found->components);
  std::vector<double> values(particles.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = found->value(i * components);
    if (components == 1) continue;
    double squares = 0;
    for (std::size_t c = 0; c < components; ++c)
      squares += found->value(i * components + c) * found->value(i * components + c);
    values[i] = std::sqrt(squares);
  }
  ColorsByAttribute result;
  if (values.empty()) return result;
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  result.least = sorted.front();
  result.most = sorted.back();
  const auto quantile = [&](double q) {
    return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
  };
  result.low = quantile(0.01);
  result.high = quantile(0.99);
  const double range = result.high - result.low;
  for (const double value : values)
    result.colors.push_back(color_at(map_from_name(map), range > 0 ? (value - result.low) / range : 0.5));
  return result;
}

}  // namespace embrun

#include "particles/radius.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "base/error.h"
#include "math/box3d.h"
#include "math/median.h"

namespace embrun {

namespace {

[[noreturn]] void fail(std::string_view file, const std::string& message) {
  throw Error(std::string(file) + ": radius: " + message);
}

bool is_radius(double radius) {
  return radius >= static_cast<double>(std::numeric_limits<float>::min()) &&
         radius <= static_cast<double>(std::numeric_limits<float>::max());
}

RadiusChoice radius_from_file(const Attribute& attribute, std::string_view file) {
  RadiusChoice choice;
  choice.source = RadiusSource::file;
  const std::size_t count = attribute.value_count();
  choice.radii.resize(count);
  std::vector<float> usable;
  for (std::size_t i = 0; i < count; ++i) {
    const double radius = attribute.value(i);
    if (!is_radius(radius)) continue;
    choice.radii[i] = static_cast<float>(radius);
    usable.push_back(choice.radii[i]);
  }
  choice.without_radius = count - usable.size();
  if (usable.empty()) fail(file, "none of the particles has a positive radius; give one with --radius");
  const float median = median_of(usable);
  choice.radius = static_cast<double>(median);
  const auto same = [&](float radius) { return radius == median; };
  if (choice.without_radius == 0 && std::all_of(usable.begin(), usable.end(), same)) choice.radii.clear();
  return choice;
}

}  // namespace

RadiusChoice choose_radius(const ParticleSet& particles, const SpacingEstimate& spacing, std::optional<double> given,
                           std::string_view file) {
  RadiusChoice choice;
  if (given) {
    if (!is_radius(*given)) fail(file, "the given radius " + std::to_string(*given) + " is not a positive number");
    choice.radius = *given;
    return choice;
  }
  const Attribute* attribute = particles.find("radius");
  if (attribute && attribute->components == 1 && attribute->strings.empty()) return radius_from_file(*attribute, file);
  choice.source = spacing.has_bulk ? RadiusSource::spacing : RadiusSource::nearest_neighbour;
  choice.radius = 0.5 * (spacing.has_bulk ? spacing.spacing : spacing.nearest_neighbour);
  if (!is_radius(choice.radius)) {
    fail(file,
         "the file gives none and there is nothing to derive one from (a single particle, or most in one place); "
         "give one with --radius");
  }
  return choice;
}

void drop_particles_without_radius(ParticleSet& particles, RadiusChoice& choice) {
  if (choice.without_radius == 0) return;
  std::vector<std::uint8_t> keep(choice.radii.size());
  std::transform(choice.radii.begin(), choice.radii.end(), keep.begin(),
                 [](float radius) { return static_cast<std::uint8_t>(radius > 0); });
  particles.notes.push_back(std::to_string(choice.without_radius) + " of " + std::to_string(particles.size()) +
                            " particles were dropped: no positive radius");
  keep_particles(particles, keep);
  std::erase(choice.radii, 0.0f);
  choice.without_radius = 0;
}

void check_extent(const ParticleSet& particles, double radius, std::string_view file) {
  if (particles.size() == 0) return;
  const double extent = box_of(particles.positions).extent();
  const double step = 0.5 * extent * static_cast<double>(std::numeric_limits<float>::epsilon());
  if (step <= radius / 50) return;
  throw Error(std::string(file) + ": position: the particles span " + std::to_string(extent) +
              " m, too much for a radius of " + std::to_string(radius) +
              " m: single precision cannot tell neighbours apart. Remove the particles that ran away");
}

SizedParticles size_particles(ParticleSet particles, std::optional<double> given, std::string_view file) {
  SizedParticles sized;
  sized.particles = std::move(particles);
  sized.spacing = estimate_spacing(sized.particles);
  sized.radius = choose_radius(sized.particles, sized.spacing, given, file);
  drop_particles_without_radius(sized.particles, sized.radius);
  check_extent(sized.particles, sized.radius.radius, file);
  return sized;
}

const char* to_string(RadiusSource source) {
  switch (source) {
    case RadiusSource::given: return "given";
    case RadiusSource::file: return "file";
    case RadiusSource::spacing: return "spacing";
    case RadiusSource::nearest_neighbour: break;
  }
  return "nearest-neighbour";
}

}  // namespace embrun

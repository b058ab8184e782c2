#include "io/particle_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "io/text.h"

namespace embrun {

namespace {

const char* to_string(AttributeType type) {
  return type == AttributeType::float32 ? "float" : type == AttributeType::int32 ? "int" : "int64";
}

AttributeInfo describe(const Attribute& attribute) {
  AttributeInfo info;
  info.name = attribute.name;
  info.file_name = attribute.file_name;
  info.type = attribute.type;
  info.components = static_cast<std::size_t>(attribute.components);
  info.strings = attribute.strings.size();
  info.replaced_non_finite = attribute.replaced_non_finite;
  for (std::size_t c = 0; c < info.components; ++c) {
    double least = attribute.value(c), greatest = least;
    for (std::size_t i = c; i < attribute.value_count(); i += info.components) {
      least = std::min(least, attribute.value(i));
      greatest = std::max(greatest, attribute.value(i));
    }
    info.least.push_back(least);
    info.greatest.push_back(greatest);
  }
  return info;
}

std::string radius_text(const ParticleInfo& info) {
  if (!info.radius) return fmt::format("none: {}", info.radius_problem);
  std::string text = fmt::format("{:.6g} m", info.radius->radius);
  if (!info.radius->radii.empty()) {
    text += fmt::format(" (median; {:.6g} to {:.6g})", info.least_radius, info.greatest_radius);
  }
  switch (info.radius->source) {
    case RadiusSource::given: text += ", given"; break;
    case RadiusSource::file: text += ", from the file"; break;
    case RadiusSource::spacing: text += ", half the rest spacing"; break;
    case RadiusSource::nearest_neighbour: text += ", half the median nearest-neighbour distance"; break;
  }
  if (info.radius->without_radius > 0) {
    text += fmt::format("; {} particles without a positive one are left out", info.radius->without_radius);
  }
  return text;
}

std::string attribute_text(const AttributeInfo& attribute) {
  // A file may have components by the thousand; a line holds a few.
  constexpr std::size_t most_ranges = 4;
  std::string text = fmt::format("  {:<12} {}", printable(attribute.name), to_string(attribute.type));
  if (attribute.components > 1) text += fmt::format(" x {}", attribute.components);
  text += ", ";
  for (std::size_t c = 0; c < std::min(attribute.components, most_ranges); ++c) {
    text += fmt::format("{}[{:.7g}, {:.7g}]", c ? " " : "", attribute.least[c], attribute.greatest[c]);
  }
  if (attribute.components > most_ranges) text += " ...";
  if (attribute.strings > 0) text += fmt::format(", {} texts", attribute.strings);
  if (!attribute.file_name.empty()) text += fmt::format(", \"{}\" in the file", printable(attribute.file_name));
  return text + "\n";
}

}  // namespace

ParticleInfo describe_particles(const ParticleSet& particles, const std::string& file,
                                std::optional<double> given_radius) {
  EMBRUN_CHECK(particles.size() > 0);
  ParticleInfo info;
  info.file = file;
  info.format = particles.format;
  info.count = particles.size();
  info.dropped_non_finite = particles.dropped_non_finite;
  info.notes = particles.notes;
  info.low = info.high = particles.positions[0];
  for (const Vec3d p : particles.positions) {
    info.low = {std::min(info.low.x, p.x), std::min(info.low.y, p.y), std::min(info.low.z, p.z)};
    info.high = {std::max(info.high.x, p.x), std::max(info.high.y, p.y), std::max(info.high.z, p.z)};
  }
  for (const Attribute& attribute : particles.attributes) info.attributes.push_back(describe(attribute));
  info.spacing = estimate_spacing(particles);
  if (given_radius) {
    info.radius = choose_radius(particles, info.spacing, given_radius, file);
  } else {
    // Without a radius there is still much to say about the file.
    try {
      info.radius = choose_radius(particles, info.spacing, std::nullopt, file);
    } catch (const Error& error) {
      info.radius_problem = error.what();
    }
  }
  if (info.radius) {
    info.least_radius = info.greatest_radius = info.radius->radius;
    for (const float radius : info.radius->radii) {
      if (!(radius > 0)) continue;
      info.least_radius = std::min(info.least_radius, static_cast<double>(radius));
      info.greatest_radius = std::max(info.greatest_radius, static_cast<double>(radius));
    }
  }
  return info;
}

std::string to_text(const ParticleInfo& info) {
  std::string text = fmt::format("{}: {}, {} particles\n", info.file, info.format, info.count);
  if (info.dropped_non_finite > 0)
    text += fmt::format("dropped: {} with a non-finite position\n", info.dropped_non_finite);
  text += fmt::format("bounds: ({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g}) m\n", info.low.x, info.low.y,
                      info.low.z, info.high.x, info.high.y, info.high.z);
  text += "attributes:\n";
  for (const AttributeInfo& attribute : info.attributes) text += attribute_text(attribute);
  if (info.attributes.empty()) text += "  none\n";
  text += info.spacing.has_bulk
              ? fmt::format("rest spacing: {:.6g} m (from the number density in the bulk)\n", info.spacing.spacing)
              : "rest spacing: none (there is no bulk of fluid to measure it in)\n";
  if (info.spacing.nearest_neighbour > 0) {
    text += fmt::format("median nearest-neighbour distance: {:.6g} m\n", info.spacing.nearest_neighbour);
  }
  text += fmt::format("radius: {}\n", radius_text(info));
  for (const std::string& note : info.notes) text += fmt::format("note: {}\n", note);
  return text;
}

std::string to_json(const ParticleInfo& info) {
  using Json = nlohmann::ordered_json;
  const auto range = [](const AttributeInfo& attribute, const std::vector<double>& values) {
    Json list = Json::array();
    for (const double value : values) {
      list.push_back(attribute.type == AttributeType::float32 ? Json(value) : Json(static_cast<std::int64_t>(value)));
    }
    return list;
  };
  const auto positive_or_null = [](double x) { return x > 0 ? Json(x) : Json(nullptr); };
  Json json;
  json["file"] = info.file;
  json["format"] = info.format;
  json["count"] = info.count;
  json["dropped_non_finite"] = info.dropped_non_finite;
  json["bounds"] = {{"low", {info.low.x, info.low.y, info.low.z}}, {"high", {info.high.x, info.high.y, info.high.z}}};
  json["attributes"] = Json::array();
  for (const AttributeInfo& attribute : info.attributes) {
    json["attributes"].push_back({{"name", attribute.name},
                                  {"name_in_file", attribute.file_name.empty() ? attribute.name : attribute.file_name},
                                  {"type", to_string(attribute.type)},
                                  {"components", attribute.components},
                                  {"min", range(attribute, attribute.least)},
                                  {"max", range(attribute, attribute.greatest)},
                                  {"texts", attribute.strings},
                                  {"replaced_non_finite", attribute.replaced_non_finite}});
  }
  json["rest_spacing"] = positive_or_null(info.spacing.spacing);
  json["median_nearest_neighbour"] = positive_or_null(info.spacing.nearest_neighbour);
  if (info.radius) {
    json["radius"] = {{"value", info.radius->radius},
                      {"source", to_string(info.radius->source)},
                      {"min", info.least_radius},
                      {"max", info.greatest_radius},
                      {"particles_without", info.radius->without_radius}};
  } else {
    json["radius"] = nullptr;
  }
  json["notes"] = info.notes;
  // Names come from files and need not be UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace embrun

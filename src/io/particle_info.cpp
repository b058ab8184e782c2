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

std::string fluid_text(const ParticleInfo& info) {
  std::string text =
      info.spacing.has_bulk
          ? fmt::format("rest spacing: {:.6g} m (from the number density in the bulk)\n", info.spacing.spacing)
          : "rest spacing: none (there is no bulk of fluid to measure it in)\n";
  if (info.spacing.nearest_neighbour > 0) {
    text += fmt::format("median nearest-neighbour distance: {:.6g} m\n", info.spacing.nearest_neighbour);
  }
  return text + fmt::format("radius: {}\n", radius_text(info));
}

/// All that does not depend on what the points are.
ParticleInfo describe_file_content(const ParticleSet& particles, const std::string& file) {
  EMBRUN_CHECK(particles.size() > 0);
  ParticleInfo info;
  info.file = file;
  info.format = particles.format;
  info.count = particles.size();
  info.dropped_non_finite = particles.dropped_non_finite;
  info.notes = particles.notes;
  info.low = info.high = particles.positions[0];
  for (const Vec3d p : particles.positions) {
    info.low = min_of(info.low, p);
    info.high = max_of(info.high, p);
  }
  for (const Attribute& attribute : particles.attributes) info.attributes.push_back(describe(attribute));
  return info;
}

const char* to_string(NormalSource source) {
  switch (source) {
    case NormalSource::file: return "file";
    case NormalSource::estimated_outwards: return "estimated-outwards";
    case NormalSource::estimated_to_sensor: break;
  }
  return "estimated-to-sensor";
}

std::string normals_text(const CloudInfo& cloud) {
  const SplatReport& splats = cloud.splats;
  std::string text;
  if (splats.normals == NormalSource::file) {
    text = "from the file";
    if (splats.normal_difference > 0) {
      text += fmt::format(", {:.3g} degrees off estimated ones on average", splats.normal_difference);
    }
    if (splats.replaced_normals > 0) text += fmt::format("; {} were zero and were estimated", splats.replaced_normals);
    if (splats.turned_normals > 0) text += fmt::format("; {} were turned to the sensor", splats.turned_normals);
    return text;
  }
  text = fmt::format("estimated from {} neighbours", splats.neighbours);
  if (splats.normals == NormalSource::estimated_outwards) {
    return text + (splats.pieces == 1 ? std::string(", outwards")
                                      : fmt::format(", outwards on each of {} pieces", splats.pieces));
  }
  const Vec3d sensor = cloud.sensor.value_or(Vec3d{});
  return text + fmt::format(", towards the sensor at ({:.6g}, {:.6g}, {:.6g}) m", sensor.x, sensor.y, sensor.z);
}

std::string splat_radius_text(const SplatReport& splats) {
  std::string text = fmt::format("{:.6g} m (median; {:.6g} to {:.6g})", splats.median_radius, splats.least_radius,
                                 splats.greatest_radius);
  switch (splats.radius) {
    case SplatRadiusSource::given: return text + ", given";
    case SplatRadiusSource::file: text += ", from the file"; break;
    case SplatRadiusSource::spacing: text += ", the least that leave no hole"; break;
  }
  if (splats.at_border > 0) text += fmt::format("; {} splats are at a border", splats.at_border);
  if (splats.replaced_radii > 0) text += fmt::format("; {} had none and got the median", splats.replaced_radii);
  return text;
}

std::string closed_text(const CloudInfo& cloud) {
  const std::string text = cloud.closed ? "yes" : "no";
  if (cloud.splats.closed_given) return text + ", as asked";
  return cloud.closed ? text + ", from all around only fronts are seen"
                      : text + fmt::format(", from all around {:.2g} % of what is seen are backs",
                                           100 * cloud.splats.open_share);
}

nlohmann::ordered_json cloud_json(const CloudInfo& cloud) {
  const SplatReport& splats = cloud.splats;
  const CloudShape& shape = splats.shape;
  nlohmann::ordered_json json;
  json["told_by"] = cloud.verdict.reason;
  json["splats"] = splats.points_in - splats.duplicates - splats.outliers - splats.thinned;
  json["left_out"] = {{"duplicates", splats.duplicates}, {"outliers", splats.outliers}, {"thinned", splats.thinned}};
  json["spacing"] = shape.spacing;
  json["noise"] = shape.noise;
  json["curvature"] = shape.curvature;
  json["variation"] = shape.variation;
  json["variation_among"] = shape.scale;
  json["flat_share"] = shape.flat_share;
  json["normals"] = {{"source", to_string(splats.normals)},
                     {"neighbours", splats.neighbours},
                     {"pieces", splats.pieces},
                     {"replaced", splats.replaced_normals},
                     {"turned", splats.turned_normals},
                     {"mean_difference_degrees", splats.normal_difference}};
  json["splat_radius"] = {{"source", to_string(splats.radius)}, {"min", splats.least_radius},
                          {"median", splats.median_radius},     {"max", splats.greatest_radius},
                          {"at_border", splats.at_border},      {"replaced", splats.replaced_radii}};
  json["ellipses"] = cloud.ellipses;
  json["colours"] = cloud.has_colours;
  json["closed"] = cloud.closed;
  json["open_share"] =
      splats.closed_given ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(splats.open_share);
  return json;
}

}  // namespace

ParticleInfo describe_cloud(const ParticleSet& particles, const std::string& file, const CloudVerdict& verdict,
                            const SplatOptions& options) {
  ParticleInfo info = describe_file_content(particles, file);
  const SplatCloud splats = make_splats(particles, options, file);
  info.cloud = describe_splats(splats, verdict, options);
  return info;
}

CloudInfo describe_splats(const SplatCloud& splats, const CloudVerdict& verdict, const SplatOptions& options) {
  CloudInfo cloud;
  cloud.verdict = verdict;
  cloud.splats = splats.report;
  cloud.sensor = options.sensor ? options.sensor : splats.particles.sensor;
  cloud.closed = splats.closed;
  cloud.ellipses = !splats.axes.empty();
  cloud.has_colours = !splats.colours.empty();
  return cloud;
}

std::string to_text(const CloudInfo& cloud) {
  const SplatReport& splats = cloud.splats;
  const CloudShape& shape = splats.shape;
  std::string text = fmt::format("taken for a scan: {}\n", cloud.verdict.reason);
  text += fmt::format("left out: {} duplicates, {} outliers", splats.duplicates, splats.outliers);
  text += splats.thinned > 0 ? fmt::format(", {} by thinning\n", splats.thinned) : std::string("\n");
  if (shape.spacing > 0) {
    text += fmt::format("spacing: {:.6g} m, noise off the surface: {:.3g} m\n", shape.spacing, shape.noise);
    text += fmt::format("flat neighbourhoods: {:.1f} % (variation {:.3g} among {} points)\n", 100 * shape.flat_share,
                        shape.variation, shape.scale);
  }
  text += fmt::format("normals: {}\n", normals_text(cloud));
  text += fmt::format("splat radius: {}{}\n", splat_radius_text(splats), cloud.ellipses ? "; ellipses" : "");
  text += fmt::format("colours: {}\n", cloud.has_colours ? "from the file" : "none");
  return text + fmt::format("closed: {}\n", closed_text(cloud));
}

ParticleInfo describe_particles(const ParticleSet& particles, const std::string& file,
                                std::optional<double> given_radius) {
  ParticleInfo info = describe_file_content(particles, file);
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
  std::string text = fmt::format("{}: {}, {} {}\n", info.file, info.format, info.count,
                                 info.cloud ? "points of a surface" : "particles");
  if (info.dropped_non_finite > 0)
    text += fmt::format("dropped: {} with a non-finite position\n", info.dropped_non_finite);
  text += fmt::format("bounds: ({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g}) m\n", info.low.x, info.low.y,
                      info.low.z, info.high.x, info.high.y, info.high.z);
  text += "attributes:\n";
  for (const AttributeInfo& attribute : info.attributes) text += attribute_text(attribute);
  if (info.attributes.empty()) text += "  none\n";
  text += info.cloud ? to_text(*info.cloud) : fluid_text(info);
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
  if (info.cloud) json["cloud"] = cloud_json(*info.cloud);
  json["notes"] = info.notes;
  // Names come from files and need not be UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace embrun

#include <fmt/format.h>

#include <cmath>

#include "io/scene/reading.h"
#include "io/text.h"
#include "sampling/gauss_rule.h"

namespace embrun {
namespace {

constexpr int largest_picture = 1 << 16;

PixelFilter read_filter(SceneReading& reading, const XmlElement& element) {
  SceneObject filter = reading.object(element);
  PixelFilter result;
  const std::string& type = filter.type();
  if (type == "box") {
    filter.ignore("radius", "the box is one pixel");
  } else if (type == "tent") {
    result = {FilterKind::tent, static_cast<float>(filter.number("radius", 1))};
  } else if (type == "gaussian") {
    // Cut at three standard deviations.
    result = {FilterKind::gaussian, static_cast<float>(3 * filter.number("stddev", 0.5))};
  } else if (type == "blackman_harris") {
    result = {FilterKind::blackman_harris, static_cast<float>(filter.number("radius", 1.5))};
  } else {
    filter.fail(
        "this filter is not supported, for samples are drawn from the filter, which must not be negative: there are "
        "box, tent, gaussian, blackman_harris");
  }
  if (!(result.radius > 0)) filter.fail(fmt::format("a filter of radius {}: it has to be positive", result.radius));
  filter.finish();
  return result;
}

void read_film(SceneReading& reading, const XmlElement& element, CameraSettings& camera) {
  SceneObject film = reading.object(element);
  if (film.type() != "hdrfilm") film.fail("this film is not supported: there is hdrfilm");
  FilmDescription& description = reading.result.scene.film;
  description.width = film.integer("width", 1, largest_picture).value_or(768);
  description.height = film.integer("height", 1, largest_picture).value_or(576);
  PixelWindow crop;
  crop.x = film.integer("crop_offset_x", 0, largest_picture).value_or(0);
  crop.y = film.integer("crop_offset_y", 0, largest_picture).value_or(0);
  crop.width = film.integer("crop_width", 1, largest_picture).value_or(description.width - crop.x);
  crop.height = film.integer("crop_height", 1, largest_picture).value_or(description.height - crop.y);
  if (crop.width < 1 || crop.height < 1 || crop.x + crop.width > description.width ||
      crop.y + crop.height > description.height)
    film.fail(fmt::format("the crop of {} x {} pixels at {}, {} does not lie within {} x {}", crop.width, crop.height,
                          crop.x, crop.y, description.width, description.height));
  if (crop != PixelWindow{0, 0, description.width, description.height}) description.crop = crop;
  camera.filter = {FilterKind::gaussian, 1.5f};
  if (const XmlElement* filter = reading.take(film, "rfilter")) camera.filter = read_filter(reading, *filter);
  const char* why = "the name of the file that is written decides";
  film.ignore("file_format", why);
  film.ignore("pixel_format", why);
  film.ignore("component_format", why);
  film.ignore("sample_border", "samples count in their own pixel only");
  film.ignore("banner", "there is none");
  film.ignore("gamma", "radiance is written as it is");
  film.finish();
}

void read_sampler(SceneReading& reading, const XmlElement& element) {
  SceneObject sampler = reading.object(element);
  IntegratorDescription& integrator = reading.result.scene.integrator;
  const std::string& type = sampler.type();
  if (type == "independent") {
    integrator.sampler = SamplerKind::independent;
  } else if (type == "sobol" || type == "ldsampler") {
    integrator.sampler = SamplerKind::sobol;
  } else if (type == "stratified" || type == "multijitter" || type == "orthogonal" || type == "halton" ||
             type == "hammersley") {
    integrator.sampler = SamplerKind::sobol;
    sampler.warn("the Sobol sampler takes its place");
  } else {
    sampler.fail("this sampler is not supported: there are independent, sobol");
  }
  integrator.samples = sampler.integer("sample_count", 1, 1 << 30).value_or(4);
  const double seed = sampler.number("seed", 0);
  if (seed != std::floor(seed) || !(seed >= 0 && seed <= 4294967295.0))
    sampler.fail(fmt::format("'seed' is {}: it has to be a whole number from 0 to 4294967295", seed));
  integrator.seed = static_cast<std::uint32_t>(seed);
  sampler.ignore("jitter", "the Sobol sampler is used");
  sampler.ignore("dimension", "there is no limit");
  sampler.finish();
}

/// Vertical field of view in degrees of a view whose width is `aspect` times its height.
double vertical_fov(SceneObject& sensor, double aspect) {
  constexpr double degree = M_PI / 180;
  const auto across = [&](double degrees) { return 2 * std::tan(0.5 * degrees * degree); };
  const auto vertical = [&](double height) { return 2 * std::atan(0.5 * height) / degree; };
  const double diagonal = std::sqrt(1 + aspect * aspect);
  const std::optional<double> fov = sensor.number("fov");
  const std::optional<std::string> focal = sensor.text("focal_length");
  const std::string axis = to_lower(sensor.text("fov_axis").value_or("x"));
  if (fov && focal) sensor.fail("give either 'fov' or 'focal_length', not both");
  if (!fov) {
    // Millimetres in front of a film of 36 x 24 mm, whose diagonal is the picture's.
    std::string text = focal.value_or("50mm");
    if (text.ends_with("mm")) text.resize(text.size() - 2);
    const std::optional<double> length = parse_double(trimmed(text));
    if (!length || !(*length > 0) || !std::isfinite(*length))
      sensor.fail(fmt::format("'focal_length' is {}: write it as '50mm'", quoted(text)));
    return vertical(std::hypot(36.0, 24.0) / *length / diagonal);
  }
  if (!(*fov > 0 && *fov < 180)) sensor.fail(fmt::format("'fov' is {}: it has to lie between 0 and 180 degrees", *fov));
  const bool wide = aspect > 1;
  if (axis == "y" || axis == (wide ? "smaller" : "larger")) return *fov;
  if (axis == "x" || axis == (wide ? "larger" : "smaller") || axis == "smaller" || axis == "larger")
    return vertical(across(*fov) / aspect);
  if (axis == "diagonal") return vertical(across(*fov) / diagonal);
  sensor.fail(fmt::format("'fov_axis' is {}: there are x, y, diagonal, smaller, larger", quoted(axis)));
}

/// True when the transform says what the camera looks at, not just in which direction.
bool read_view(SceneObject& sensor, CameraSettings& camera) {
  const XmlElement* transform = sensor.transform("to_world");
  // A lookat is taken as it stands; any other transform by what it does to a camera at the origin that looks along z.
  if (transform != nullptr) {
    if (const std::optional<LookAt> view = read_look_at(sensor.tree(), *transform)) {
      read_transform(sensor.tree(), *transform);  // checks it
      camera.eye = view->origin;
      camera.target = view->target;
      camera.up = view->up;
      camera.mirrored = view->mirrored;
      return true;
    }
  }
  const Placement m = transform != nullptr ? read_transform(sensor.tree(), *transform) : Placement{};
  if (!(length(m.z_axis) > 0) || determinant(m) == 0) sensor.fail("'to_world' flattens the camera");
  const Vec3d forward = normalize(m.z_axis);
  camera.eye = m.origin;
  camera.target = m.origin + forward;
  camera.up = m.y_axis;
  camera.mirrored = determinant(m) < 0;
  return false;
}

}  // namespace

void read_sensor(SceneReading& reading, const XmlElement& element) {
  SceneObject sensor = reading.object(reading.resolve(element));
  const bool lens = sensor.type() == "thinlens";
  if (!lens && sensor.type() != "perspective")
    sensor.fail("this sensor is not supported: there are perspective, thinlens");
  SceneDescription& scene = reading.result.scene;
  CameraSettings& camera = scene.camera;
  camera = {};
  scene.film = {.width = 768, .height = 576, .crop = {}};
  camera.filter = {FilterKind::gaussian, 1.5f};
  if (const XmlElement* film = reading.take(sensor, "film")) read_film(reading, *film, camera);
  if (const XmlElement* sampler = reading.take(sensor, "sampler")) read_sampler(reading, *sampler);
  const bool looks_at_target = read_view(sensor, camera);
  camera.vertical_fov = vertical_fov(sensor, static_cast<double>(scene.film.width) / scene.film.height);
  if (lens) {
    camera.lens_radius = sensor.number("aperture_radius", 0);
    if (!sensor.has("aperture_radius")) sensor.fail("'aperture_radius' is missing");
    if (!(camera.lens_radius > 0)) sensor.fail("'aperture_radius' has to be positive");
    // A lookat says where to focus.
    if (!sensor.has("focus_distance") && !looks_at_target) sensor.fail("'focus_distance' is missing");
  }
  camera.focus_distance = sensor.number("focus_distance", 0);
  if (!(camera.focus_distance >= 0)) sensor.fail("'focus_distance' must not be negative");
  camera.shutter_open = sensor.number("shutter_open", 0);
  camera.shutter_close = sensor.number("shutter_close", 0);
  sensor.ignore("near_clip", "nothing is cut");
  sensor.ignore("far_clip", "nothing is cut");
  sensor.finish();
}

void read_integrator(SceneReading& reading, const XmlElement& element) {
  SceneObject integrator = reading.object(reading.resolve(element));
  IntegratorDescription& description = reading.result.scene.integrator;
  const std::string& type = integrator.type();
  if (type == "path" || type == "volpath") {
    description.kind = IntegratorKind::path;
  } else if (type == "whitted") {
    description.kind = IntegratorKind::whitted;
  } else if (type == "ao") {
    description.kind = IntegratorKind::ambient_occlusion;
  } else if (type == "gauss") {
    description.kind = IntegratorKind::gauss;
  } else {
    integrator.fail("this integrator is not supported: there are path, volpath, whitted, ao, gauss");
  }
  constexpr int unlimited = 65535;
  // Mitsuba counts the segments of a path, Embrun the scattering events between them.
  const int depth = integrator.integer("max_depth", -1, unlimited + 1).value_or(-1);
  if (depth == 0) integrator.fail("'max_depth' is 0: that is a black picture; 1 shows the lights alone, -1 everything");
  description.max_depth = depth < 0 ? unlimited : depth - 1;
  description.roulette_depth = integrator.integer("rr_depth", 1, 1 << 30).value_or(5);
  description.max_refractions = integrator.integer("max_refractions", -1, 65535).value_or(-1);
  description.hide_emitters = integrator.flag("hide_emitters").value_or(false);
  if (description.kind == IntegratorKind::path)
    description.guide = integrator.flag("guide").value_or(true);
  else
    integrator.ignore("guide", "only the integrators path and volpath do that");
  if (description.kind == IntegratorKind::path || description.kind == IntegratorKind::gauss)
    description.equiangular = integrator.flag("equiangular").value_or(true);
  else
    integrator.ignore("equiangular", "only the integrators path, volpath and gauss do that");
  if (description.kind == IntegratorKind::gauss)
    description.gauss_nodes = integrator.integer("nodes", 1, most_hemisphere_nodes).value_or(0);
  if (description.kind == IntegratorKind::ambient_occlusion) {
    const char* why = "ambient occlusion follows no light";
    description.occlusion_distance = integrator.number("distance", description.occlusion_distance);
    integrator.ignore("straight_shadows", why);
    integrator.ignore("clamp", why);
  } else {
    description.straight_shadows = integrator.flag("straight_shadows").value_or(straight_shadows_of(description.kind));
    description.clamp = integrator.number("clamp", description.clamp);
  }
  integrator.finish();
}

}  // namespace embrun

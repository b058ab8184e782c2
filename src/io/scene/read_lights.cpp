#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/image_read.h"
#include "io/scene/reading.h"
#include "io/text.h"

namespace embrun {
namespace {

/// How far a rotation turns about the up axis, in degrees; an error for what it does besides.
double turn_of(SceneObject& emitter, UpAxis& up) {
  const Placement m = emitter.placement("to_world");
  const auto near = [](Vec3d a, Vec3d b) { return length(a - b) < 1e-6; };
  const bool rotation = std::abs(length(m.x_axis) - 1) < 1e-6 && std::abs(length(m.y_axis) - 1) < 1e-6 &&
                        std::abs(length(m.z_axis) - 1) < 1e-6 && determinant(m) > 0;
  up = near(m.y_axis, {0, 0, 1}) ? UpAxis::z : UpAxis::y;
  const UpBasis basis = up_basis(up);
  if (!rotation || !near(m.y_axis, to_double(basis.up)))
    emitter.fail("'to_world' has to be a rotation that takes +y, the picture's top, to +y or +z");
  // Mitsuba's picture begins, at its left edge, where its own -z is; the middle of Embrun's is at `back`.
  return std::atan2(dot(m.z_axis, to_double(basis.right)), dot(m.z_axis, to_double(basis.back))) * (180 / M_PI);
}

void read_envmap(SceneReading& reading, SceneObject& emitter, EnvironmentDescription& environment) {
  environment.kind = EnvironmentDescription::Kind::image;
  const std::optional<std::string> name = emitter.text("filename");
  if (!name) emitter.fail("'filename' is missing");
  environment.file = reading.path_of(emitter, *name);
  const std::vector<std::byte> bytes = reading.read_bytes(environment.file);
  Image image = read_image(bytes, environment.file);
  const EnvironmentRepair repair = clean_environment(image);
  if (repair.not_finite + repair.negative > 0)
    emitter.warn(fmt::format("{} pixels are not finite and {} negative; their channels count as 0", repair.not_finite,
                             repair.negative));
  environment.image = as_environment(image);
  environment.scale = emitter.number("scale", 1);
  if (!(environment.scale >= 0)) emitter.fail(fmt::format("'scale' is {}: it must not be negative", environment.scale));
  if (const std::optional<double> turn = emitter.number("turn"))
    environment.turn = *turn;
  else
    environment.turn = turn_of(emitter, reading.result.scene.up);
  emitter.ignore("mis_compensation", "it is not used");
}

void read_sky(SceneObject& emitter, EnvironmentDescription& environment) {
  environment.kind = EnvironmentDescription::Kind::sky;
  SkySettings& sky = environment.sky;
  const auto number = [&](const char* name, float& value) {
    value = static_cast<float>(emitter.number(name, static_cast<double>(value)));
  };
  number("sun_elevation", sky.sun_elevation);
  number("sun_azimuth", sky.sun_azimuth);
  number("sun_diameter", sky.sun_diameter);
  number("sun_irradiance", sky.sun_irradiance);
  number("sky_irradiance", sky.sky_irradiance);
  number("turbidity", sky.turbidity);
  sky.ground = emitter.color("ground").value_or(sky.ground);
  environment.turn = emitter.number("turn", 0);
}

LightDescription read_lamp(SceneObject& emitter) {
  using Kind = LightDescription::Kind;
  LightDescription light;
  const std::string shape = emitter.text("shape").value_or("rectangle");
  light.kind = shape == "disk" ? Kind::disk : shape == "sphere" ? Kind::sphere : Kind::rectangle;
  if (shape != "disk" && shape != "sphere" && shape != "rectangle")
    emitter.fail(fmt::format("'shape' is {}: there are rectangle, disk, sphere", embrun::quoted(shape)));
  light.radiance = emitter.color("radiance", true).value_or(light.radiance);
  light.position = emitter.vector("position").value_or(light.position);
  if (light.kind == Kind::rectangle) {
    light.edge_u = emitter.vector("edge_u").value_or(Vec3d{});
    light.edge_v = emitter.vector("edge_v").value_or(Vec3d{});
  } else {
    light.radius = emitter.number("radius", light.radius);
  }
  if (light.kind == Kind::disk) light.normal = emitter.vector("normal").value_or(light.normal);
  light.two_sided = emitter.flag("two_sided").value_or(false);
  return light;
}

/// A sun: a cone of directions. Embrun's own.
LightDescription read_sun(SceneObject& emitter) {
  LightDescription light;
  light.kind = LightDescription::Kind::distant;
  light.radiance = emitter.color("radiance", true).value_or(light.radiance);
  light.normal = emitter.vector("towards").value_or(Vec3d{0, 1, 0});
  light.half_angle = emitter.number("half_angle", light.half_angle);
  return light;
}

LightDescription read_point(SceneObject& emitter) {
  LightDescription light;
  light.kind = LightDescription::Kind::point;
  light.radiance = emitter.color("intensity", true).value_or(grey(1));
  if (emitter.has("position") && emitter.has("to_world")) emitter.fail("give either 'position' or 'to_world'");
  light.position = emitter.vector("position").value_or(emitter.placement("to_world").origin);
  return light;
}

LightDescription read_directional(SceneObject& emitter) {
  LightDescription light;
  light.kind = LightDescription::Kind::directional;
  light.radiance = emitter.color("irradiance", true).value_or(grey(1));
  if (emitter.has("direction") && emitter.has("to_world")) emitter.fail("give either 'direction' or 'to_world'");
  // The file says where the light goes.
  const Vec3d along = emitter.vector("direction").value_or(emitter.placement("to_world").z_axis);
  if (!(length(along) > 0)) emitter.fail("its direction is zero");
  light.normal = -1.0 * along;
  return light;
}

void read_environment(SceneReading& reading, SceneObject& emitter) {
  EnvironmentDescription& environment = reading.result.scene.environment;
  if (environment.kind != EnvironmentDescription::Kind::none) emitter.fail("there is light all round already");
  if (emitter.type() == "constant") {
    environment.kind = EnvironmentDescription::Kind::constant;
    environment.constant = emitter.color("radiance", true).value_or(grey(1));
  } else if (emitter.type() == "envmap") {
    read_envmap(reading, emitter, environment);
  } else if (emitter.type() == "sky") {
    read_sky(emitter, environment);
  } else {
    environment.kind = EnvironmentDescription::Kind::studio;
    environment.turn = emitter.number("turn", 0);
  }
}

}  // namespace

void read_emitter(SceneReading& reading, const XmlElement& element) {
  SceneObject emitter = reading.object(reading.resolve(element));
  const std::string& type = emitter.type();
  std::vector<LightDescription>& lights = reading.result.scene.lights;
  if (type == "constant" || type == "envmap" || type == "sky" || type == "studio")
    read_environment(reading, emitter);
  else if (type == "lamp")
    lights.push_back(read_lamp(emitter));
  else if (type == "sun_disk")
    lights.push_back(read_sun(emitter));
  else if (type == "point")
    lights.push_back(read_point(emitter));
  else if (type == "directional")
    lights.push_back(read_directional(emitter));
  else if (type == "area")
    emitter.fail("an area emitter stands inside of the <shape> that shines");
  else
    emitter.fail(
        "this emitter is not supported: there are area, constant, envmap, point, directional, and Embrun's sky, "
        "studio, "
        "lamp, sun_disk");
  emitter.finish();
}

Rgb take_emission(SceneReading& reading, SceneObject& shape) {
  const XmlElement* element = reading.take(shape, "emitter");
  if (element == nullptr) return {};
  SceneObject emitter = reading.object(*element);
  if (emitter.type() != "area") emitter.fail("the emitter of a shape has to be of type area");
  const Rgb radiance = emitter.color("radiance", true).value_or(grey(1));
  emitter.finish();
  return radiance;
}

}  // namespace embrun

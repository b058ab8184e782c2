#include "camera/camera.h"

#include <cmath>
#include <string>

#include "base/error.h"

namespace embrun {
namespace {

bool finite(Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void check_lens_and_shutter(const CameraSettings& s) {
  if (!(s.lens_radius >= 0) || !std::isfinite(s.lens_radius))
    throw Error("camera: lens radius " + std::to_string(s.lens_radius) + " is not 0 or more");
  if (!(s.focus_distance >= 0) || !std::isfinite(s.focus_distance))
    throw Error("camera: focus distance " + std::to_string(s.focus_distance) + " is not 0 or more");
  if (!(s.shutter_close >= s.shutter_open)) throw Error("camera: the shutter closes before it opens");
  if (!(s.filter.radius > 0)) throw Error("camera: the pixel filter's radius is not above 0");
}

}  // namespace

Camera make_camera(const CameraSettings& settings, int width, int height, Vec3d recentring) {
  if (width <= 0 || height <= 0)
    throw Error("camera: a frame of " + std::to_string(width) + "x" + std::to_string(height) + " has no pixels");
  if (!(settings.vertical_fov > 0 && settings.vertical_fov < 180))
    throw Error("camera: field of view " + std::to_string(settings.vertical_fov) + " is not between 0 and 180 degrees");
  if (!finite(settings.eye) || !finite(settings.target) || !finite(settings.up))
    throw Error("camera: its position, target or up vector is not finite");
  check_lens_and_shutter(settings);

  const Vec3d view = settings.target - settings.eye;
  const double distance = length(view);
  if (!(distance > 0)) throw Error("camera: it stands at its own target");
  const Vec3d forward = view * (1 / distance);
  const Vec3d sideways = cross(forward, settings.up);
  if (!(length(sideways) > 1e-9 * length(settings.up))) throw Error("camera: its up vector is along the view");
  const Vec3d right = normalize(sideways);

  Camera camera;
  camera.eye = to_float(settings.eye - recentring);
  camera.right = to_float(settings.mirrored ? -1.0 * right : right);
  camera.up = to_float(cross(right, forward));
  camera.forward = to_float(forward);
  camera.width = width;
  camera.height = height;
  camera.pixel_size = static_cast<float>(2 * std::tan(settings.vertical_fov * (M_PI / 360)) / height);
  camera.lens_radius = static_cast<float>(settings.lens_radius);
  camera.focus_distance = static_cast<float>(settings.focus_distance > 0 ? settings.focus_distance : distance);
  camera.shutter_open = static_cast<float>(settings.shutter_open);
  camera.shutter_close = static_cast<float>(settings.shutter_close);
  camera.filter = settings.filter;
  return camera;
}

}  // namespace embrun

#pragma once

#include "camera/pixel_filter.h"
#include "math/ray.h"
#include "sampling/warp.h"

namespace embrun {

/// A perspective camera, ready to make rays. Row 0 of the image is its top, column 0 its left; pixels are square.
struct Camera {
  Vec3 eye;
  Vec3 right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  ///< orthonormal
  int width = 1, height = 1;                            ///< pixels of the full frame, whatever the crop
  float pixel_size = 1;                                 ///< of the image plane at distance 1
  float lens_radius = 0;                                ///< metres; 0: pinhole
  float focus_distance = 1;                             ///< metres along `forward`
  float shutter_open = 0, shutter_close = 0;            ///< seconds
  PixelFilter filter;
};

/// Random numbers of a camera ray (dimensions camera_film, camera_lens, time).
struct CameraSample {
  Sample2 film;
  Sample2 lens;
  float time = 0;
};

/// Direction (not normalised, `forward` component 1) through a place of the image in pixels from its upper left corner.
EMBRUN_FN Vec3 image_plane_direction(const Camera& camera, float x, float y) {
  const float right = (x - 0.5f * static_cast<float>(camera.width)) * camera.pixel_size;
  const float up = (0.5f * static_cast<float>(camera.height) - y) * camera.pixel_size;
  return camera.forward + camera.right * right + camera.up * up;
}

/// A ray through pixel (x, y) of the full frame, with weight 1. Its footprint is the pixel's: the cone's width is the
/// lens's at the origin, its spread the angle between neighbouring pixels at the image's centre.
EMBRUN_LOCAL_FN Ray camera_ray(const Camera& camera, int x, int y, const CameraSample& sample) {
  const Sample2 offset = sample_filter(camera.filter, sample.film);
  const Vec3 direction =
      image_plane_direction(camera, static_cast<float>(x) + 0.5f + offset.x, static_cast<float>(y) + 0.5f + offset.y);
  Ray ray;
  ray.origin = camera.eye;
  ray.direction = direction;
  if (camera.lens_radius > 0.0f) {
    // Everything on the plane at focus_distance stays sharp, wherever on the lens the ray starts.
    const Sample2 d = sample_disk(sample.lens);
    const Vec3 shift = (camera.right * d.x + camera.up * d.y) * camera.lens_radius;
    ray.origin = camera.eye + shift;
    ray.direction = direction - shift * (1.0f / camera.focus_distance);
  }
  ray.direction = normalize(ray.direction);
  ray.time = camera.shutter_open + (camera.shutter_close - camera.shutter_open) * sample.time;
  ray.cone_width = 0.0f;
  ray.cone_spread = camera.pixel_size;
  return ray;
}

/// How a camera is described by users.
struct CameraSettings {
  Vec3d eye{0, 0, 1};
  Vec3d target;
  Vec3d up{0, 1, 0};
  double vertical_fov = 40;   ///< degrees, in (0, 180)
  double lens_radius = 0;     ///< metres
  double focus_distance = 0;  ///< metres along the viewing direction; 0: at the target
  double shutter_open = 0, shutter_close = 0;
  PixelFilter filter;
  bool mirrored = false;  ///< left and right exchanged

  bool operator==(const CameraSettings&) const = default;
};

/// Makes the camera for a frame of width x height pixels; `recentring` is the point of the world that per-ray code
/// takes as its origin. Throws Error for a target at the eye, an up vector along the view, a field of view out of range
/// or a frame without pixels.
Camera make_camera(const CameraSettings& settings, int width, int height, Vec3d recentring = {});

}  // namespace embrun

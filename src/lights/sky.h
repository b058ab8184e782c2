#pragma once

#include "lights/environment_image.h"

namespace embrun {

/// Parameters of the procedural sky. Radiances are relative, made for exposure 0: with the defaults a white diffuse
/// floor in the open has a radiance of about 0.8, and is nearly white.
struct SkySettings {
  float sun_elevation = 42;         ///< degrees above the horizon, 0 to 90
  float sun_azimuth = 120;          ///< degrees anticlockwise from above; 0 is the viewer's side, 90 the right
  float sun_diameter = 26;          ///< degrees, in (0, 90]: full width of the hazy glow that stands for the sun, or,
                                    ///< below smallest_soft_sun, of a uniform disk (the real sun's is 0.53)
  float sun_irradiance = 1.2f;      ///< luminance, on a plane that faces the sun; 0: no sun
  float sky_irradiance = 1.6f;      ///< luminance, on a horizontal plane, from the sky without the sun; above 0
  float turbidity = 1.4f;           ///< haze, 1 (pure air) to 10
  Rgb ground{0.42f, 0.41f, 0.40f};  ///< reflectance of the ground below the horizon

  bool operator==(const SkySettings&) const = default;
};

/// A smaller sun than this, in degrees, is rendered as a distant light of its own: a disk with a sharp edge.
inline constexpr float smallest_soft_sun = 5;

/// A clear sky from the scattering of air and haze, with a soft sun that fades to nothing at `sun_diameter`, above a
/// diffuse ground that fades into the horizon. With `include_sun == false` the sun is left out, for those who add it as
/// a distant light (sun_direction, sun_radiance); its light on the ground stays.
/// Throws Error for settings out of range, and for an included sun of fewer than four pixels.
EnvironmentImage make_sky(const SkySettings& settings, int width = 768, int height = 384, bool include_sun = true);

/// Unit direction towards the sun.
Vec3 sun_direction(const SkySettings& settings, UpAxis up);
/// Radiance of the sun's disk when it is a uniform distant light of that diameter.
Rgb sun_radiance(const SkySettings& settings);

/// A photographer's studio: four large softboxes round and above the scene, on a grey gradient. A white diffuse floor
/// has radiance 0.9.
EnvironmentImage make_studio(int width = 768, int height = 384);

}  // namespace embrun

#pragma once

#include "lights/environment_image.h"

namespace embrun {

/// Parameters of the procedural sky. Radiances are relative: with the defaults and exposure 0, a white diffuse floor in
/// the open has radiance about 1.
struct SkySettings {
  float sun_elevation = 35;        ///< degrees above the horizon, 0 to 90
  float sun_azimuth = 125;         ///< degrees anticlockwise from above; 0 is the viewer's side (back), 90 the right
  float sun_diameter = 8;          ///< degrees, at least 0.1. Under 5 no next-event estimation finds it through water
  float sun_irradiance = 1.9f;     ///< luminance-weighted, on a plane facing the sun; 0: no sun
  float turbidity = 2.6f;          ///< haze, 2 (very clear) to 10
  float sky_irradiance = 1.6f;     ///< on a horizontal plane, from the sky without the sun
  Rgb ground{0.17f, 0.16f, 0.14f}; ///< reflectance of the ground below the horizon
};

/// A clear sky after Preetham's fit to the physical model [Preetham1999] with a soft-edged sun of
/// `settings.sun_diameter`, above a diffuse ground. Throws Error for settings out of range.
/// `include_sun == false` leaves the sun out, for those who add it as a distant light (sun_radiance, sun_direction).
EnvironmentImage make_sky(const SkySettings& settings, int width = 1024, int height = 512, bool include_sun = true);

/// Unit direction towards the sun.
Vec3 sun_direction(const SkySettings& settings, UpAxis up);
/// Radiance of the sun's disk when it is a uniform distant light of that diameter.
Rgb sun_radiance(const SkySettings& settings);

/// A photographer's studio: three large softboxes above and beside the scene, on a grey gradient.
EnvironmentImage make_studio(int width = 1024, int height = 512);

}  // namespace embrun

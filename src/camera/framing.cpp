#include "camera/framing.h"

#include <cmath>
#include <string>

#include "base/error.h"

namespace embrun {
namespace {

/// Share of the picture's tighter direction that the box fills.
constexpr double fill = 0.86;

/// Direction from the scene to the camera, and the picture's up, in the up basis (right, up, back).
struct Stand {
  Vec3d towards_eye, up;
};

Stand stand_for(View view) {
  switch (view) {
    case View::front: return {{0, 0, 1}, {0, 1, 0}};
    case View::side: return {{1, 0, 0}, {0, 1, 0}};
    case View::top: return {{0, 1, 0}, {0, 0, -1}};
    case View::three_quarter: break;
  }
  // From the left, a little above: what a standing person sees of a table-top scene.
  const double azimuth = -35 * M_PI / 180, elevation = 22 * M_PI / 180;
  return {{std::cos(elevation) * std::sin(azimuth), std::sin(elevation), std::cos(elevation) * std::cos(azimuth)},
          {0, 1, 0}};
}

/// Extents of the box's corners against the pyramid of view, along one direction of the picture. With tangent t of the
/// half angle, a corner (across, depth) is inside when across - eye stays within +-t (depth - eye depth).
struct Span {
  double highest = -HUGE_VAL;  // max(across - t depth)
  double lowest = HUGE_VAL;    // min(across + t depth)

  void include(double across, double depth, double t) {
    highest = std::fmax(highest, across - t * depth);
    lowest = std::fmin(lowest, across + t * depth);
  }
  double eye_across() const { return 0.5 * (highest + lowest); }
  double eye_depth(double t) const { return (lowest - highest) / (2 * t); }
};

}  // namespace

View parse_view(std::string_view name) {
  if (name == "front") return View::front;
  if (name == "side") return View::side;
  if (name == "top") return View::top;
  if (name == "three-quarter") return View::three_quarter;
  throw Error("view '" + std::string(name) + "' is not one of front, side, top, three-quarter");
}

CameraSettings frame_box(Vec3d low, Vec3d high, View view, UpAxis up, double aspect, double vertical_fov,
                         double minimum_size) {
  EMBRUN_CHECK(aspect > 0 && vertical_fov > 0 && vertical_fov < 180 && minimum_size > 0);
  EMBRUN_CHECK(low.x <= high.x && low.y <= high.y && low.z <= high.z);
  const UpBasis basis = up_basis(up);
  const auto to_world = [&](Vec3d v) {
    return to_double(basis.right) * v.x + to_double(basis.up) * v.y + to_double(basis.back) * v.z;
  };
  const Stand stand = stand_for(view);
  const Vec3d forward = to_world(stand.towards_eye) * -1.0;
  const Vec3d right = normalize(cross(forward, to_world(stand.up)));
  const Vec3d image_up = cross(right, forward);

  const Vec3d centre = (low + high) * 0.5;
  Vec3d half = (high - low) * 0.5;
  const double largest = std::fmax(half.x, std::fmax(half.y, half.z));
  if (2 * largest < minimum_size) half = Vec3d{1, 1, 1} * (0.5 * minimum_size);

  // The nearest eye from which every corner is within the shrunk pyramid of view, in closed form.
  const double tan_v = std::tan(vertical_fov * (M_PI / 360));
  const double fit_v = fill * tan_v, fit_h = fill * tan_v * aspect;
  Span horizontal, vertical;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p{corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y, corner & 4 ? half.z : -half.z};
    horizontal.include(dot(p, right), dot(p, forward), fit_h);
    vertical.include(dot(p, image_up), dot(p, forward), fit_v);
  }
  const double eye_depth = std::fmin(horizontal.eye_depth(fit_h), vertical.eye_depth(fit_v));

  CameraSettings settings;
  settings.eye = centre + right * horizontal.eye_across() + image_up * vertical.eye_across() + forward * eye_depth;
  settings.target = settings.eye + forward * -eye_depth;
  settings.up = to_world(view == View::top ? stand.up : Vec3d{0, 1, 0});
  settings.vertical_fov = vertical_fov;
  return settings;
}

}  // namespace embrun

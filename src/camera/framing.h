#pragma once

#include <string_view>

#include "camera/camera.h"
#include "math/up_axis.h"

namespace embrun {

enum class View { front, side, top, three_quarter };

/// "front", "side", "top" or "three-quarter". Throws Error for another name.
View parse_view(std::string_view name);

/// A camera that sees the whole box low..high (world, double precision) from the given side, as large as it fits with a
/// small margin. Any box will do: flat, or a single point (then `minimum_size`, metres, is what is framed). Give a box
/// without outliers: a few stray particles would make everything small.
/// `aspect` = width / height of the picture; `vertical_fov` in degrees.
CameraSettings frame_box(Vec3d low, Vec3d high, View view, UpAxis up, double aspect, double vertical_fov = 35,
                         double minimum_size = 1e-3);

}  // namespace embrun

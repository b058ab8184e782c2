#pragma once

namespace embrun {

/// sRGB transfer function (IEC 61966-2-1) of a linear value, clipped to [0, 1]; NaN gives 0.
float srgb_encode(float linear);
/// Its inverse on [0, 1].
float srgb_decode(float encoded);

}  // namespace embrun

#pragma once

#include "base/host_device.h"

namespace embrun {

/// Weight of a sample drawn with density `pdf`, which another technique would have drawn with density `other_pdf`
/// (same measure): the balance heuristic [Veach1995]. 0 where nobody would have drawn it.
EMBRUN_FN float balance_heuristic(float pdf, float other_pdf) { return pdf > 0.0f ? pdf / (pdf + other_pdf) : 0.0f; }

/// The power heuristic with exponent 2 [Veach1995]. Written with a ratio, so that large densities do not overflow.
EMBRUN_FN float power_heuristic(float pdf, float other_pdf) {
  if (!(pdf > 0.0f)) return 0.0f;
  const float ratio = other_pdf / pdf;
  return 1.0f / (1.0f + ratio * ratio);
}

}  // namespace embrun

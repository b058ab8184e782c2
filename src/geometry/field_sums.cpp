#include "geometry/field_sums.h"

#include <cstdlib>
#include <string_view>

namespace embrun {

namespace {

const FieldSums& choose_field_sums() {
  const char* variable = std::getenv("EMBRUN_ISA");
  const std::string_view wanted = variable ? variable : "";
  if (wanted == "baseline") return field_sums_baseline;
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  if (avx512 && wanted != "avx2") return field_sums_avx512;
  return avx2 ? field_sums_avx2 : field_sums_baseline;
}

}  // namespace

const FieldSums& field_sums() {
  static const FieldSums& chosen = choose_field_sums();
  return chosen;
}

}  // namespace embrun

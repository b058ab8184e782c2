#include <cstdlib>
#include <string>

#include "backend/cpu/kernel_table.h"
#include "base/error.h"

namespace embrun {

#if defined(EMBRUN_NATIVE_KERNELS)

namespace native {
extern const KernelTable kernel_table;
}

const char* name_of(Isa) { return "native"; }
bool is_available(Isa) { return true; }
const KernelTable& kernels_of(Isa) { return native::kernel_table; }

const KernelTable& select_kernels() {
  const char* wish = std::getenv("EMBRUN_ISA");
  if (wish != nullptr && *wish != '\0' && std::string(wish) != "native")
    throw Error(std::string("EMBRUN_ISA=") + wish + ": this build is for its machine alone and knows only \"native\"");
  return native::kernel_table;
}

#else

namespace sse4 {
extern const KernelTable kernel_table;
}
namespace avx2 {
extern const KernelTable kernel_table;
}
namespace avx512 {
extern const KernelTable kernel_table;
}

const char* name_of(Isa isa) { return isa == Isa::sse4 ? "sse4" : isa == Isa::avx2 ? "avx2" : "avx512"; }

bool is_available(Isa isa) {
  // The whole of x86-64-v3 and v4, as the compiler may use all of it.
  switch (isa) {
    case Isa::sse4: return true;
    case Isa::avx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
             __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("lzcnt") && __builtin_cpu_supports("movbe") &&
             __builtin_cpu_supports("f16c");
    case Isa::avx512:
      return is_available(Isa::avx2) && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
             __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
             __builtin_cpu_supports("avx512vl");
  }
  return false;
}

const KernelTable& kernels_of(Isa isa) {
  EMBRUN_CHECK(is_available(isa));
  return isa == Isa::sse4 ? sse4::kernel_table : isa == Isa::avx2 ? avx2::kernel_table : avx512::kernel_table;
}

const KernelTable& select_kernels() {
  const char* wish = std::getenv("EMBRUN_ISA");
  if (wish == nullptr || *wish == '\0')
    return kernels_of(is_available(Isa::avx512) ? Isa::avx512 : is_available(Isa::avx2) ? Isa::avx2 : Isa::sse4);
  for (const Isa isa : {Isa::sse4, Isa::avx2, Isa::avx512}) {
    if (std::string(wish) != name_of(isa)) continue;
    if (!is_available(isa)) throw Error(std::string("EMBRUN_ISA=") + wish + ": this processor does not have it");
    return kernels_of(isa);
  }
  throw Error(std::string("EMBRUN_ISA=") + wish + ": unknown; there are sse4, avx2 and avx512");
}

#endif

}  // namespace embrun

#include "backend/cpu/kernel_table.h"

namespace embrun {

#if defined(EMBRUN_NATIVE_KERNELS)

namespace native {
extern const KernelTable kernel_table;
}

const KernelTable& kernels_of(InstructionSet) { return native::kernel_table; }

#else

namespace baseline {
extern const KernelTable kernel_table;
}
namespace avx2 {
extern const KernelTable kernel_table;
}
namespace avx512 {
extern const KernelTable kernel_table;
}

const KernelTable& kernels_of(InstructionSet set) {
  switch (set) {
    case InstructionSet::baseline: break;
    case InstructionSet::avx2: return avx2::kernel_table;
    case InstructionSet::avx512: return avx512::kernel_table;
  }
  return baseline::kernel_table;
}

#endif

const KernelTable& select_kernels() { return kernels_of(instruction_set()); }

}  // namespace embrun

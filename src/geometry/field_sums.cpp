#include "geometry/field_sums.h"

#include "base/instruction_set.h"

namespace embrun {

const FieldSums& field_sums() {
  switch (instruction_set()) {
    case InstructionSet::baseline: return field_sums_baseline;
    case InstructionSet::avx2: return field_sums_avx2;
    case InstructionSet::avx512: return field_sums_avx512;
  }
  return field_sums_baseline;
}

}  // namespace embrun

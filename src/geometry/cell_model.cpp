#include "geometry/cell_model.h"

#include "base/instruction_set.h"

namespace embrun {

const CellModelLoops& cell_model_loops() {
  switch (instruction_set()) {
    case InstructionSet::avx512: return cell_model_avx512;
    case InstructionSet::avx2: return cell_model_avx2;
    case InstructionSet::baseline: break;
  }
  return cell_model_baseline;
}

}  // namespace embrun

#include "base/instruction_set.h"

#include <cstdlib>
#include <string>

#include "base/error.h"

namespace embrun {

namespace {

InstructionSet best_of_this_machine() {
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
  const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  return avx512 ? InstructionSet::avx512 : avx2 ? InstructionSet::avx2 : InstructionSet::baseline;
}

InstructionSet choose() {
  const InstructionSet best = best_of_this_machine();
  const char* variable = std::getenv("EMBRUN_ISA");
  if (variable == nullptr || *variable == '\0') return best;
  for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (std::string(variable) != name_of(set)) continue;
    if (set > best)
      throw Error(std::string("EMBRUN_ISA=") + variable + ": this machine does not have that instruction set");
    return set;
  }
  throw Error(std::string("EMBRUN_ISA=") + variable + ": expected baseline, avx2 or avx512");
}

}  // namespace

InstructionSet instruction_set() {
  static const InstructionSet chosen = choose();
  return chosen;
}

const char* name_of(InstructionSet set) {
  switch (set) {
    case InstructionSet::baseline: return "baseline";
    case InstructionSet::avx2: return "avx2";
    case InstructionSet::avx512: return "avx512";
  }
  return "";
}

}  // namespace embrun

#pragma once

namespace embrun {

/// The versions that the hot loops are compiled in.
enum class InstructionSet {
  baseline,  ///< x86-64-v2
  avx2,      ///< x86-64-v3: AVX2, FMA
  avx512,    ///< x86-64-v4
};

/// The best version that this machine runs, or the one that the environment variable EMBRUN_ISA names
/// (baseline, avx2, avx512): the same bits come out of all machines that run the same version.
/// Throws Error when the variable names none of them, or one that this machine does not have.
InstructionSet instruction_set();

const char* name_of(InstructionSet set);

}  // namespace embrun

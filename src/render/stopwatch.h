#pragma once

#include <chrono>

#include "embrun/embrun.h"

namespace embrun {

// Of the whole process, up to now.
double cpu_seconds();
double peak_memory_bytes();

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  /// Of the processor, all threads of the process together.
  double cpu_seconds() const { return embrun::cpu_seconds() - cpu_start_; }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double cpu_start_ = embrun::cpu_seconds();
};

/// Tells whoever listens how far a stage is, with an estimate of what remains.
void tell(const RenderHooks& hooks, const char* stage, double fraction, double elapsed);

}  // namespace embrun

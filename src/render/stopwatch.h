#pragma once

#include <chrono>

#include "embrun/embrun.h"

namespace embrun {

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Tells whoever listens how far a stage is, with an estimate of what remains.
void tell(const RenderHooks& hooks, const char* stage, double fraction, double elapsed);

// Of the whole process, up to now.
double cpu_seconds();
double peak_memory_bytes();

}  // namespace embrun

#include "render/stopwatch.h"

#include <sys/resource.h>

namespace embrun {
namespace {

rusage process_usage() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage;
}

}  // namespace

void tell(const RenderHooks& hooks, const char* stage, double fraction, double elapsed) {
  if (!hooks.progress) return;
  const double remaining = fraction > 0 ? elapsed * (1 - fraction) / fraction : -1;
  hooks.progress({stage, fraction, elapsed, remaining});
}

double cpu_seconds() {
  const rusage usage = process_usage();
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double peak_memory_bytes() { return 1024 * static_cast<double>(process_usage().ru_maxrss); }

}  // namespace embrun

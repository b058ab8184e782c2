#include "base/error.h"

#include <cstdio>
#include <cstdlib>

namespace embrun {

void check_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "embrun: internal check failed: %s (%s:%d)\n", condition, file, line);
  std::abort();
}

}  // namespace embrun

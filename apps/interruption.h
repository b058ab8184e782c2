#pragma once

#include <atomic>

namespace embrun {

/// From now on the first Ctrl-C (or SIGTERM) only sets the flag that is returned, for an orderly end; the second ends the
/// program as usual.
const std::atomic<bool>& catch_interrupts();

}  // namespace embrun

#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstddef>

namespace embrun {

/// Calls body(begin, end) over pieces of [0, count) on the worker threads of the enclosing TBB arena.
/// `grain` is the least size of a piece. Pieces may run in any order and on any thread, so a body
/// must write only to what belongs to its own indices: results then do not depend on the number of threads.
template <class Body>
void parallel_for(std::size_t count, std::size_t grain, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain),
                    [&](const tbb::blocked_range<std::size_t>& piece) { body(piece.begin(), piece.end()); });
}

}  // namespace embrun

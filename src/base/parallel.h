#pragma once

#include <cstddef>

#if defined(__SANITIZE_THREAD__)
#define EMBRUN_THREAD_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define EMBRUN_THREAD_SANITIZER 1
#endif
#endif

#if defined(EMBRUN_THREAD_SANITIZER)
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>
#else
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>
#endif

namespace embrun {

#if defined(EMBRUN_THREAD_SANITIZER)

/// The same loop over threads of the standard library: the sanitizer does not see how TBB, which Debian
/// builds without it, hands work from thread to thread, and would call all of it a race.
template <class Body>
void parallel_for(std::size_t count, std::size_t grain, const Body& body) {
  std::atomic<std::size_t> next{0};
  std::mutex failure_lock;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t begin; (begin = next.fetch_add(grain)) < count;) body(begin, std::min(begin + grain, count));
    } catch (...) {
      const std::lock_guard guard(failure_lock);
      failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 1; i < std::min<std::size_t>(4, (count + grain - 1) / grain); ++i) threads.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

template <class Container>
void parallel_sort(Container& values) {
  std::sort(values.begin(), values.end());
}

#else

/// Calls body(begin, end) over pieces of [0, count) on the worker threads of the enclosing TBB arena.
/// `grain` is the least size of a piece. Pieces may run in any order and on any thread, so a body
/// must write only to what belongs to its own indices: results then do not depend on the number of threads.
template <class Body>
void parallel_for(std::size_t count, std::size_t grain, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain),
                    [&](const tbb::blocked_range<std::size_t>& piece) { body(piece.begin(), piece.end()); });
}

/// Sorts by <; equal values may change places.
template <class Container>
void parallel_sort(Container& values) {
  tbb::parallel_sort(values.begin(), values.end());
}

#endif

}  // namespace embrun

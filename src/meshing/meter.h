#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <mutex>

namespace embrun {

/// Tells how far a loop is, about ten times a second: from `begin` to `end` of the whole work.
class Meter {
 public:
  Meter(const std::function<void(double)>& progress, double begin, double end, std::size_t total)
      : progress_(progress), begin_(begin), share_((end - begin) / static_cast<double>(total)) {}

  /// So many of the total are done. From any thread.
  void add(std::size_t count) {
    const std::size_t done = done_.fetch_add(count, std::memory_order_relaxed) + count;
    if (!progress_) return;
    // Whoever comes while another one tells has nothing to add.
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    progress_(begin_ + share_ * static_cast<double>(done));
  }

 private:
  const std::function<void(double)>& progress_;
  double begin_, share_;
  std::atomic<std::size_t> done_{0};
  std::mutex mutex_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace embrun

#pragma once

#include <cstddef>
#include <new>

#include "backend/cpu/kernel_table.h"

namespace embrun {

/// Working memory of a thread, aligned for any instruction set.
class BatchMemory {
 public:
  explicit BatchMemory(const KernelTable& kernels)
      : bytes_(static_cast<std::byte*>(::operator new (kernels.batch_bytes, std::align_val_t{64}))) {}
  ~BatchMemory() { ::operator delete (bytes_, std::align_val_t{64}); }
  BatchMemory(const BatchMemory&) = delete;
  BatchMemory& operator=(const BatchMemory&) = delete;

  PathBatch& batch() { return *reinterpret_cast<PathBatch*>(bytes_); }

 private:
  std::byte* bytes_;
};

}  // namespace embrun

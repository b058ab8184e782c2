// Arrays of a mebibyte and more on huge pages, for programs that link embrun_huge_pages: the global operator new, replaced.
// What rays read at random is hundreds of megabytes, far beyond what the processor can translate addresses of in pages of
// 4 KiB, and each of those pages is a fault when it is first written. See docs/performance.md.

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>

namespace {

constexpr std::size_t huge_page = std::size_t{1} << 21;
constexpr std::size_t least_array = std::size_t{1} << 20;

void* allocate(std::size_t size, std::size_t alignment) noexcept {
  if (size >= least_array && alignment <= huge_page && size <= std::numeric_limits<std::size_t>::max() - huge_page) {
    // Whole pages, so that the end of an array is on one too.
    const std::size_t bytes = (size + huge_page - 1) / huge_page * huge_page;
    void* memory = std::aligned_alloc(huge_page, bytes);
    // Advice: where the system knows no huge pages the array is as it would have been.
    if (memory != nullptr) madvise(memory, bytes, MADV_HUGEPAGE);
    return memory;
  }
  if (alignment <= alignof(std::max_align_t)) return std::malloc(size > 0 ? size : 1);
  return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}

void* allocate_or_throw(std::size_t size, std::size_t alignment) {
  for (;;) {
    if (void* memory = allocate(size, alignment)) return memory;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}

}  // namespace

// The array and nothrow forms of the standard library call these.
void* operator new(std::size_t size) { return allocate_or_throw(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocate_or_throw(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

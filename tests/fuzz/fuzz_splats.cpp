#include <cstring>
#include <memory>
#include <new>

#include "fuzz_reader.h"
#include "io/splat_file.h"

namespace embrun {

/// Found by the type of its argument. Rays leave neither the arrays nor go on for ever.
inline void check(const SplatHierarchy& splats) {
  SplatSet set = splats.set();
  for (const bool closed : {false, true})
    for (const float width : {0.0f, 1.0f}) {
      set.closed = closed;
      Ray ray;
      ray.origin = {0.1f, 0.2f, -3};
      ray.cone_width = width;
      SurfaceHit hit;
      intersect_splats(set, splats.tree(1), ray, false, {}, hit);
    }
}

}  // namespace embrun

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Where mapped files lie.
  struct Release {
    void operator()(std::uint8_t* bytes) const { ::operator delete[](bytes, std::align_val_t{64}); }
  };
  const std::unique_ptr<std::uint8_t, Release> file(
      static_cast<std::uint8_t*>(::operator new[](size + 1, std::align_val_t{64})));
  if (size > 0) std::memcpy(file.get(), data, size);
  return embrun::fuzz::run(file.get(), size, embrun::view_splat_file);
}

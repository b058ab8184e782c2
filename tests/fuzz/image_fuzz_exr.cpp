#include "fuzz/image_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return embrun::fuzz_picture(data, size, [](embrun::Bytes bytes) {
    embrun::ImageMetadata metadata;
    const embrun::ImageLayers picture = embrun::decode_exr_layers(bytes, "fuzz", &metadata);
    return picture.layers.empty() ? embrun::Image{} : picture.layers.back();
  });
}

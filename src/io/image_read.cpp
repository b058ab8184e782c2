#include "io/image_read.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/error.h"
#include "io/file_bytes.h"
#include "io/image_formats.h"

namespace embrun {
namespace {

bool starts_with(Bytes bytes, std::string_view magic) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), magic.size()));
  return head == magic;
}

}  // namespace

void fail_image(const std::string& file, const std::string& what) { throw Error(file + ": " + what); }

void check_image_size(std::int64_t width, std::int64_t height, std::size_t file_size, double pixels_per_byte,
                      const std::string& file) {
  constexpr std::int64_t most_pixels = std::int64_t{1} << 28;
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width < 1 || height < 1) {
    fail_image(file, "the picture's size " + size + " is not positive");
  }
  if (width > most_pixels || height > most_pixels || width * height > most_pixels) {
    fail_image(file, "the picture's size " + size + " exceeds 2^28 pixels");
  }
  if (static_cast<double>(width) * static_cast<double>(height) > pixels_per_byte * static_cast<double>(file_size)) {
    fail_image(file, "a picture of " + size + " is too large for a file of " + std::to_string(file_size) + " bytes");
  }
}

Image read_image(std::span<const std::byte> bytes, const std::string& name, const std::string& layer,
                 PixelEncoding encoding) {
  if (starts_with(bytes, "\x76\x2f\x31\x01")) {
    return decode_exr(bytes, name, layer);
  }
  if (starts_with(bytes, "#?")) {
    return decode_hdr(bytes, name);
  }
  if (starts_with(bytes, "PF") || starts_with(bytes, "Pf")) {
    return decode_pfm(bytes, name);
  }
  if (starts_with(bytes, "\x89PNG")) {
    return decode_png(bytes, name, encoding);
  }
  if (starts_with(bytes, "\xff\xd8\xff")) {
    return decode_jpeg(bytes, name, encoding);
  }
  fail_image(name, "not a picture that can be read: none of EXR, HDR, PFM, PNG, JPEG by its first bytes");
}

Image read_image(const std::filesystem::path& path, const std::string& layer, PixelEncoding encoding) {
  return read_image(read_file_bytes(path.string()), path.string(), layer, encoding);
}

ImageLayers read_exr_layers(std::span<const std::byte> bytes, const std::string& name, ImageMetadata* metadata) {
  return decode_exr_layers(bytes, name, metadata);
}

ImageLayers read_exr_layers(const std::filesystem::path& path, ImageMetadata* metadata) {
  return decode_exr_layers(read_file_bytes(path.string()), path.string(), metadata);
}

Image as_environment(const Image& picture) {
  constexpr float brightest = 1e20f;
  Image result = make_image(picture.width, picture.height, 3);
  const auto channels = static_cast<std::size_t>(picture.channels);
  for (std::size_t i = 0; i < picture.pixel_count(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      result.pixels[3 * i + c] = std::min(picture.pixels[channels * i + (channels == 3 ? c : 0)], brightest);
  return result;
}

EnvironmentRepair clean_environment(Image& image) {
  EnvironmentRepair repair;
  const auto channels = static_cast<std::size_t>(image.channels);
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    bool not_finite = false, negative = false;
    for (float& v : std::span(image.pixels).subspan(i * channels, channels)) {
      const bool bad = !std::isfinite(v);
      not_finite |= bad;
      negative |= !bad && v < 0.0f;
      v = bad || v < 0.0f ? 0.0f : v;
    }
    repair.not_finite += not_finite ? 1u : 0u;
    repair.negative += negative ? 1u : 0u;
  }
  return repair;
}

}  // namespace embrun

#include "io/image_write.h"

#include <algorithm>
#include <cctype>

#include "base/error.h"
#include "image/film.h"
#include "io/atomic_file.h"
#include "io/image_formats.h"
#include "math/vec.h"

namespace embrun {
namespace {

std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

/// RGBE holds neither negative nor infinite values.
Image without_what_hdr_lacks(Image image) {
  const bool is_normal = image.name == "normal";
  for (float& v : image.pixels) {
    v = !is_finite(v) ? 0.0f : is_normal ? 0.5f + 0.5f * v : v;
  }
  return image;
}

bool is_srgb_encoded(const Image& layer) {
  return layer.name != "normal" && layer.name != "depth" && layer.name != "samples";
}

const Image& single_layer(const ImageLayers& picture, const std::string& name) {
  const Image& layer = picture.layer(name);
  if (layer.channels != 1 && layer.channels != 3) {
    throw Error("layer \"" + name + "\" has " + std::to_string(layer.channels) +
                " channels; PFM, HDR and PNG files hold 1 or 3 (EXR holds any)");
  }
  return layer;
}

}  // namespace

ImageFormat image_format_of(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".exr") {
    return ImageFormat::exr;
  }
  if (extension == ".pfm") {
    return ImageFormat::pfm;
  }
  if (extension == ".hdr") {
    return ImageFormat::hdr;
  }
  if (extension == ".png") {
    return ImageFormat::png;
  }
  throw Error("cannot write " + path.string() + ": " +
              (extension.empty() ? "no extension" : "unknown extension \"" + extension + "\"") +
              "; pictures are written as .exr, .hdr, .pfm or .png");
}

void check_image_output(const std::filesystem::path& path) {
  (void)image_format_of(path);
  check_writable(path);
}

void check_layer_name(const std::string& name) {
  std::string names;
  for (const char* known : film_layer_names) {
    if (name == known) {
      return;
    }
    names += (names.empty() ? "" : ", ") + std::string(known);
  }
  throw Error("unknown layer \"" + name + "\"; there are: " + names);
}

std::vector<std::byte> encode_image(ImageFormat format, const ImageLayers& picture, const ImageWriteOptions& options,
                                    const ImageMetadata& metadata) {
  if (format == ImageFormat::exr) {
    return encode_exr(picture, options.half, metadata);
  }
  const Image& layer = single_layer(picture, options.layer);
  switch (format) {
    case ImageFormat::pfm: return encode_pfm(layer);
    case ImageFormat::hdr: return encode_hdr(without_what_hdr_lacks(layer), metadata);
    case ImageFormat::png:
      return encode_png(to_display(layer, options.tone, picture.window.x, picture.window.y), is_srgb_encoded(layer),
                        metadata);
    case ImageFormat::exr: break;
  }
  throw Error("unknown image format");
}

void write_image(const std::filesystem::path& path, const ImageLayers& picture, const ImageWriteOptions& options,
                 const ImageMetadata& metadata) {
  const ImageFormat format = image_format_of(path);
  check_writable(path);
  write_file_atomically(path, encode_image(format, picture, options, metadata));
}

void write_image(const std::filesystem::path& path, const Image& image, const ImageWriteOptions& options,
                 const ImageMetadata& metadata) {
  ImageLayers picture;
  picture.display_width = image.width;
  picture.display_height = image.height;
  picture.window = {0, 0, image.width, image.height};
  picture.layers.push_back(image);
  ImageWriteOptions of_this = options;
  of_this.layer = image.name;
  write_image(path, picture, of_this, metadata);
}

}  // namespace embrun

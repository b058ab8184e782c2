#include "image/image.h"

#include "base/error.h"

namespace embrun {

Image make_image(int width, int height, int channels, std::string name, std::vector<std::string> channel_names) {
  EMBRUN_CHECK(width >= 0 && height >= 0 && channels >= 0);
  Image image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.name = std::move(name);
  image.channel_names = std::move(channel_names);
  image.pixels.assign(image.pixel_count() * static_cast<std::size_t>(channels), 0.0f);
  return image;
}

const Image* ImageLayers::find(const std::string& name) const {
  for (const Image& image : layers) {
    if (image.name == name) {
      return &image;
    }
  }
  return nullptr;
}

Image* ImageLayers::find(const std::string& name) {
  return const_cast<Image*>(static_cast<const ImageLayers*>(this)->find(name));
}

const Image& ImageLayers::layer(const std::string& name) const {
  if (const Image* image = find(name)) {
    return *image;
  }
  std::string names;
  for (const Image& image : layers) {
    names += (names.empty() ? "" : ", ") + image.name;
  }
  throw Error("no layer \"" + name + "\" in the picture; it has: " + (names.empty() ? "none" : names));
}

}  // namespace embrun

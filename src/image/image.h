#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace embrun {

/// A rectangle of pixels: columns [x, x + width), rows [y, y + height); row 0 is the top of the picture.
struct PixelWindow {
  int x = 0, y = 0;
  int width = 0, height = 0;

  bool operator==(const PixelWindow&) const = default;
};

/// A picture or one layer of one: linear values, channels interleaved, row 0 at the top, column 0 at the left.
struct Image {
  int width = 0, height = 0;
  int channels = 0;
  std::string name;                        ///< the layer's name ("beauty", "depth", ...); may be empty
  std::vector<std::string> channel_names;  ///< one per channel, such as R G B, X Y Z or Z; empty: R G B or Y
  std::vector<float> pixels;               ///< width * height * channels values

  std::size_t index(int x, int y, int channel = 0) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels) +
           static_cast<std::size_t>(channel);
  }
  float& at(int x, int y, int channel = 0) { return pixels[index(x, y, channel)]; }
  float at(int x, int y, int channel = 0) const { return pixels[index(x, y, channel)]; }
  std::size_t pixel_count() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }

  bool operator==(const Image&) const = default;
};

/// An image of zeros. Sizes must not be negative.
Image make_image(int width, int height, int channels, std::string name = {},
                 std::vector<std::string> channel_names = {});

/// The layers of one picture. All have the size of `window`, the part of the full picture that was rendered
/// (the crop; the whole picture without one).
struct ImageLayers {
  int display_width = 0, display_height = 0;  ///< size of the full picture
  PixelWindow window;                         ///< where the layers lie in it
  std::vector<Image> layers;

  /// The layer of that name; null when there is none.
  const Image* find(const std::string& name) const;
  Image* find(const std::string& name);
  /// The layer of that name; throws Error that lists the names there are.
  const Image& layer(const std::string& name) const;
};

/// Facts written into a picture's file, in order: command, seed, version, render time, anything else.
/// Keys are short words of ASCII letters, digits, '_', '-', '.'.
using ImageMetadata = std::vector<std::pair<std::string, std::string>>;

}  // namespace embrun

#include <ImfAttribute.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "base/error.h"
#include "io/exr_header.h"
#include "io/image_formats.h"

namespace embrun {
namespace {

constexpr std::string_view attribute_prefix = "embrun:";

class MemoryInput : public Imf::IStream {
 public:
  MemoryInput(Bytes bytes, const std::string& file) : Imf::IStream(file.c_str()), bytes_(bytes) {}

  bool read(char c[], int n) override {
    const auto count = static_cast<std::size_t>(n);
    if (n < 0 || position_ > bytes_.size() || count > bytes_.size() - position_) {
      throw std::runtime_error("the file ends early");
    }
    std::memcpy(c, bytes_.data() + position_, count);
    position_ += count;
    return position_ < bytes_.size();
  }
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override { position_ = static_cast<std::size_t>(position); }

 private:
  Bytes bytes_;
  std::size_t position_ = 0;
};

class MemoryOutput : public Imf::OStream {
 public:
  explicit MemoryOutput(std::vector<std::byte>& bytes) : Imf::OStream("picture"), bytes_(bytes) {}

  void write(const char c[], int n) override {
    const auto count = static_cast<std::size_t>(n);
    if (position_ + count > bytes_.size()) {
      bytes_.resize(position_ + count);
    }
    std::memcpy(bytes_.data() + position_, c, count);
    position_ += count;
  }
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override { position_ = static_cast<std::size_t>(position); }

 private:
  std::vector<std::byte>& bytes_;
  std::size_t position_ = 0;
};

// --- channel names ---

/// "normal.X" is channel X of layer "normal"; a name without a dot belongs to the layer "".
std::string layer_of(const std::string& channel) {
  const std::size_t dot = channel.rfind('.');
  return dot == std::string::npos ? std::string() : channel.substr(0, dot);
}
std::string suffix_of(const std::string& channel) {
  const std::size_t dot = channel.rfind('.');
  return dot == std::string::npos ? channel : channel.substr(dot + 1);
}

/// R G B A before the rest in the file's (alphabetical) order.
int rank_of(const std::string& suffix) {
  const std::string_view order = "RGBA";
  const std::size_t place = suffix.size() == 1 ? order.find(suffix[0]) : std::string_view::npos;
  return place == std::string_view::npos ? static_cast<int>(order.size()) : static_cast<int>(place);
}

std::vector<std::string> default_channel_names(int channels) {
  switch (channels) {
    case 1: return {"Y"};
    case 3: return {"R", "G", "B"};
    case 4: return {"R", "G", "B", "A"};
    default: {
      std::vector<std::string> names;
      for (int c = 0; c < channels; ++c) {
        names.push_back("C" + std::to_string(c));
      }
      return names;
    }
  }
}

// --- reading ---

/// What both readers need: the opened file, whose size is known to be sane.
struct OpenExr {
  MemoryInput stream;
  Imf::InputFile file;
  Imath::Box2i window;

  OpenExr(Bytes bytes, const std::string& name)
      : stream(bytes, name), file(stream, 0), window(file.header().dataWindow()) {}

  int width() const { return window.max.x - window.min.x + 1; }
  int height() const { return window.max.y - window.min.y + 1; }
};

/// Reads the named channels into one interleaved image.
Image read_channels(OpenExr& exr, const std::vector<std::string>& channels, const std::string& file) {
  Image image = make_image(exr.width(), exr.height(), static_cast<int>(channels.size()));
  const std::size_t x_stride = sizeof(float) * channels.size();
  const std::size_t y_stride = x_stride * static_cast<std::size_t>(image.width);
  Imf::FrameBuffer frame;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const Imf::Channel* channel = exr.file.header().channels().findChannel(channels[c]);
    if (channel->xSampling != 1 || channel->ySampling != 1) {
      fail_image(file, "EXR channel \"" + channels[c] + "\" is subsampled (luminance-chroma files are not read)");
    }
    frame.insert(channels[c], Imf::Slice::Make(Imf::FLOAT, image.pixels.data() + c, exr.window, x_stride, y_stride));
    image.channel_names.push_back(suffix_of(channels[c]));
  }
  exr.file.setFrameBuffer(frame);
  exr.file.readPixels(exr.window.min.y, exr.window.max.y);
  return image;
}

/// Channel names by layer, in the order that Image wants.
std::vector<std::pair<std::string, std::vector<std::string>>> channels_by_layer(const Imf::Header& header) {
  std::vector<std::pair<std::string, std::vector<std::string>>> layers;
  for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
    const std::string layer = layer_of(i.name());
    const auto same = [&](const auto& entry) { return entry.first == layer; };
    auto place = std::find_if(layers.begin(), layers.end(), same);
    if (place == layers.end()) {
      place = layers.insert(layer.empty() ? layers.begin() : layers.end(), {layer, {}});
    }
    place->second.push_back(i.name());
  }
  for (auto& [layer, names] : layers) {
    std::stable_sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
      return rank_of(suffix_of(a)) < rank_of(suffix_of(b));
    });
  }
  return layers;
}

/// The one or three channels that make up a layer's picture.
std::vector<std::string> picture_channels(const Imf::Header& header, const std::string& layer,
                                          const std::string& file) {
  const std::string prefix = layer.empty() || layer == "beauty" ? std::string() : layer + ".";
  const auto has = [&](const char* suffix) { return header.channels().findChannel(prefix + suffix) != nullptr; };
  if (has("R") && has("G") && has("B")) {
    return {prefix + "R", prefix + "G", prefix + "B"};
  }
  if (has("X") && has("Y") && has("Z")) {
    return {prefix + "X", prefix + "Y", prefix + "Z"};
  }
  for (const char* suffix : {"Y", "Z", "N", "R"}) {
    if (has(suffix)) {
      return {prefix + suffix};
    }
  }
  std::string names;
  for (auto i = header.channels().begin(); i != header.channels().end() && names.size() < 200; ++i) {
    names += (names.empty() ? "" : ", ") + std::string(i.name());
  }
  fail_image(file, "EXR file has no channels " + prefix + "R, " + prefix + "G, " + prefix + "B nor " + prefix +
                       "Y; it has: " + (names.empty() ? "none" : names));
}

/// Runs `read`, and turns what OpenEXR throws into an Error that names the file.
template <class Read>
auto with_exr_errors(const std::string& file, const Read& read) {
  try {
    return read();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    fail_image(file, "not enough memory to read it");
  } catch (const std::exception& e) {
    fail_image(file, std::string("bad EXR file: ") + e.what());
  }
}

void read_metadata(const Imf::Header& header, ImageMetadata& metadata) {
  for (auto i = header.begin(); i != header.end(); ++i) {
    const std::string name = i.name();
    const auto* text = dynamic_cast<const Imf::StringAttribute*>(&i.attribute());
    if (text != nullptr && name.starts_with(attribute_prefix)) {
      metadata.emplace_back(name.substr(attribute_prefix.size()), text->value());
    }
  }
}

// --- writing ---

/// A value as half: finite ones stay finite.
Imath::half to_half(float v) {
  constexpr float highest = 65504.0f;
  return is_finite(v) ? Imath::half(clamp(v, -highest, highest)) : Imath::half(v);
}

bool may_be_half(const Image& layer) {
  return layer.name.empty() || layer.name == "beauty" || layer.name == "albedo" || layer.name == "normal";
}

}  // namespace

Image decode_exr(Bytes bytes, const std::string& file, const std::string& layer) {
  check_exr_header(bytes, file);
  return with_exr_errors(file, [&] {
    OpenExr exr(bytes, file);
    return read_channels(exr, picture_channels(exr.file.header(), layer, file), file);
  });
}

ImageLayers decode_exr_layers(Bytes bytes, const std::string& file, ImageMetadata* metadata) {
  check_exr_header(bytes, file);
  return with_exr_errors(file, [&] {
    OpenExr exr(bytes, file);
    const Imath::Box2i display = exr.file.header().displayWindow();
    ImageLayers picture;
    picture.display_width = display.max.x - display.min.x + 1;
    picture.display_height = display.max.y - display.min.y + 1;
    picture.window = {exr.window.min.x - display.min.x, exr.window.min.y - display.min.y, exr.width(), exr.height()};
    for (const auto& [layer, channels] : channels_by_layer(exr.file.header())) {
      Image image = read_channels(exr, channels, file);
      image.name = layer.empty() ? "beauty" : layer;
      picture.layers.push_back(std::move(image));
    }
    if (metadata != nullptr) {
      read_metadata(exr.file.header(), *metadata);
    }
    return picture;
  });
}

std::vector<std::byte> encode_exr(const ImageLayers& picture, bool half, const ImageMetadata& metadata) {
  const PixelWindow& w = picture.window;
  const Imath::Box2i display({0, 0}, {picture.display_width - 1, picture.display_height - 1});
  const Imath::Box2i data({w.x, w.y}, {w.x + w.width - 1, w.y + w.height - 1});
  Imf::Header header(display, data);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const auto& [key, value] : metadata) {
    header.insert(std::string(attribute_prefix) + key, Imf::StringAttribute(value));
  }

  Imf::FrameBuffer frame;
  std::vector<std::vector<Imath::half>> half_pixels(picture.layers.size());
  for (std::size_t i = 0; i < picture.layers.size(); ++i) {
    const Image& layer = picture.layers[i];
    EMBRUN_CHECK(layer.width == w.width && layer.height == w.height);
    const bool as_half = half && may_be_half(layer);
    if (as_half) {
      half_pixels[i].reserve(layer.pixels.size());
      for (float v : layer.pixels) {
        half_pixels[i].push_back(to_half(v));
      }
    }
    const Imf::PixelType type = as_half ? Imf::HALF : Imf::FLOAT;
    const auto* base = as_half ? reinterpret_cast<const char*>(half_pixels[i].data())
                               : reinterpret_cast<const char*>(layer.pixels.data());
    const std::size_t value_size = as_half ? sizeof(Imath::half) : sizeof(float);
    const std::size_t x_stride = value_size * static_cast<std::size_t>(layer.channels);
    const std::string prefix = layer.name.empty() || layer.name == "beauty" ? "" : layer.name + ".";
    const std::vector<std::string> names = layer.channel_names.size() == static_cast<std::size_t>(layer.channels)
                                               ? layer.channel_names
                                               : default_channel_names(layer.channels);
    for (std::size_t c = 0; c < names.size(); ++c) {
      header.channels().insert(prefix + names[c], Imf::Channel(type));
      // OpenEXR takes a pointer that it could write to; an output file only reads it.
      frame.insert(prefix + names[c], Imf::Slice::Make(type, base + c * value_size, data, x_stride,
                                                       x_stride * static_cast<std::size_t>(w.width)));
    }
  }

  std::vector<std::byte> bytes;
  MemoryOutput stream(bytes);
  {
    Imf::OutputFile file(stream, header, 0);
    file.setFrameBuffer(frame);
    file.writePixels(w.height);
  }
  return bytes;
}

}  // namespace embrun

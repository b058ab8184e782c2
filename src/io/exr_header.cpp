#include "io/exr_header.h"

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "io/image_formats.h"

namespace embrun {
namespace {

/// What the header of one part says about sizes.
struct Part {
  bool has_window = false;
  std::int64_t width = 0, height = 0;
  std::int64_t tile_width = 0, tile_height = 0;
  std::int64_t pixel_bytes = 0;  ///< over all channels, as if none were subsampled
  int compression = 0;
};

class HeaderReader {
 public:
  HeaderReader(Bytes bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  [[noreturn]] void fail(const std::string& what) const {
    fail_image(file_, "bad EXR header: " + what + ", at byte " + std::to_string(position_));
  }

  std::uint32_t take_u32() {
    const Bytes raw = take(4);
    std::uint32_t value = 0;
    for (unsigned i = 0; i < 4; ++i) {
      value |= std::to_integer<std::uint32_t>(raw[i]) << 8 * i;
    }
    return value;
  }

  Bytes take(std::size_t count) {
    if (count > bytes_.size() - position_) {
      fail("the file ends early");
    }
    const Bytes result = bytes_.subspan(position_, count);
    position_ += count;
    return result;
  }

  /// A text ended by a zero byte, without it.
  std::string_view take_text() {
    constexpr std::size_t longest = 255;
    const std::string_view rest(reinterpret_cast<const char*>(bytes_.data()) + position_, bytes_.size() - position_);
    const std::size_t end = rest.substr(0, longest + 1).find('\0');
    if (end == std::string_view::npos) {
      fail(rest.size() > longest ? "a name of more than 255 characters" : "the file ends early");
    }
    position_ += end + 1;
    return rest.substr(0, end);
  }

  std::size_t position() const { return position_; }
  bool at_end() const { return position_ >= bytes_.size(); }

 private:
  Bytes bytes_;
  const std::string& file_;
  std::size_t position_ = 0;
};

/// Size of the pixel type: uint, half, float.
std::int64_t type_bytes(std::uint32_t type) { return type == 1 ? 2 : 4; }

/// Bytes that the listed channels take in a pixel. Leaves `reader` at the end of the list.
std::int64_t read_channel_list(HeaderReader& reader) {
  std::int64_t bytes = 0;
  while (!reader.take_text().empty()) {
    bytes += type_bytes(reader.take_u32());
    (void)reader.take(12);  // linearity, padding, sampling in x and y
  }
  return bytes;
}

/// Length of an attribute's value where its type has one, else 0.
std::size_t fixed_size_of(std::string_view type) {
  struct TypeSize {
    std::string_view type;
    std::size_t size;
  };
  static constexpr TypeSize sizes[] = {{"box2f", 16},
                                       {"box2i", 16},
                                       {"chromaticities", 32},
                                       {"compression", 1},
                                       {"deepImageState", 1},
                                       {"double", 8},
                                       {"envmap", 1},
                                       {"float", 4},
                                       {"int", 4},
                                       {"keycode", 28},
                                       {"lineOrder", 1},
                                       {"m33d", 72},
                                       {"m33f", 36},
                                       {"m44d", 128},
                                       {"m44f", 64},
                                       {"rational", 8},
                                       {"tiledesc", 9},
                                       {"timecode", 8},
                                       {"v2d", 16},
                                       {"v2f", 8},
                                       {"v2i", 8},
                                       {"v3d", 24},
                                       {"v3f", 12},
                                       {"v3i", 12}};
  for (const TypeSize& entry : sizes) {
    if (type == entry.type) {
      return entry.size;
    }
  }
  return 0;
}

/// OpenEXR reads a value by its type, whatever length is stated before it, and the next attribute after that: the
/// two must agree, or it reads another header than was checked here.
void check_value_size(HeaderReader value, std::string_view type, std::size_t size) {
  const std::size_t end = value.position() + size;
  const std::size_t fixed = fixed_size_of(type);
  bool right = fixed == 0 || size == fixed;
  if (type == "chlist") {
    (void)read_channel_list(value);
    right = value.position() == end;
  } else if (type == "floatvector") {
    right = size % 4 == 0;
  } else if (type == "preview") {
    const std::uint64_t width = value.take_u32();
    const std::uint64_t height = value.take_u32();
    right = width < (1u << 15) && height < (1u << 15) && size == 8 + 4 * width * height;
  } else if (type == "stringvector") {
    while (value.position() + 4 <= end) {
      (void)value.take(value.take_u32());
    }
    right = value.position() == end;
  } else if (type == "idmanifest") {
    value.fail("an ID manifest, which is not read");
  }
  if (!right) {
    value.fail("an attribute of type " + std::string(type) + " has the wrong length " + std::to_string(size));
  }
}

void read_window(HeaderReader reader, Part& part) {
  const auto number = [&] { return static_cast<std::int64_t>(static_cast<std::int32_t>(reader.take_u32())); };
  const std::int64_t x0 = number(), y0 = number(), x1 = number(), y1 = number();
  part.width = x1 - x0 + 1;
  part.height = y1 - y0 + 1;
  part.has_window = true;
}

/// Attributes up to the empty name that ends them. False when there are none (the end of a list of parts).
bool read_part(HeaderReader& reader, Part& part) {
  for (bool any = false;; any = true) {
    const std::string_view name = reader.take_text();
    if (name.empty()) {
      return any;
    }
    const std::string_view type = reader.take_text();
    const std::size_t size = reader.take_u32();
    HeaderReader value = reader;
    const Bytes raw = reader.take(size);
    check_value_size(value, type, size);
    if (name == "channels" && type == "chlist") {
      part.pixel_bytes = read_channel_list(value);
    } else if (name == "dataWindow" && type == "box2i") {
      read_window(value, part);
    } else if (name == "tiles" && type == "tiledesc") {
      part.tile_width = value.take_u32();
      part.tile_height = value.take_u32();
    } else if (name == "compression" && type == "compression") {
      part.compression = std::to_integer<int>(raw[0]);
    }
  }
}

void check_part(const Part& part, std::size_t file_size, const std::string& file) {
  if (!part.has_window || part.pixel_bytes == 0) {
    fail_image(file, "bad EXR header: no data window, or no channels");
  }
  // Bytes of pixels that a byte of file can stand for: measured on flat pictures of 8192x4096, at most 1,330 for all
  // compressions but DWA, and 29,500 for that. Such a ratio would justify almost anything, so it holds up to 128 MB.
  constexpr int first_dwa = 8;
  constexpr double dwa_bytes = 128e6;
  const double size = static_cast<double>(file_size);
  const double bytes_per_byte =
      part.compression >= first_dwa ? std::max(2048.0, std::min(32768.0, dwa_bytes / size)) : 2048.0;
  check_image_size(part.width, part.height, file_size, bytes_per_byte / static_cast<double>(part.pixel_bytes), file);
  const std::int64_t longest_tile = std::max<std::int64_t>(1024, std::max(part.width, part.height));
  if (part.tile_width > longest_tile || part.tile_height > longest_tile ||
      part.tile_width * part.tile_height > std::max(std::int64_t{1} << 20, 4 * part.width * part.height)) {
    fail_image(file, "bad EXR header: tiles of " + std::to_string(part.tile_width) + "x" +
                         std::to_string(part.tile_height) + " for a picture of " + std::to_string(part.width) + "x" +
                         std::to_string(part.height));
  }
}

}  // namespace

void check_exr_header(Bytes bytes, const std::string& file) {
  constexpr std::uint32_t magic = 20000630;
  constexpr std::uint32_t deep_flag = 0x800, multi_part_flag = 0x1000;
  HeaderReader reader(bytes, file);
  if (reader.take_u32() != magic) {
    fail_image(file, "not an EXR file");
  }
  const std::uint32_t version = reader.take_u32();
  if ((version & deep_flag) != 0) {
    fail_image(file, "a deep EXR file; only flat pictures are read");
  }
  const bool multi_part = (version & multi_part_flag) != 0;
  for (int parts = 0;; ++parts) {
    Part part;
    if (!read_part(reader, part)) {
      if (parts == 0) {
        fail_image(file, "bad EXR header: it is empty");
      }
      return;
    }
    check_part(part, bytes.size(), file);
    if (!multi_part) {
      return;
    }
  }
}

}  // namespace embrun

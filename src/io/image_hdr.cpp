// Radiance RGBE pictures [Ward1991]: a text header, then scan lines of pixels with a shared exponent, flat or
// run-length encoded by pixels (old) or by components (new).
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "io/image_formats.h"

namespace embrun {
namespace {

using Rgbe = std::array<std::uint8_t, 4>;

// --- reading ---

struct Header {
  int width = 0, height = 0;
  bool bottom_up = false, right_to_left = false;
  double exposure = 1;
  std::size_t end = 0;  ///< first byte of the pixels
};

class HeaderLines {
 public:
  HeaderLines(Bytes bytes, const std::string& file)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), file_(file) {}

  std::string_view next() {
    const std::size_t end = text_.find('\n', position_);
    if (end == std::string_view::npos) {
      fail_image(file_, "HDR header ends early, at byte " + std::to_string(position_));
    }
    std::string_view line = text_.substr(position_, end - position_);
    position_ = end + 1;
    if (line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    return line;
  }
  std::size_t position() const { return position_; }

 private:
  std::string_view text_;
  const std::string& file_;
  std::size_t position_ = 0;
};

/// "-Y 512 +X 1024"; the four variants with rows along X.
void parse_resolution(std::string_view line, Header& header, const std::string& file) {
  const std::string text(line.substr(0, 80));
  char sign_y = 0, sign_x = 0, end = 0;
  const int count =
      std::sscanf(text.c_str(), "%cY %9d %cX %9d%c", &sign_y, &header.height, &sign_x, &header.width, &end);
  const auto is_sign = [](char c) { return c == '+' || c == '-'; };
  if (count != 4 || !is_sign(sign_y) || !is_sign(sign_x)) {
    fail_image(file, "HDR resolution line \"" + text + "\" is not of the form -Y HEIGHT +X WIDTH");
  }
  header.bottom_up = sign_y == '+';
  header.right_to_left = sign_x == '-';
}

Header parse_header(Bytes bytes, const std::string& file) {
  HeaderLines lines(bytes, file);
  Header header;
  std::string_view line = lines.next();
  if (!line.starts_with("#?")) {
    fail_image(file, "not a Radiance HDR file: it does not start with #?");
  }
  for (line = lines.next(); !line.empty(); line = lines.next()) {
    if (line.starts_with("FORMAT=") && line != "FORMAT=32-bit_rle_rgbe") {
      fail_image(file, "HDR pixel format \"" + std::string(line.substr(7, 60)) + "\"; only 32-bit_rle_rgbe is read");
    }
    if (line.starts_with("EXPOSURE=")) {
      std::string_view number = line.substr(9);
      while (number.starts_with(' ')) {
        number.remove_prefix(1);
      }
      double value = 0;
      const auto result = std::from_chars(number.data(), number.data() + number.size(), value);
      if (result.ec != std::errc() || !(value > 0) || !std::isfinite(value)) {
        fail_image(file, "HDR header: EXPOSURE must be a number above 0");
      }
      header.exposure *= value;
    }
  }
  parse_resolution(lines.next(), header, file);
  header.end = lines.position();
  return header;
}

/// Takes pixels off the file's bytes; every take is checked.
class PixelReader {
 public:
  PixelReader(Bytes bytes, std::size_t position, const std::string& file)
      : bytes_(bytes), position_(position), file_(file) {}

  void read_row(std::span<Rgbe> row) {
    if (starts_new_encoding(row.size())) {
      position_ += 4;
      for (std::size_t component = 0; component < 4; ++component) {
        read_component(row, component);
      }
    } else {
      read_old(row);
    }
  }

  std::size_t position() const { return position_; }

 private:
  [[noreturn]] void fail(const char* what) const {
    fail_image(file_, std::string("HDR pixels: ") + what + ", at byte " + std::to_string(position_));
  }

  std::uint8_t take() {
    if (position_ >= bytes_.size()) {
      fail("the file ends early");
    }
    return std::to_integer<std::uint8_t>(bytes_[position_++]);
  }

  std::uint8_t peek(std::size_t offset) const {
    return position_ + offset < bytes_.size() ? std::to_integer<std::uint8_t>(bytes_[position_ + offset]) : 0;
  }

  bool starts_new_encoding(std::size_t width) const {
    const std::size_t stored = static_cast<std::size_t>(peek(2)) << 8 | peek(3);
    return width >= 8 && width <= 0x7fff && peek(0) == 2 && peek(1) == 2 && stored == width;
  }

  void read_component(std::span<Rgbe> row, std::size_t component) {
    for (std::size_t x = 0; x < row.size();) {
      const std::uint8_t code = take();
      const bool run = code > 128;
      const std::size_t count = run ? code - 128u : code;
      if (count == 0 || count > row.size() - x) {
        fail("a run does not fit its row");
      }
      const std::uint8_t value = run ? take() : std::uint8_t{0};
      for (std::size_t i = 0; i < count; ++i) {
        row[x++][component] = run ? value : take();
      }
    }
  }

  /// Flat pixels; 1 1 1 n repeats the last pixel n times, further ones in sequence count in steps of 256^k.
  void read_old(std::span<Rgbe> row) {
    unsigned shift = 0;
    for (std::size_t x = 0; x < row.size();) {
      Rgbe pixel;
      for (std::uint8_t& component : pixel) {
        component = take();
      }
      if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
        row[x++] = pixel;
        shift = 0;
        continue;
      }
      const std::size_t count = shift < 32 ? static_cast<std::size_t>(pixel[3]) << shift : row.size();
      if (x == 0 || count > row.size() - x) {
        fail("a run does not fit its row");
      }
      for (std::size_t i = 0; i < count; ++i, ++x) {
        row[x] = row[x - 1];
      }
      shift += 8;
    }
  }

  Bytes bytes_;
  std::size_t position_;
  const std::string& file_;
};

// --- writing ---

/// Shared exponent of the largest channel, mantissas rounded to nearest.
Rgbe to_rgbe(float r, float g, float b) {
  const auto sane = [](float v) { return v > 0.0f ? std::fmin(v, 1.69e38f) : 0.0f; };
  const float channels[3] = {sane(r), sane(g), sane(b)};
  const float high = std::fmax(channels[0], std::fmax(channels[1], channels[2]));
  if (high < 1e-38f) {
    return {0, 0, 0, 0};
  }
  int exponent = 0;
  (void)std::frexp(high, &exponent);
  if (std::lround(std::ldexp(high, 8 - exponent)) > 255) {
    ++exponent;  // 255.5 and above would round up out of the byte
  }
  Rgbe pixel;
  for (std::size_t c = 0; c < 3; ++c) {
    pixel[c] = static_cast<std::uint8_t>(std::lround(std::ldexp(channels[c], 8 - exponent)));
  }
  pixel[3] = static_cast<std::uint8_t>(exponent + 128);
  return pixel;
}

void append(std::vector<std::byte>& out, std::string_view text) {
  for (char c : text) {
    out.push_back(static_cast<std::byte>(c));
  }
}

/// One component of a row: runs of at least 4 equal bytes (at most 127), and literal stretches (at most 128).
void append_component(std::vector<std::byte>& out, std::span<const Rgbe> row, std::size_t component) {
  const auto run_at = [&](std::size_t x) {
    std::size_t length = 1;
    while (length < 127 && x + length < row.size() && row[x + length][component] == row[x][component]) {
      ++length;
    }
    return length;
  };
  for (std::size_t x = 0; x < row.size();) {
    const std::size_t run = run_at(x);
    if (run >= 4) {
      out.push_back(static_cast<std::byte>(128 + run));
      out.push_back(static_cast<std::byte>(row[x][component]));
      x += run;
      continue;
    }
    std::size_t end = x + run;
    while (end < row.size() && run_at(end) < 4) {
      ++end;
    }
    end = end - x > 128 ? x + 128 : end;
    out.push_back(static_cast<std::byte>(end - x));
    for (; x < end; ++x) {
      out.push_back(static_cast<std::byte>(row[x][component]));
    }
  }
}

void append_row(std::vector<std::byte>& out, std::span<const Rgbe> row) {
  if (row.size() < 8 || row.size() > 0x7fff) {
    for (const Rgbe& pixel : row) {
      for (const std::uint8_t component : pixel) {
        out.push_back(static_cast<std::byte>(component));
      }
    }
    return;
  }
  for (const std::size_t v : {std::size_t{2}, std::size_t{2}, row.size() >> 8, row.size() & 0xff}) {
    out.push_back(static_cast<std::byte>(v));
  }
  for (std::size_t component = 0; component < 4; ++component) {
    append_component(out, row, component);
  }
}

}  // namespace

Image decode_hdr(Bytes bytes, const std::string& file) {
  const Header header = parse_header(bytes, file);
  // The component encoding packs 127 bytes into 2; the pixel encoding could pack more, but no real picture does.
  check_image_size(header.width, header.height, bytes.size(), 256, file);
  Image image = make_image(header.width, header.height, 3);
  PixelReader reader(bytes, header.end, file);
  std::vector<Rgbe> row(static_cast<std::size_t>(header.width));
  const float inverse_exposure = static_cast<float>(1.0 / header.exposure);
  for (int i = 0; i < header.height; ++i) {
    reader.read_row(row);
    const int y = header.bottom_up ? header.height - 1 - i : i;
    for (int j = 0; j < header.width; ++j) {
      const Rgbe& pixel = row[static_cast<std::size_t>(j)];
      const int x = header.right_to_left ? header.width - 1 - j : j;
      const float unit = pixel[3] == 0 ? 0.0f : std::ldexp(inverse_exposure, pixel[3] - 136);
      for (int c = 0; c < 3; ++c) {
        image.at(x, y, c) = static_cast<float>(pixel[static_cast<std::size_t>(c)]) * unit;
      }
    }
  }
  return image;
}

std::vector<std::byte> encode_hdr(const Image& image, const ImageMetadata& metadata) {
  std::vector<std::byte> out;
  append(out, "#?RADIANCE\n");
  for (const auto& [key, value] : metadata) {
    std::string line = "# embrun:" + key + "=" + value;
    for (char& c : line) {
      c = c == '\n' || c == '\r' ? ' ' : c;
    }
    append(out, line + "\n");
  }
  append(out,
         "FORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(image.height) + " +X " + std::to_string(image.width) + "\n");
  std::vector<Rgbe> row(static_cast<std::size_t>(image.width));
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int last = image.channels - 1;
      row[static_cast<std::size_t>(x)] =
          to_rgbe(image.at(x, y, 0), image.at(x, y, last > 0 ? 1 : 0), image.at(x, y, last > 1 ? 2 : 0));
    }
    append_row(out, row);
  }
  return out;
}

}  // namespace embrun

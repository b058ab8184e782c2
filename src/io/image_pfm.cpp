#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string_view>

#include "io/image_formats.h"

namespace embrun {
namespace {

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

/// The words of the header: each ended by one white-space character, the last one's being the last header byte.
class HeaderWords {
 public:
  HeaderWords(Bytes bytes, const std::string& file)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), file_(file) {}

  std::string_view next() {
    while (position_ < text_.size() && is_space(text_[position_])) {
      ++position_;
    }
    const std::size_t start = position_;
    while (position_ < text_.size() && !is_space(text_[position_]) && position_ - start < 64) {
      ++position_;
    }
    if (position_ == start || position_ >= text_.size() || !is_space(text_[position_])) {
      fail_image(file_, "PFM header ends early, or holds an overlong word, at byte " + std::to_string(start));
    }
    return text_.substr(start, position_++ - start);
  }

  template <class Number>
  Number number(const char* what) {
    const std::string_view word = next();
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      fail_image(file_, std::string("PFM header: the ") + what + " \"" + std::string(word) + "\" is no number");
    }
    return value;
  }

  std::size_t position() const { return position_; }

 private:
  std::string_view text_;
  const std::string& file_;
  std::size_t position_ = 0;
};

float load_float(const std::byte* bytes, bool little_endian) {
  std::uint32_t bits = 0;
  for (int i = 0; i < 4; ++i) {
    bits |= std::to_integer<std::uint32_t>(bytes[i]) << (little_endian ? 8 * i : 24 - 8 * i);
  }
  return std::bit_cast<float>(bits);
}

}  // namespace

Image decode_pfm(Bytes bytes, const std::string& file) {
  HeaderWords header(bytes, file);
  const std::string_view magic = header.next();
  if (magic != "PF" && magic != "Pf") {
    fail_image(file, "not a PFM file: it starts neither with PF nor Pf");
  }
  const int channels = magic == "PF" ? 3 : 1;
  const auto width = header.number<std::int32_t>("width");
  const auto height = header.number<std::int32_t>("height");
  const auto scale = header.number<float>("scale");
  check_image_size(width, height, bytes.size(), 0.25, file);
  if (!std::isfinite(scale) || scale == 0.0f) {
    fail_image(file, "PFM header: the scale must be finite and not 0");
  }
  Image image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  const std::size_t values = image.pixel_count() * static_cast<std::size_t>(channels);
  if (bytes.size() - header.position() != 4 * values) {
    fail_image(file, "PFM of " + std::to_string(width) + "x" + std::to_string(height) + " must hold " +
                         std::to_string(4 * values) + " bytes after the header, but has " +
                         std::to_string(bytes.size() - header.position()));
  }
  image.pixels.resize(values);
  const std::size_t row_values = values / static_cast<std::size_t>(height);
  const std::byte* next = bytes.data() + header.position();
  for (int y = height - 1; y >= 0; --y) {
    float* row = image.pixels.data() + static_cast<std::size_t>(y) * row_values;
    for (std::size_t i = 0; i < row_values; ++i, next += 4) {
      row[i] = load_float(next, scale < 0.0f) * std::fabs(scale);
    }
  }
  return image;
}

std::vector<std::byte> encode_pfm(const Image& image) {
  char header[64];
  const int length = std::snprintf(header, sizeof header, "%s\n%d %d\n-1.0\n", image.channels == 3 ? "PF" : "Pf",
                                   image.width, image.height);
  std::vector<std::byte> bytes(static_cast<std::size_t>(length) + 4 * image.pixels.size());
  std::memcpy(bytes.data(), header, static_cast<std::size_t>(length));
  std::byte* next = bytes.data() + length;
  const std::size_t row_values = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels);
  for (int y = image.height - 1; y >= 0; --y) {
    const float* row = image.pixels.data() + static_cast<std::size_t>(y) * row_values;
    for (std::size_t i = 0; i < row_values; ++i) {
      const auto bits = std::bit_cast<std::uint32_t>(row[i]);
      for (unsigned shift = 0; shift < 32; shift += 8) {
        *next++ = static_cast<std::byte>(bits >> shift & 0xffu);
      }
    }
  }
  return bytes;
}

}  // namespace embrun

#include "io/byte_stream.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "base/error.h"
#include "io/cursor.h"

namespace embrun {

namespace {

constexpr std::uint64_t most_deflate_ratio = 1032;
constexpr std::size_t largest_zlib_block = std::size_t{1} << 30;

}  // namespace

bool is_gzip(std::span<const std::byte> file) {
  return file.size() >= 2 && file[0] == std::byte{0x1f} && file[1] == std::byte{0x8b};
}

struct ByteStream::Inflater {
  z_stream zlib{};
  bool finished = false;  // the last member of the gzip file is complete and its checksum was right

  Inflater() {
    constexpr int largest_window_and_gzip = 15 + 16;
    EMBRUN_CHECK(inflateInit2(&zlib, largest_window_and_gzip) == Z_OK);
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  ~Inflater() { inflateEnd(&zlib); }
};

ByteStream::ByteStream(std::span<const std::byte> file, std::string_view name) : left_(file), file_(name) {
  if (is_gzip(file)) inflater_ = std::make_unique<Inflater>();
}

ByteStream::~ByteStream() = default;

std::size_t ByteStream::read_some(std::span<std::byte> out) {
  if (!inflater_) {
    const std::size_t count = std::min(out.size(), left_.size());
    if (count > 0) std::memcpy(out.data(), left_.data(), count);
    left_ = left_.subspan(count);
    offset_ += count;
    return count;
  }
  z_stream& zlib = inflater_->zlib;
  std::size_t done = 0;
  while (done < out.size() && !inflater_->finished) {
    const std::size_t room = std::min(out.size() - done, largest_zlib_block);
    const std::size_t input = std::min(left_.size(), largest_zlib_block);
    zlib.next_out = reinterpret_cast<Bytef*>(out.data() + done);
    zlib.avail_out = static_cast<uInt>(room);
    zlib.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(left_.data()));
    zlib.avail_in = static_cast<uInt>(input);
    const int status = inflate(&zlib, Z_NO_FLUSH);
    const std::size_t written = room - zlib.avail_out;
    left_ = left_.subspan(input - zlib.avail_in);
    done += written;
    offset_ += written;
    if (status == Z_STREAM_END) {
      // A gzip file may be several streams one after the other.
      inflater_->finished = !is_gzip(left_);
      if (!inflater_->finished) EMBRUN_CHECK(inflateReset(&zlib) == Z_OK);
    } else if (status == Z_BUF_ERROR || (status == Z_OK && left_.empty() && written == 0)) {
      fail("gzip", "the compressed data end too early");
    } else if (status != Z_OK) {
      fail("gzip", fmt::format("the compressed data are damaged ({})", zlib.msg ? zlib.msg : "zlib error"));
    }
  }
  return done;
}

void ByteStream::read(std::span<std::byte> out, std::string_view what) {
  const std::uint64_t begin = offset_;
  const std::size_t count = read_some(out);
  if (count == out.size()) return;
  fail_in_file(file_, fmt::format("offset {}", begin), what,
               fmt::format("the file ends here: {} bytes are needed, {} are left", out.size(), count));
}

void ByteStream::skip(std::uint64_t count, std::string_view what) {
  std::array<std::byte, 4096> block;
  while (count > 0) {
    const std::size_t part = static_cast<std::size_t>(std::min<std::uint64_t>(count, block.size()));
    read(std::span(block).first(part), what);
    count -= part;
  }
}

std::uint64_t ByteStream::most_remaining() const {
  if (!inflater_) return left_.size();
  // Bits that zlib has taken in but not yet given out are worth at most a window and a copy.
  constexpr std::uint64_t in_flight = 1 << 16;
  return left_.size() * most_deflate_ratio + in_flight;
}

void ByteStream::require(std::uint64_t count, std::uint64_t bytes_each, std::string_view what) const {
  if (count <= most_remaining() / bytes_each) return;
  fail(what, fmt::format("{} times {} bytes are announced, but at most {} are left in the file", count, bytes_each,
                         most_remaining()));
}

void ByteStream::fail(std::string_view what, std::string_view message) const {
  fail_in_file(file_, fmt::format("offset {}", offset_), what, message);
}

}  // namespace embrun

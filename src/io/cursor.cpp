#include "io/cursor.h"

#include <fmt/format.h>

#include "base/error.h"
#include "io/text.h"

namespace embrun {

void fail_in_file(std::string_view file, std::string_view place, std::string_view what, std::string_view message) {
  std::string text(file);
  for (const std::string_view part : {place, what, message}) {
    if (!part.empty()) text += fmt::format(": {}", part);
  }
  if (message == no_particles) throw NoParticles(text);
  throw Error(text);
}

Cursor::Cursor(std::span<const std::byte> bytes, std::string_view file)
    : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), file_(file) {}

void Cursor::consume_line_end() {
  if (at_end()) return;
  if (text_[offset_] == '\r' && offset_ + 1 < text_.size() && text_[offset_ + 1] == '\n') ++offset_;
  ++offset_;
  ++next_line_;
}

std::string_view Cursor::line() {
  last_line_ = next_line_;
  const std::size_t begin = offset_;
  offset_ = std::min(text_.find_first_of("\r\n", begin), text_.size());
  const std::string_view result = text_.substr(begin, offset_ - begin);
  consume_line_end();
  return result;
}

std::string_view Cursor::filled_line() {
  while (!at_end()) {
    const std::string_view result = trimmed(line());
    if (!result.empty()) return result;
  }
  return {};
}

std::string_view Cursor::token() {
  while (!at_end() && is_space(text_[offset_])) {
    if (text_[offset_] == '\n' || text_[offset_] == '\r') {
      consume_line_end();
    } else {
      ++offset_;
    }
  }
  last_line_ = next_line_;
  const std::size_t begin = offset_;
  while (!at_end() && !is_space(text_[offset_])) ++offset_;
  return text_.substr(begin, offset_ - begin);
}

std::span<const std::byte> Cursor::take(std::size_t count) {
  EMBRUN_CHECK(count <= remaining());
  const std::string_view block = text_.substr(offset_, count);
  offset_ += count;
  return std::as_bytes(std::span(block.data(), block.size()));
}

void Cursor::require(std::uint64_t count, std::uint64_t bytes_each, std::string_view what) const {
  if (count <= remaining() / bytes_each) return;
  fail(what, fmt::format("{} times {} bytes are announced, but only {} are left in the file", count, bytes_each,
                         remaining()));
}

void Cursor::require_numbers(std::uint64_t count, std::string_view what) const {
  // The last number needs no blank after it.
  if (count <= (remaining() + 1) / 2) return;
  fail(what, fmt::format("{} numbers are announced, but only {} bytes are left in the file", count, remaining()));
}

std::string Cursor::place() const {
  return binary_ ? fmt::format("offset {}", offset_) : fmt::format("line {}", last_line_);
}

void Cursor::fail(std::string_view what, std::string_view message) const {
  fail_in_file(file_, place(), what, message);
}

}  // namespace embrun

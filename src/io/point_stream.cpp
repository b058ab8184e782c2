#include "io/point_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"
#include "io/cursor.h"
#include "io/particle_readers.h"
#include "io/ply.h"
#include "io/text.h"

namespace embrun {
namespace {

constexpr std::uint64_t points_at_a_time = std::uint64_t{1} << 18;
constexpr std::size_t longest_header = std::size_t{1} << 16;

/// Where the vertices of a PLY file lie, and what the header says before and after their number.
struct PlyLayout {
  std::string before, after;
  std::uint64_t count = 0, record = 0, offset = 0;
};

std::uint64_t record_bytes(const PlyElement& element) {
  std::uint64_t bytes = 0;
  for (const PlyProperty& property : element.properties) bytes += size_of(property.type);
  return bytes;
}

/// Null where the file is to be read whole.
std::optional<PlyLayout> layout_of(std::string_view start, std::string_view name) {
  if (!start.starts_with("ply")) return std::nullopt;
  PlyLayout layout;
  try {
    const PlyFile ply(std::as_bytes(std::span(start.data(), start.size())), name);
    const PlyElement& first = ply.elements().empty() ? PlyElement{} : ply.elements().front();
    const bool lists =
        std::any_of(first.properties.begin(), first.properties.end(), [](const auto& p) { return p.is_list; });
    if (ply.format() == "PLY ascii" || first.name != "vertex" || lists || first.count == 0) return std::nullopt;
    layout.count = first.count;
    layout.record = record_bytes(first);
    layout.offset = ply.cursor().offset();
  } catch (const Error&) {
    // Read whole, it says what is wrong.
    return std::nullopt;
  }
  const std::string_view header = start.substr(0, static_cast<std::size_t>(layout.offset));
  constexpr std::string_view keywords = "\nelement vertex ";
  const std::size_t element = header.find(keywords);
  if (element == std::string_view::npos || layout.record == 0) return std::nullopt;
  const std::size_t number = element + keywords.size();
  layout.before = header.substr(0, number);
  layout.after = header.substr(header.find_first_of("\r\n", number));
  return layout;
}

/// Each piece is read as a file of its own, so that what columns mean is told in one place.
class PlyStream : public PointStream {
 public:
  PlyStream(std::ifstream file, PlyLayout layout, std::string name)
      : file_(std::move(file)), layout_(std::move(layout)), name_(std::move(name)) {}

  std::uint64_t count() const override { return layout_.count; }

  ParticleSet next() override {
    std::size_t dropped = 0;
    while (done_ < layout_.count) {
      const std::uint64_t before = done_;
      const std::vector<char> piece = next_piece();
      try {
        ParticleSet points = read_ply_particles(std::as_bytes(std::span(piece)), name_);
        points.dropped_non_finite += dropped;
        return points;
      } catch (const NoParticles&) {
        dropped += static_cast<std::size_t>(done_ - before);
      }
    }
    ParticleSet none;
    none.dropped_non_finite = dropped;
    return none;
  }

  void rewind() override {
    done_ = 0;
    file_.clear();
  }

 private:
  std::ifstream file_;
  PlyLayout layout_;
  std::string name_;
  std::uint64_t done_ = 0;

  /// The next stretch, with a header.
  std::vector<char> next_piece() {
    const std::uint64_t count = std::min(points_at_a_time, layout_.count - done_);
    const std::string header = layout_.before + std::to_string(count) + layout_.after;
    const auto bytes = static_cast<std::size_t>(count * layout_.record);
    const std::uint64_t offset = layout_.offset + done_ * layout_.record;
    std::vector<char> piece(header.begin(), header.end());
    piece.resize(header.size() + bytes);
    file_.seekg(static_cast<std::streamoff>(offset));
    file_.read(piece.data() + header.size(), static_cast<std::streamsize>(bytes));
    if (!file_)
      throw Error(
          fmt::format("{}: offset {}: element 'vertex': cannot be read, or the file became shorter", name_, offset));
    done_ += count;
    return piece;
  }
};

class HeldStream : public PointStream {
 public:
  explicit HeldStream(ParticleSet particles) : particles_(std::move(particles)) {}
  std::uint64_t count() const override { return particles_.size(); }
  ParticleSet next() override { return std::exchange(shown_, true) ? ParticleSet{} : particles_; }
  void rewind() override { shown_ = false; }

 private:
  ParticleSet particles_;
  bool shown_ = false;
};

}  // namespace

std::unique_ptr<PointStream> open_point_stream(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return nullptr;
  std::ifstream file(path, std::ios::binary);
  std::string start(longest_header, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  file.clear();
  std::optional<PlyLayout> layout = layout_of(start, path);
  if (!layout) return nullptr;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (layout->count > (size - layout->offset) / layout->record)
    throw Error(fmt::format("{}: offset {}: element 'vertex': {} times {} bytes are announced, but {} are left", path,
                            layout->offset, layout->count, layout->record, size - layout->offset));
  return std::make_unique<PlyStream>(std::move(file), std::move(*layout), path);
}

std::unique_ptr<PointStream> stream_of(ParticleSet particles) {
  return std::make_unique<HeldStream>(std::move(particles));
}

}  // namespace embrun

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "particles/particle_set.h"

namespace embrun::test {

/// Bytes of a file under construction; numbers are appended as big- or little-endian.
class FileBytes {
 public:
  explicit FileBytes(bool big_endian = true) : big_endian_(big_endian) {}
  FileBytes& text(std::string_view text) {
    bytes_ += text;
    return *this;
  }
  template <class Value>
  FileBytes& number(Value value) {
    std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
    if (big_endian_) raw.assign(raw.rbegin(), raw.rend());
    bytes_ += raw;
    return *this;
  }
  const std::string& str() const { return bytes_; }

 private:
  bool big_endian_;
  std::string bytes_;
};

inline std::span<const std::byte> as_bytes(std::string_view file) {
  return std::as_bytes(std::span(file.data(), file.size()));
}

/// The file packed by gzip.
std::string gzipped(std::string_view file);

/// The start of a classic BGEO file: version 5, no primitives and groups.
FileBytes bgeo_header(std::int32_t points, std::int32_t point_attributes);

/// The particles in each format, written independently of the readers: float positions, float and int attributes.
std::string as_bgeo(const ParticleSet& set);
enum class PlyKind { ascii, little_endian, big_endian };
std::string as_ply(const ParticleSet& set, PlyKind kind);
std::string as_vtk(const ParticleSet& set, bool binary, std::string_view dataset);
std::string as_csv(const ParticleSet& set, char separator, bool header);

/// The first `count` particles of the bundled dam break.
ParticleSet some_particles(std::size_t count);

/// A unit tetrahedron with normals at its corners.
std::string tetrahedron_ply(PlyKind kind);
std::string tetrahedron_obj();

/// The message of the Error that reading the file throws; "" when it throws none.
std::string particle_error(std::string_view file, std::string_view name = "some.file");
std::string mesh_error(std::string_view file, std::string_view name = "some.file");

}  // namespace embrun::test

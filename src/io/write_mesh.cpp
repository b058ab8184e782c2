#include "io/write_mesh.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "io/atomic_file.h"
#include "io/text.h"

namespace embrun {

namespace {

static_assert(std::endian::native == std::endian::little, "PLY files are written as memory has the numbers");

/// Collects what is written and hands it on by the megabyte.
class Buffer {
 public:
  explicit Buffer(const ByteSink& sink) : sink_(sink) {}
  ~Buffer() = default;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  template <class... Values>
  void text(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(bytes_), format, std::forward<Values>(values)...);
    flush_when_full();
  }
  template <class Value>
  void number(Value value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes_.append(raw, raw + sizeof value);
  }
  template <class Real>
  void vector(Real x, Real y, Real z) {
    number(x);
    number(y);
    number(z);
  }
  void flush_when_full() {
    if (bytes_.size() >= (std::size_t{1} << 20)) flush();
  }
  void flush() {
    sink_(std::as_bytes(std::span(bytes_.data(), bytes_.size())));
    bytes_.clear();
  }

 private:
  const ByteSink& sink_;
  fmt::memory_buffer bytes_;
};

std::string one_line(std::string_view text) { return printable(text); }

bool needs_double(const TriangleMesh& mesh, const MeshWriteOptions& options) {
  double largest = 0;
  for (const Vec3& local : mesh.positions) {
    const Vec3d p = options.origin + to_double(local);
    largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }
  return largest * 6e-8 > static_cast<double>(options.resolution) && options.resolution > 0;
}

void write_ply(Buffer& out, const TriangleMesh& mesh, const MeshWriteOptions& options) {
  const bool wide = needs_double(mesh, options), smooth = !mesh.normals.empty(), mapped = !mesh.coordinates.empty();
  const char* real = wide ? "double" : "float";
  out.text("ply\nformat binary_little_endian 1.0\n");
  if (!options.comment.empty()) out.text("comment {}\n", one_line(options.comment));
  out.text("element vertex {}\nproperty {} x\nproperty {} y\nproperty {} z\n", mesh.positions.size(), real, real, real);
  if (smooth) out.text("property float nx\nproperty float ny\nproperty float nz\n");
  if (mapped) out.text("property float u\nproperty float v\n");
  out.text("element face {}\nproperty list uchar uint vertex_indices\nend_header\n", mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3d p = options.origin + to_double(mesh.positions[i]);
    if (wide)
      out.vector(p.x, p.y, p.z);
    else
      out.vector(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    if (smooth) out.vector(mesh.normals[i].x, mesh.normals[i].y, mesh.normals[i].z);
    if (mapped) {
      out.number(mesh.coordinates[i].x);
      out.number(mesh.coordinates[i].y);
    }
    out.flush_when_full();
  }
  for (const auto& t : mesh.triangles) {
    out.number(std::uint8_t{3});
    out.vector(t[0], t[1], t[2]);
    out.flush_when_full();
  }
}

/// OBJ counts from 1; its texture coordinates from a picture's last row.
void write_obj(Buffer& out, const TriangleMesh& mesh, const MeshWriteOptions& options) {
  const bool smooth = !mesh.normals.empty(), mapped = !mesh.coordinates.empty();
  if (!options.comment.empty()) out.text("# {}\n", one_line(options.comment));
  const bool wide = needs_double(mesh, options);
  for (const Vec3& local : mesh.positions) {
    const Vec3d p = options.origin + to_double(local);
    if (wide)
      out.text("v {} {} {}\n", p.x, p.y, p.z);
    else
      out.text("v {} {} {}\n", static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
  }
  for (const Vec2& uv : mesh.coordinates) out.text("vt {} {}\n", uv.x, 1.0f - uv.y);
  for (const Vec3& n : mesh.normals) out.text("vn {} {} {}\n", n.x, n.y, n.z);
  const auto corner = [&](std::uint32_t i) {
    const std::uint64_t n = std::uint64_t{i} + 1;
    if (mapped && smooth)
      out.text(" {}/{}/{}", n, n, n);
    else if (mapped)
      out.text(" {}/{}", n, n);
    else if (smooth)
      out.text(" {}//{}", n, n);
    else
      out.text(" {}", n);
  };
  for (const auto& t : mesh.triangles) {
    out.text("f");
    for (const std::uint32_t i : t) corner(i);
    out.text("\n");
  }
}

enum class MeshFormat { ply, obj };

MeshFormat format_of(const std::string& path) {
  const std::string extension = to_lower(std::filesystem::path(path).extension().string());
  if (extension == ".ply") return MeshFormat::ply;
  if (extension == ".obj") return MeshFormat::obj;
  throw Error(fmt::format("{}: a mesh is written as .ply or .obj", path));
}

}  // namespace

void check_mesh_path(const std::string& path) {
  format_of(path);
  check_writable(path);
}

void write_mesh(const std::string& path, const TriangleMesh& mesh, const MeshWriteOptions& options) {
  const MeshFormat format = format_of(path);
  stream_file_atomically(path, [&](const ByteSink& sink) {
    Buffer out(sink);
    format == MeshFormat::ply ? write_ply(out, mesh, options) : write_obj(out, mesh, options);
    out.flush();
  });
}

}  // namespace embrun

#include "io/read_particles.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>

#include "io/byte_stream.h"
#include "io/cursor.h"
#include "io/file_bytes.h"
#include "io/obj_lines.h"
#include "io/particle_readers.h"
#include "io/text.h"

namespace embrun {

namespace {

/// Formats that people are likely to try, and what to do about it.
struct Foreign {
  std::string_view start;
  const char* advice;
};

constexpr Foreign foreign_formats[] = {
    {"\x7fNSJ", "this is the newer binary BGEO (Houdini 12 and up); write classic BGEO (\"Bgeo\" V5), PLY or VTK"},
    {"<?xml", "XML files (.vtu, .vtp) are not read; write legacy VTK, PLY or BGEO"},
    {"<VTKFile", "XML files (.vtu, .vtp) are not read; write legacy VTK, PLY or BGEO"},
    {"\x89HDF", "HDF5 files are not read; write VTK, PLY, BGEO or CSV"},
    {"Ogawa", "Alembic files are not read; write PLY, BGEO or CSV"},
    {" BDV", "OpenVDB files are not read; write the particles as PLY, BGEO or CSV"},
    {"\x28\xb5\x2f\xfd", "the file is packed by zstd; unpack it first"},
    {"ASTM-E57", "E57 files are not read; write PLY, PCD or LAS"},
    {"PK\x03\x04", "the file is a zip archive; unpack it first"},
};

/// Whether the start of the file holds nothing but printable text (UTF-8 included).
bool looks_like_text(std::string_view file) {
  const std::string_view start = file.substr(0, 4096);
  return std::none_of(start.begin(), start.end(), [](char c) {
    const auto code = static_cast<unsigned char>(c);
    return (code < 0x20 && !is_space(c)) || code == 0x7f;
  });
}

/// Whether the first line that is no comment starts a header of PCD.
bool is_pcd(std::span<const std::byte> file) {
  Cursor cursor(file, "");
  std::string_view line = cursor.filled_line();
  while (line.starts_with('#')) line = cursor.filled_line();
  const std::string_view keyword = take_token(line);
  return keyword == "VERSION" || (keyword == "FIELDS" && !line.empty());
}

}  // namespace

ParticleSet read_particles_from_memory(std::span<const std::byte> file, std::string_view name) {
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  if (file.empty()) fail_in_file(name, "offset 0", "", "the file is empty");
  if (is_gzip(file) || text.starts_with("Bgeo")) return read_bgeo(file, name);
  if (text.starts_with("ply\n") || text.starts_with("ply\r")) return read_ply_particles(file, name);
  if (text.starts_with("# vtk DataFile")) return read_vtk(file, name);
  if (text.starts_with("LASF")) return read_las(file, name);
  if (is_pcd(file)) return read_pcd(file, name);
  for (const Foreign& foreign : foreign_formats) {
    if (text.starts_with(foreign.start)) fail_in_file(name, "offset 0", "format", foreign.advice);
  }
  if (looks_like_text(text)) return looks_like_obj(text) ? read_obj_particles(file, name) : read_xyz(file, name);
  fail_in_file(name, "offset 0", "format",
               fmt::format("starts with {}, which is no particle file that is read: BGEO (classic), PLY, PCD, LAS, "
                           "OBJ, legacy VTK, XYZ or CSV",
                           quoted(text.substr(0, 8))));
}

ParticleSet read_particles(const std::string& path) {
  try {
    return read_particles_from_memory(read_file_bytes(path), path);
  } catch (const std::bad_alloc&) {
    fail_in_file(path, "", "", "there is not enough memory for it");
  }
}

}  // namespace embrun

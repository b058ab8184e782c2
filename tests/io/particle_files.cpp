#include "io/particle_files.h"

#include <zlib.h>

#include <algorithm>
#include <cstdio>

#include "base/error.h"
#include "io/read_mesh.h"
#include "io/read_particles.h"

namespace embrun::test {

namespace {

// Nine digits give a float back exactly.
std::string exact(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", static_cast<double>(value));
  return text;
}

std::string value_text(const Attribute& a, std::size_t i) {
  return a.type == AttributeType::float32 ? exact(a.floats[i]) : std::to_string(a.ints[i]);
}

void put_value(FileBytes& file, const Attribute& a, std::size_t i) {
  if (a.type == AttributeType::float32) {
    file.number(a.floats[i]);
  } else {
    file.number(a.ints[i]);
  }
}

std::string component_name(const Attribute& a, int c) {
  if (a.components == 1) return a.name;
  if (a.name == "velocity") return std::string("v") + "xyz"[c];
  return a.name + "_" + std::to_string(c);
}

std::string ply_header(std::string_view format, std::string_view elements) {
  return "ply\nformat " + std::string(format) + " 1.0\ncomment made by a test\n" + std::string(elements) +
         "end_header\n";
}

const char* ply_format(PlyKind kind) {
  return kind == PlyKind::ascii           ? "ascii"
         : kind == PlyKind::little_endian ? "binary_little_endian"
                                          : "binary_big_endian";
}

}  // namespace

std::string gzipped(std::string_view file) {
  z_stream zlib{};
  deflateInit2(&zlib, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&zlib, file.size()) + 64, '\0');
  zlib.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(file.data()));
  zlib.avail_in = static_cast<uInt>(file.size());
  zlib.next_out = reinterpret_cast<Bytef*>(packed.data());
  zlib.avail_out = static_cast<uInt>(packed.size());
  deflate(&zlib, Z_FINISH);
  packed.resize(zlib.total_out);
  deflateEnd(&zlib);
  return packed;
}

FileBytes bgeo_header(std::int32_t points, std::int32_t point_attributes) {
  FileBytes file;
  file.text("BgeoV").number(std::int32_t{5}).number(points);
  for (int i = 0; i < 3; ++i) file.number(std::int32_t{0});
  file.number(point_attributes);
  for (int i = 0; i < 3; ++i) file.number(std::int32_t{0});
  return file;
}

std::string as_bgeo(const ParticleSet& set) {
  FileBytes file = bgeo_header(static_cast<std::int32_t>(set.size()), static_cast<std::int32_t>(set.attributes.size()));
  for (const Attribute& a : set.attributes) {
    file.number(static_cast<std::uint16_t>(a.name.size()))
        .text(a.name)
        .number(static_cast<std::uint16_t>(a.components));
    file.number(std::int32_t{a.type == AttributeType::float32 ? 0 : 1});
    for (int c = 0; c < a.components; ++c) file.number(std::int32_t{0});
  }
  for (std::size_t i = 0; i < set.size(); ++i) {
    const Vec3 p = to_float(set.positions[i]);
    file.number(p.x).number(p.y).number(p.z).number(1.0f);
    for (const Attribute& a : set.attributes) {
      const std::size_t components = static_cast<std::size_t>(a.components);
      for (std::size_t c = 0; c < components; ++c) put_value(file, a, i * components + c);
    }
  }
  return file.text(std::string_view("\0\xff", 2)).str();
}

std::string as_ply(const ParticleSet& set, PlyKind kind) {
  std::string elements = "element vertex " + std::to_string(set.size()) + "\n";
  elements += "property float x\nproperty float y\nproperty float z\n";
  for (const Attribute& a : set.attributes) {
    for (int c = 0; c < a.components; ++c) {
      elements += a.type == AttributeType::float32 ? "property float32 " : "property int ";
      elements += component_name(a, c) + "\n";
    }
  }
  FileBytes file(kind == PlyKind::big_endian);
  file.text(ply_header(ply_format(kind), elements));
  for (std::size_t i = 0; i < set.size(); ++i) {
    const Vec3 p = to_float(set.positions[i]);
    if (kind == PlyKind::ascii) {
      file.text(exact(p.x) + " " + exact(p.y) + " " + exact(p.z));
    } else {
      file.number(p.x).number(p.y).number(p.z);
    }
    for (const Attribute& a : set.attributes) {
      const std::size_t components = static_cast<std::size_t>(a.components);
      for (std::size_t c = i * components; c < (i + 1) * components; ++c) {
        if (kind == PlyKind::ascii) {
          file.text(" ").text(value_text(a, c));
        } else {
          put_value(file, a, c);
        }
      }
    }
    if (kind == PlyKind::ascii) file.text("\n");
  }
  return file.str();
}

std::string as_vtk(const ParticleSet& set, bool binary, std::string_view dataset) {
  const std::string n = std::to_string(set.size());
  FileBytes file;
  file.text("# vtk DataFile Version 4.1\nmade by a test\n").text(binary ? "BINARY" : "ASCII");
  file.text("\nDATASET " + std::string(dataset) + "\nPOINTS " + n + " float\n");
  const auto put = [&](auto value, const std::string& text) {
    if (binary) {
      file.number(value);
    } else {
      file.text(text + " ");
    }
  };
  for (const Vec3d point : set.positions) {
    const Vec3 p = to_float(point);
    for (const float x : {p.x, p.y, p.z}) put(x, exact(x));
  }
  file.text(dataset == "POLYDATA" ? "\nVERTICES " : "\nCELLS ").text(n + " " + std::to_string(2 * set.size()) + "\n");
  for (std::size_t i = 0; i < set.size(); ++i) {
    put(std::int32_t{1}, "1");
    put(static_cast<std::int32_t>(i), std::to_string(i));
  }
  if (dataset != "POLYDATA") {
    file.text("\nCELL_TYPES " + n + "\n");
    for (std::size_t i = 0; i < set.size(); ++i) put(std::int32_t{1}, "1");
  }
  file.text("\nPOINT_DATA " + n);
  // As SPlisHSPlasH writes it: the id as scalars, what else there is as a field.
  std::size_t fields = set.attributes.size();
  for (const Attribute& a : set.attributes) {
    if (a.type != AttributeType::int32) continue;
    --fields;
    file.text("\nSCALARS " + a.name + " unsigned_int 1\nLOOKUP_TABLE id_table\n");
    for (const std::int32_t value : a.ints) put(value, std::to_string(value));
  }
  file.text("\nFIELD FieldData " + std::to_string(fields));
  for (const Attribute& a : set.attributes) {
    if (a.type == AttributeType::int32) continue;
    file.text("\n" + a.name + " " + std::to_string(a.components) + " " + n + " float\n");
    for (const float value : a.floats) put(value, exact(value));
  }
  return file.text("\n").str();
}

std::string as_csv(const ParticleSet& set, char separator, bool header) {
  std::string file;
  if (header) {
    file = std::string("x") + separator + "y" + separator + "z";
    for (const Attribute& a : set.attributes) {
      for (int c = 0; c < a.components; ++c) file += separator + component_name(a, c);
    }
    file += "\n";
  }
  for (std::size_t i = 0; i < set.size(); ++i) {
    const Vec3 p = to_float(set.positions[i]);
    file += exact(p.x) + separator + exact(p.y) + separator + exact(p.z);
    for (const Attribute& a : set.attributes) {
      const std::size_t components = static_cast<std::size_t>(a.components);
      for (std::size_t c = 0; c < components; ++c) file += separator + value_text(a, i * components + c);
    }
    file += "\n";
  }
  return file;
}

ParticleSet some_particles(std::size_t count) {
  ParticleSet set = read_particles(EMBRUN_DATA_DIR "/dam_break.bgeo");
  std::vector<std::uint8_t> keep(set.size());
  std::fill(keep.begin(), keep.begin() + static_cast<std::ptrdiff_t>(count), std::uint8_t{1});
  keep_particles(set, keep);
  return set;
}

std::string tetrahedron_ply(PlyKind kind) {
  FileBytes file(kind == PlyKind::big_endian);
  file.text(ply_header(ply_format(kind),
                       "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                       "element face 4\nproperty uchar quality\nproperty list uchar int vertex_indices\n"));
  constexpr float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  constexpr std::int32_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  for (const auto& corner : corners) {
    for (const float x : corner) {
      if (kind == PlyKind::ascii) {
        file.text(exact(x) + " ");
      } else {
        file.number(x);
      }
    }
    if (kind == PlyKind::ascii) file.text("\n");
  }
  for (const auto& face : faces) {
    if (kind == PlyKind::ascii) {
      file.text("7 3 " + std::to_string(face[0]) + " " + std::to_string(face[1]) + " " + std::to_string(face[2]) +
                "\n");
    } else {
      file.number(std::uint8_t{7}).number(std::uint8_t{3}).number(face[0]).number(face[1]).number(face[2]);
    }
  }
  return file.str();
}

std::string tetrahedron_obj() {
  return "# a comment\nmtllib none.mtl\no tetrahedron\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
         "vn 0 0 -1\nvn 0 -2 0\nvn -1 0 0\nvn 1 1 1\nvt 0 0\nusemtl none\ns off\n"
         "f 1//1 3//1 2//1\nf 1/1/2 2/1/2 4/1/2\nf -4//-2 -1//-2 -2//-2\nf 2//4 3//4 \\\n4//4\n";
}

std::string particle_error(std::string_view file, std::string_view name) {
  try {
    read_particles_from_memory(as_bytes(file), name);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string mesh_error(std::string_view file, std::string_view name) {
  try {
    read_mesh_from_memory(as_bytes(file), name);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace embrun::test

#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "particles/particle_set.h"

namespace embrun {

// One reader per format, from a file in memory; `name` is what error messages call it. All throw Error for a file
// that is damaged or not of the format. None allocates more than a small multiple of the file's (unpacked) size.

/// Classic BGEO: "Bgeo", version 5, big-endian, plain or gzipped (as SPlisHSPlasH and Partio write). Attributes of
/// float, int, vector and indexed string; primitives, groups and what else follows the points are not looked at.
ParticleSet read_bgeo(std::span<const std::byte> file, std::string_view name);

/// PLY 1.0, ascii and binary of both byte orders: the element "vertex", wherever it stands. List properties are
/// skipped, with a note where they belong to the vertices.
ParticleSet read_ply_particles(std::span<const std::byte> file, std::string_view name);

/// Legacy VTK up to version 5.1, ASCII and BINARY: the points of POLYDATA, UNSTRUCTURED_GRID and STRUCTURED_GRID with
/// their POINT_DATA. Cells, cell data, text arrays and METADATA are skipped.
ParticleSet read_vtk(std::span<const std::byte> file, std::string_view name);

/// Text tables: a particle a line, separated by comma, semicolon (then a comma may be the decimal mark) or blanks;
/// '#', '//' and '%' start comment lines. A header names the columns; without one the first three are x, y, z, the
/// others column_4 and up, but for colours and normals that their values
/// give away (unnamed_columns.h). Also the chemists' XYZ: a count, a comment, then "element x y z". Columns of whole numbers
/// become integer attributes, columns of words become indices into a string table, empty fields count as missing.
ParticleSet read_xyz(std::span<const std::byte> file, std::string_view name);

/// PCD of the Point Cloud Library, versions 0.5 to 0.7: ascii, binary and binary_compressed. "rgb" and "rgba" are
/// unpacked to a colour; VIEWPOINT, where it is not the origin, becomes ParticleSet::sensor.
ParticleSet read_pcd(std::span<const std::byte> file, std::string_view name);

/// The vertices of a Wavefront OBJ file: their colours where all have one, and the normals where they are as many and
/// no face pairs them otherwise.
ParticleSet read_obj_particles(std::span<const std::byte> file, std::string_view name);

/// LAS 1.0 to 1.4, point formats 0 to 10, not packed: positions in double precision, intensity, returns,
/// classification and its flags, scan angle (degrees), user data, source, colours, near infrared; the GPS time in whole
/// nanoseconds as the integer attribute gps_time_ns. Extra bytes and wave packets are left out, with a note.
ParticleSet read_las(std::span<const std::byte> file, std::string_view name);

}  // namespace embrun

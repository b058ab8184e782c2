#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "io/column.h"
#include "io/obj_lines.h"
#include "io/particle_readers.h"
#include "io/text.h"

namespace embrun {

namespace {

Column real_column(const char* name, ScalarType type) {
  Column column;
  column.name = name;
  column.components = 3;
  column.type = type;
  return column;
}

class ObjVertexReader {
 public:
  ObjVertexReader(std::span<const std::byte> file, std::string_view name) : file_(file), lines_(file, name) {}

  ParticleSet read() {
    std::string_view keyword, line;
    while (lines_.next(keyword, line)) {
      if (keyword == "v") {
        read_vertex(line);
      } else if (keyword == "vn") {
        const Vec3d normal = lines_.take_vector(line, "vn");
        for (const double value : {normal.x, normal.y, normal.z}) normals_.doubles.push_back(value);
      } else if (keyword == "f") {
        compare_normals(line);
      }
    }
    const std::size_t count = positions_.doubles.size() / 3;
    if (count == 0) lines_.cursor().fail("", no_particles);
    std::vector<std::string> notes;
    std::vector<Column> columns{std::move(positions_)};
    add_colours(count, columns, notes);
    add_normals(count, columns, notes);
    const auto file = file_;
    const std::string name = lines_.cursor().file();
    ParticleSet set = particles_from_columns(name, count, std::move(columns), [file, name](std::size_t row) {
      ObjLines lines(file, name);
      std::string_view word, rest;
      for (std::size_t vertices = 0; vertices <= row && lines.next(word, rest);) vertices += word == "v";
      return lines.cursor().place();
    });
    set.format = "OBJ vertices";
    set.notes.insert(set.notes.end(), notes.begin(), notes.end());
    return set;
  }

 private:
  std::span<const std::byte> file_;
  ObjLines lines_;
  Column positions_ = real_column("position", ScalarType::float64);
  Column normals_ = real_column("normal", ScalarType::float64);
  Column colours_ = real_column("color", ScalarType::float64);
  bool normals_of_corners_ = false;

  // After the coordinates: nothing, a weight, a colour, or a colour and its opacity.
  void read_vertex(std::string_view line) {
    const Vec3d p = lines_.take_vector(line, "v");
    for (const double value : {p.x, p.y, p.z}) positions_.doubles.push_back(value);
    std::array<double, 4> more{};
    std::size_t count = 0;
    for (std::string_view token = take_token(line); !token.empty(); token = take_token(line)) {
      if (token.starts_with('#')) break;
      const std::optional<double> number = parse_double(token);
      if (!number) lines_.cursor().fail("v", fmt::format("{} is not a number", quoted(token)));
      if (count == more.size()) lines_.cursor().fail("v", "there are more than seven numbers");
      more[count++] = *number;
    }
    if (count == 2) lines_.cursor().fail("v", "there are five numbers: not a weight, not a colour");
    if (count >= 3) colours_.doubles.insert(colours_.doubles.end(), more.begin(), more.begin() + 3);
  }

  // A face that pairs vertex and normal of different numbers says that the lists do not run side by side.
  void compare_normals(std::string_view line) {
    for (std::string_view corner = take_token(line); !corner.empty(); corner = take_token(line)) {
      const std::size_t first = corner.find('/'), last = corner.rfind('/');
      if (first == last || last + 1 == corner.size()) continue;
      if (corner.substr(0, first) != corner.substr(last + 1)) normals_of_corners_ = true;
    }
  }

  void add_colours(std::size_t count, std::vector<Column>& columns, std::vector<std::string>& notes) {
    if (colours_.doubles.empty()) return;
    if (colours_.doubles.size() != 3 * count) {
      notes.push_back(
          fmt::format("colours were left out: {} of {} vertices have one", colours_.doubles.size() / 3, count));
      return;
    }
    // From 0 to 1; some programs write bytes.
    const auto greatest = *std::max_element(colours_.doubles.begin(), colours_.doubles.end());
    if (greatest > 1 && greatest <= 255) {
      for (double& value : colours_.doubles) value /= 255;
    }
    columns.push_back(std::move(colours_));
  }

  void add_normals(std::size_t count, std::vector<Column>& columns, std::vector<std::string>& notes) {
    if (normals_.doubles.empty()) return;
    if (normals_.doubles.size() == 3 * count && !normals_of_corners_) {
      columns.push_back(std::move(normals_));
      return;
    }
    notes.push_back(normals_of_corners_ ? std::string("normals were left out: they belong to the corners of faces")
                                        : fmt::format("normals were left out: {} of them for {} vertices",
                                                      normals_.doubles.size() / 3, count));
  }
};

}  // namespace

ParticleSet read_obj_particles(std::span<const std::byte> file, std::string_view name) {
  return ObjVertexReader(file, name).read();
}

}  // namespace embrun

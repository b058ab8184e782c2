#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "io/read_scene.h"

namespace embrun::test {

/// The files of a test, by path.
using Files = std::map<std::string, std::string>;

inline ReadFileBytes reader_of(const Files& files) {
  return [&files](const std::string& path) {
    const auto file = files.find(path);
    if (file == files.end()) throw Error(path + ": cannot open");
    const auto* first = reinterpret_cast<const std::byte*>(file->second.data());
    return std::vector<std::byte>(first, first + file->second.size());
  };
}

/// A square in the plane z = 0.
inline const char* square_ply =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n3 0 1 2\n3 0 2 3\n";

inline SceneFile read_file(const Files& files, const std::vector<SceneParameter>& parameters = {}) {
  return read_scene("/scenes/scene.xml", parameters, reader_of(files));
}

/// A scene that holds the elements, and a camera unless there is one among them.
inline std::string whole(const std::string& elements) {
  const bool has_camera = elements.find("<sensor") != std::string::npos;
  return "<scene version=\"3.0.0\">\n" + elements + (has_camera ? "" : "\n<sensor type=\"perspective\"/>") +
         "\n</scene>\n";
}

inline SceneFile read_elements(const std::string& elements, const std::vector<SceneParameter>& parameters = {}) {
  return read_file({{"/scenes/scene.xml", whole(elements)}, {"/scenes/square.ply", square_ply}}, parameters);
}
inline SceneDescription scene_of(const std::string& elements) { return read_elements(elements).scene; }

/// The error that reading the elements ends in.
inline std::string error_of(const std::string& elements, const std::vector<SceneParameter>& parameters = {}) {
  try {
    read_elements(elements, parameters);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

inline void expect_near(Vec3d a, Vec3d b, double tolerance = 1e-12) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

inline void expect_near(Rgb a, Rgb b, float tolerance = 1e-6f) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance) << c;
}

}  // namespace embrun::test

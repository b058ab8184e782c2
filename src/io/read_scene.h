#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "scene/scene_description.h"

namespace embrun {

/// A value for `$name` in a scene file.
struct SceneParameter {
  std::string name, value;
};

struct SceneFile {
  SceneDescription scene;
  std::vector<std::string> warnings;  ///< what was read and has no effect, a located sentence each
};

/// How a file's bytes are had: read_file_bytes, unless a test says otherwise. Throws Error.
using ReadFileBytes = std::function<std::vector<std::byte>(const std::string& path)>;

/// Reads a scene in the subset of Mitsuba 3's XML that docs/scene-files.md describes, with the particles, meshes and
/// pictures that it names; their paths are relative to the file. Throws Error, naming the file, the line and the
/// element, for whatever it does not understand. The scene is not validated: compile() does that.
SceneFile read_scene(const std::string& path, const std::vector<SceneParameter>& parameters = {});
SceneFile read_scene(const std::string& path, const std::vector<SceneParameter>& parameters,
                     const ReadFileBytes& read_bytes);

/// The scene as a file that read_scene() makes the same description of. Files are named by absolute paths. Throws Error
/// for particles, meshes and pictures that are not from a file.
std::string write_scene(const SceneDescription& scene);

}  // namespace embrun

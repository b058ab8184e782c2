#include <cstring>

#include "fuzz_reader.h"
#include "io/read_scene.h"

namespace {

using namespace embrun;

/// A grid of 2 x 1 x 1 cells.
constexpr std::string_view grid(
    "VOL\x03\x01\0\0\0\x02\0\0\0\x01\0\0\0\x01\0\0\0\x01\0\0\0"
    "\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\x80\x3f\0\0\x80\x3f"
    "\0\0\x80\x3f\0\0\0\x3f",
    56);

/// The files that a scene may name: itself by any *.xml (so that includes never end), a mesh, particles and a grid.
std::vector<std::byte> file(const std::string& path, std::string_view scene) {
  constexpr std::string_view mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
  constexpr std::string_view particles = "x,y,z,density\n0,0,0,1\n1,0,0,2\n0,1,0,3\n";
  const std::string_view content = path.ends_with(".xml")   ? scene
                                   : path.ends_with(".obj") ? mesh
                                   : path.ends_with(".csv") ? particles
                                   : path.ends_with(".vol") ? grid
                                                            : throw Error(path + ": cannot open");
  std::vector<std::byte> bytes(content.size());
  if (!content.empty()) std::memcpy(bytes.data(), content.data(), content.size());
  return bytes;
}

/// What was read must be written, and read the same again.
void check_round_trip(const SceneDescription& scene) {
  const std::string text = write_scene(scene);
  const SceneFile again = read_scene("input.xml", {}, [&](const std::string& path) { return file(path, text); });
  fuzz::require(write_scene(again.scene) == text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  SceneFile read;
  try {
    read = read_scene("input.xml", {{"p", "0.5"}}, [&](const std::string& path) { return file(path, text); });
  } catch (const Error& error) {
    fuzz::require(!std::string_view(error.what()).empty());
    return 0;
  }
  check_round_trip(read.scene);
  return 0;
}

// A stranger's program: renders a lattice of particles in memory through the installed library.
#include <embrun/embrun.h>

#include <cmath>
#include <cstdio>
#include <exception>

namespace {

embrun::Particles cube_of_particles() {
  embrun::Particles particles;
  for (int z = 0; z < 4; ++z) {
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 4; ++x) particles.positions.push_back({0.05 * x, 0.05 * y, 0.05 * z});
    }
  }
  particles.radii.assign(particles.positions.size(), 0.025f);
  return particles;
}

/// Nothing but sky of radiance 1 is seen past the water, so that is what the corner of the picture must show.
bool corner_is_white(const embrun::Picture& picture) {
  for (const embrun::Layer& layer : picture.layers) {
    if (layer.name == "beauty") return std::fabs(layer.values.at(0) - 1.0f) < 1e-5f;
  }
  return false;
}

/// A mistake ends in an exception that crosses from the library to its user.
bool mistake_is_reported(embrun::RenderOptions options) {
  options.kernel = "no such kernel";
  try {
    embrun::check_options(options);
  } catch (const std::exception&) {
    return true;
  }
  return false;
}

}  // namespace

int main() {
  embrun::RenderOptions options;
  options.width = options.height = 16;
  options.samples = 1;
  options.environment = "white";
  options.floor = "none";
  const embrun::Picture picture = embrun::render(cube_of_particles(), options);
  const bool good = corner_is_white(picture) && mistake_is_reported(options);
  std::printf("embrun %s: %s\n", embrun::version(), good ? "good" : "WRONG");
  return good ? 0 : 1;
}

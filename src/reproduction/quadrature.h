#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "embrun/reproduce.h"
#include "image/image.h"
#include "scene/scene_description.h"

namespace embrun {

/// The Cornell box of data/cornell_bunny.xml, with splats in the place of the bunny, in a square picture. The splats become
/// white as there, and are placed already.
SceneDescription cornell_box(SplatsDescription splats, int side);

/// Mean squared errors of pictures, over pixels and channels, and of the means of blocks of 8 x 8 pixels: what is wrong alike
/// in neighbours does not average out in them.
struct PictureErrors {
  double pixel = 0, block = 0;
};

/// The errors of pictures `a` and `b` against what two references of independent noise stand for: the mean of
/// (a - first) (b - second). With a == b that is the picture's mean squared error, in which the references' noise does not
/// count. With pictures whose noise is independent as well it is the error that they share. It may come out a little
/// below 0 where that is 0.
PictureErrors product_errors(const Image& a, const Image& b, const Image& first, const Image& second);

/// Renders the box by path tracing and by Gauss's quadrature, writes pictures into the folder, and says which errs by how much
/// beside what the thesis says of its attempt [Beddiaf2018], section 3.3: a section in Markdown. With the bunny of that scan,
/// or with the sphere of splats where `scan` is empty. None when it was cancelled. Throws Error where a file cannot be read or
/// written.
std::optional<std::string> compare_quadrature(const ReproduceSplatsOptions& options, const std::string& scan,
                                              const ReproduceHooks& hooks);

}  // namespace embrun

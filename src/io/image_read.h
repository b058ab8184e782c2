#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "image/image.h"

namespace embrun {

/// What the numbers of PNG and JPEG files mean: colours encoded for sRGB, or anything else, to be left as it is (in [0, 1]).
enum class PixelEncoding : std::uint8_t { srgb, raw };

/// Reads a picture as linear values with 1 or 3 channels; the format is told by the content: OpenEXR (scan lines or
/// tiles, half, float or uint), Radiance HDR, PFM, PNG (8 or 16 bits) and JPEG, both by `encoding`. Alpha is
/// dropped (PNG: composited on black). Of an EXR the layer `layer` is read; empty: R G B, or Y, without a layer.
/// Throws Error, with the file and what is wrong with it, for anything it cannot read whole; pictures above 2^28
/// pixels, or of a size that the file's length cannot justify, are refused before memory is taken.
Image read_image(const std::filesystem::path& path, const std::string& layer = {},
                 PixelEncoding encoding = PixelEncoding::srgb);

/// The same from memory; `name` stands for the file in messages.
Image read_image(std::span<const std::byte> bytes, const std::string& name, const std::string& layer = {},
                 PixelEncoding encoding = PixelEncoding::srgb);

/// All layers of an EXR file, as write_image() wrote them: the channels without a prefix become "beauty", each
/// prefix up to the last dot a layer of that name. `metadata`, if not null, gets the "embrun:" attributes.
ImageLayers read_exr_layers(const std::filesystem::path& path, ImageMetadata* metadata = nullptr);
ImageLayers read_exr_layers(std::span<const std::byte> bytes, const std::string& name,
                            ImageMetadata* metadata = nullptr);

/// A picture as light from all round: three channels, none above 1e20, so that sums over the picture stay finite.
Image as_environment(const Image& picture);

/// What clean_environment() found.
struct EnvironmentRepair {
  std::size_t not_finite = 0;  ///< pixels with a NaN or infinite channel
  std::size_t negative = 0;    ///< pixels with a negative channel
};

/// Makes a picture fit for use as a light: channels that are NaN, infinite or negative become 0, and are counted by
/// pixel, so that the caller can say so.
EnvironmentRepair clean_environment(Image& image);

}  // namespace embrun

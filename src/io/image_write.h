#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "image/image.h"
#include "image/tone_curve.h"

namespace embrun {

enum class ImageFormat { exr, pfm, hdr, png };

/// The format that the file's extension names (.exr .pfm .hdr .png, any case); throws Error that lists them.
ImageFormat image_format_of(const std::filesystem::path& path);

/// Throws Error when a picture could not be written there: unknown extension, a folder that is missing or cannot be
/// written to. Call it before the render starts.
void check_image_output(const std::filesystem::path& path);

/// Throws Error that lists the names when no film layer (film_layer_names) is called so. Before the render starts.
void check_layer_name(const std::string& name);

struct ImageWriteOptions {
  std::string layer = "beauty";  ///< what a single-layer format (PFM, HDR, PNG) gets
  ToneSettings tone = {};        ///< PNG only
  bool half = false;             ///< EXR: beauty, albedo and normal as 16-bit half floats (values clamped to 65504)
};

/// Writes a picture in the format of the path's extension, through a temporary file (write_file_atomically).
/// - EXR holds every layer: R G B, albedo.R .., normal.X .., depth.Z, samples.N, variance.R ..; ZIP-compressed; the
///   crop is the data window; metadata as string attributes named "embrun:KEY".
/// - PFM: one layer, 32-bit floats, little endian, rows from the bottom; one channel as Pf. Holds no metadata.
/// - HDR: one layer as Radiance RGBE (steps of 1/256 of the largest channel or finer), run-length encoded; values
///   above 1.69e38 are clamped, negative ones 0; a normal is stored as 0.5 + 0.5 n, an infinite depth as 0; metadata
///   as header comments.
/// - PNG: one layer as to_display() maps it, 8 bits, marked sRGB (beauty, albedo, variance); metadata as text chunks.
/// PFM, HDR and PNG hold the crop alone. Throws Error when the layer is missing or the file cannot be written.
void write_image(const std::filesystem::path& path, const ImageLayers& picture, const ImageWriteOptions& options = {},
                 const ImageMetadata& metadata = {});

/// The same for one image without layers (PFM, HDR, EXR, PNG).
void write_image(const std::filesystem::path& path, const Image& image, const ImageWriteOptions& options = {},
                 const ImageMetadata& metadata = {});

/// The bytes that write_image() would write.
std::vector<std::byte> encode_image(ImageFormat format, const ImageLayers& picture,
                                    const ImageWriteOptions& options = {}, const ImageMetadata& metadata = {});

}  // namespace embrun

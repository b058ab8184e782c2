#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "image/image.h"
#include "image/tone_curve.h"
#include "io/image_read.h"

/// The image formats one by one, on bytes in memory: what image_read.cpp and image_write.cpp choose from.
namespace embrun {

using Bytes = std::span<const std::byte>;

/// Throws Error: "FILE: WHAT".
[[noreturn]] void fail_image(const std::string& file, const std::string& what);

/// Throws Error unless both sides are at least 1, the pixels at most 2^28 and, where a format cannot pack more than
/// `pixels_per_byte` pixels into a byte, not more than the file's length allows.
void check_image_size(std::int64_t width, std::int64_t height, std::size_t file_size, double pixels_per_byte,
                      const std::string& file);

// Readers: linear values, 1 or 3 channels, or Error.
Image decode_exr(Bytes bytes, const std::string& file, const std::string& layer);
ImageLayers decode_exr_layers(Bytes bytes, const std::string& file, ImageMetadata* metadata);
Image decode_hdr(Bytes bytes, const std::string& file);
Image decode_pfm(Bytes bytes, const std::string& file);
Image decode_png(Bytes bytes, const std::string& file, PixelEncoding encoding = PixelEncoding::srgb);
Image decode_jpeg(Bytes bytes, const std::string& file, PixelEncoding encoding = PixelEncoding::srgb);

// Writers. encode_hdr and encode_pfm take 1 or 3 channels.
std::vector<std::byte> encode_exr(const ImageLayers& picture, bool half, const ImageMetadata& metadata);
std::vector<std::byte> encode_hdr(const Image& image, const ImageMetadata& metadata);
std::vector<std::byte> encode_pfm(const Image& image);
/// `srgb`: the values are sRGB-encoded, and the file says so.
std::vector<std::byte> encode_png(const DisplayImage& image, bool srgb, const ImageMetadata& metadata);

}  // namespace embrun

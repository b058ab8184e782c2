#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstring>

#include "base/error.h"
#include "io/image_formats.h"

namespace embrun {
namespace {

/// Everything that the writing below needs, made beforehand: a jump out of libpng must not skip a destructor.
struct PngJob {
  const DisplayImage* image = nullptr;
  bool srgb = false;
  std::vector<png_text> texts;
  std::vector<std::byte> out;
  char error[128] = "";
};

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  auto* job = static_cast<PngJob*>(png_get_error_ptr(png));
  std::strncpy(job->error, message, sizeof job->error - 1);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

void on_write(png_structp png, png_bytep data, size_t size) {
  auto* job = static_cast<PngJob*>(png_get_io_ptr(png));
  bool full = false;
  try {
    const auto* first = reinterpret_cast<const std::byte*>(data);
    job->out.insert(job->out.end(), first, first + size);
  } catch (const std::bad_alloc&) {
    full = true;
  }
  if (full) {
    png_error(png, "not enough memory");
  }
}

/// Writes the whole file to job.out; false, with job.error set, when libpng gives up. Holds nothing with a destructor.
bool write_png(PngJob& job) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info == nullptr) {
    png_destroy_write_struct(&png, nullptr);
    return false;
  }
  if (setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &job, on_write, nullptr);
  const DisplayImage& image = *job.image;
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height), 8,
               image.channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (job.srgb) {
    png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  }
  png_set_text(png, info, job.texts.data(), static_cast<int>(job.texts.size()));
  png_write_info(png, info);
  const std::size_t stride = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels);
  for (int y = 0; y < image.height; ++y) {
    png_write_row(png, image.pixels.data() + static_cast<std::size_t>(y) * stride);
  }
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return true;
}

/// Frees what png_image_begin_read took, on every way out.
struct PngImage {
  png_image image{};
  PngImage() { image.version = PNG_IMAGE_VERSION; }
  PngImage(const PngImage&) = delete;
  PngImage& operator=(const PngImage&) = delete;
  ~PngImage() { png_image_free(&image); }
};

bool is_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

}  // namespace

std::vector<std::byte> encode_png(const DisplayImage& image, bool srgb, const ImageMetadata& metadata) {
  EMBRUN_CHECK(image.channels == 1 || image.channels == 3);
  constexpr std::size_t longest_keyword = 79;
  ImageMetadata entries;
  for (const auto& [key, value] : metadata) {
    entries.emplace_back(("embrun:" + key).substr(0, longest_keyword), value);
  }
  if (!image.note.empty()) {
    entries.emplace_back("embrun:mapping", image.note);
  }
  PngJob job;
  job.image = &image;
  job.srgb = srgb;
  for (auto& [key, value] : entries) {
    png_text text{};
    // Plain text chunks hold Latin-1 alone; international ones UTF-8.
    text.compression = is_ascii(value) ? PNG_TEXT_COMPRESSION_NONE : PNG_ITXT_COMPRESSION_NONE;
    text.key = key.data();
    text.text = value.data();
    (text.compression == PNG_TEXT_COMPRESSION_NONE ? text.text_length : text.itxt_length) = value.size();
    job.texts.push_back(text);
  }
  if (!write_png(job)) {
    throw Error(std::string("cannot encode a PNG: ") + (job.error[0] != '\0' ? job.error : "not enough memory"));
  }
  return std::move(job.out);
}

Image decode_png(Bytes bytes, const std::string& file) {
  PngImage png;
  if (png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()) == 0) {
    fail_image(file, std::string("bad PNG file: ") + png.image.message);
  }
  // Deflate packs at most 1032 bytes into one; a pixel has at least one bit.
  check_image_size(png.image.width, png.image.height, bytes.size(), 8 * 1032.0, file);
  const bool wide = (png.image.format & PNG_FORMAT_FLAG_LINEAR) != 0;  // 16 bits
  const bool colour = (png.image.format & PNG_FORMAT_FLAG_COLOR) != 0;
  png.image.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
  png.image.format = (wide ? PNG_FORMAT_FLAG_LINEAR : 0u) | (colour ? PNG_FORMAT_FLAG_COLOR : 0u);
  std::vector<std::uint16_t> words;
  std::vector<std::uint8_t> octets;
  const std::size_t values =
      static_cast<std::size_t>(png.image.width) * png.image.height * static_cast<std::size_t>(colour ? 3 : 1);
  void* target = nullptr;
  if (wide) {
    words.resize(values);
    target = words.data();
  } else {
    octets.resize(values);
    target = octets.data();
  }
  const png_color black{0, 0, 0};
  if (png_image_finish_read(&png.image, &black, target, 0, nullptr) == 0) {
    fail_image(file, std::string("bad PNG file: ") + png.image.message);
  }

  Image image = make_image(static_cast<int>(png.image.width), static_cast<int>(png.image.height), colour ? 3 : 1);
  float decoded[256];
  for (int i = 0; i < 256; ++i) {
    decoded[i] = srgb_decode(static_cast<float>(i) / 255.0f);
  }
  for (std::size_t i = 0; i < values; ++i) {
    image.pixels[i] = wide ? static_cast<float>(words[i]) / 65535.0f : decoded[octets[i]];
  }
  return image;
}

}  // namespace embrun

#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstring>

#include "base/error.h"
#include "io/image_formats.h"

namespace embrun {
namespace {

// libpng reports errors by a jump, which must not skip a destructor: what the functions with setjmp need is made
// before they are called, and lies in one of these.

struct PngErrors {
  char message[128] = "";
};

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  auto* errors = static_cast<PngErrors*>(png_get_error_ptr(png));
  std::strncpy(errors->message, message, sizeof errors->message - 1);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

// --- writing ---

struct WriteJob {
  const DisplayImage* image = nullptr;
  bool srgb = false;
  std::vector<png_text> texts;
  std::vector<std::byte> out;
  PngErrors errors;
};

void on_write(png_structp png, png_bytep data, size_t size) {
  auto* job = static_cast<WriteJob*>(png_get_io_ptr(png));
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

/// Writes the whole file to job.out; false when libpng gives up.
bool write_png(WriteJob& job) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &job.errors, on_error, on_warning);
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

bool is_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

// --- reading ---

/// A file being read. The header is read first, so that its sizes can be checked before memory is taken.
struct ReadJob {
  Bytes bytes;
  std::size_t position = 0;
  png_structp png = nullptr;
  png_infop info = nullptr;
  int passes = 1;
  PngErrors errors;

  explicit ReadJob(Bytes b) : bytes(b) {}
  ReadJob(const ReadJob&) = delete;
  ReadJob& operator=(const ReadJob&) = delete;
  ~ReadJob() { png_destroy_read_struct(&png, &info, nullptr); }
};

void on_read(png_structp png, png_bytep data, size_t size) {
  auto* job = static_cast<ReadJob*>(png_get_io_ptr(png));
  if (size > job->bytes.size() - job->position) {
    png_error(png, "the file ends early");
  }
  std::memcpy(data, job->bytes.data() + job->position, size);
  job->position += size;
}

/// Reads up to the pixels, and asks for grey or RGB of 8 or 16 bits, with alpha where the file has any.
bool read_header(ReadJob& job) {
  job.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &job.errors, on_error, on_warning);
  job.info = job.png != nullptr ? png_create_info_struct(job.png) : nullptr;
  if (job.info == nullptr || setjmp(png_jmpbuf(job.png)) != 0) {
    return false;
  }
  // Texts, profiles and the like are skipped: libpng would take the memory that their stated lengths ask for.
  png_set_keep_unknown_chunks(job.png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  png_set_read_fn(job.png, &job, on_read);
  png_read_info(job.png, job.info);
  png_set_expand(job.png);
  return true;
}

/// Settles how the rows will be once expanded.
bool prepare_rows(ReadJob& job) {
  if (setjmp(png_jmpbuf(job.png)) != 0) {
    return false;
  }
  job.passes = png_set_interlace_handling(job.png);
  png_read_update_info(job.png, job.info);
  return true;
}

/// Reads all rows into `pixels`, and the rest of the file.
bool read_rows(ReadJob& job, png_bytep pixels) {
  if (setjmp(png_jmpbuf(job.png)) != 0) {
    return false;
  }
  const std::size_t stride = png_get_rowbytes(job.png, job.info);
  const png_uint_32 height = png_get_image_height(job.png, job.info);
  for (int pass = 0; pass < job.passes; ++pass) {
    for (png_uint_32 y = 0; y < height; ++y) {
      png_read_row(job.png, pixels + y * stride, nullptr);
    }
  }
  png_read_end(job.png, nullptr);
  return true;
}

[[noreturn]] void fail_png(const std::string& file, const ReadJob& job) {
  fail_image(
      file, std::string("bad PNG file: ") + (job.errors.message[0] != '\0' ? job.errors.message : "not enough memory"));
}

/// Samples of 8 or 16 bits (big endian), 1 to 4 channels, to grey or RGB over black.
Image to_linear(const std::vector<std::uint8_t>& raw, int width, int height, std::size_t channels, bool wide,
                PixelEncoding encoding) {
  const bool has_alpha = channels % 2 == 0;
  const std::size_t colours = has_alpha ? channels - 1 : channels;
  Image image = make_image(width, height, static_cast<int>(colours));
  const auto decode = [&](float v) { return encoding == PixelEncoding::srgb ? srgb_decode(v) : v; };
  float decoded[256];
  for (int i = 0; i < 256; ++i) {
    decoded[i] = decode(static_cast<float>(i) / 255.0f);
  }
  const auto value = [&](std::size_t i) {
    return wide ? static_cast<float>(raw[2 * i] << 8 | raw[2 * i + 1]) / 65535.0f : static_cast<float>(raw[i]) / 255.0f;
  };
  for (std::size_t p = 0; p < image.pixel_count(); ++p) {
    const float alpha = has_alpha ? value(p * channels + colours) : 1.0f;
    for (std::size_t c = 0; c < colours; ++c) {
      const std::size_t i = p * channels + c;
      image.pixels[p * colours + c] = alpha * (wide ? decode(value(i)) : decoded[raw[i]]);
    }
  }
  return image;
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
  WriteJob job;
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
    throw Error(std::string("cannot encode a PNG: ") +
                (job.errors.message[0] != '\0' ? job.errors.message : "not enough memory"));
  }
  return std::move(job.out);
}

Image decode_png(Bytes bytes, const std::string& file, PixelEncoding encoding) {
  ReadJob job(bytes);
  if (!read_header(job)) {
    fail_png(file, job);
  }
  const png_uint_32 width = png_get_image_width(job.png, job.info);
  const png_uint_32 height = png_get_image_height(job.png, job.info);
  // Deflate packs at most 1032 bytes into one. Pixels of less than a byte count as one: nobody needs huge empty masks.
  const int bits = png_get_bit_depth(job.png, job.info) * png_get_channels(job.png, job.info);
  check_image_size(width, height, bytes.size(), 8 * 1032.0 / std::max(bits, 8), file);
  if (!prepare_rows(job)) {
    fail_png(file, job);
  }
  std::vector<std::uint8_t> raw(png_get_rowbytes(job.png, job.info) * height);
  if (!read_rows(job, raw.data())) {
    fail_png(file, job);
  }
  const bool wide = png_get_bit_depth(job.png, job.info) == 16;
  return to_linear(raw, static_cast<int>(width), static_cast<int>(height), png_get_channels(job.png, job.info), wide,
                   encoding);
}

}  // namespace embrun

#include <csetjmp>
#include <cstdio>
#include <cstring>

// clang-format off: this header needs <cstdio> before it
#include <jpeglib.h>
// clang-format on

#include "io/image_formats.h"

namespace embrun {
namespace {

/// libjpeg's state, and where to go on an error: libjpeg calls, the jump comes back into the function that set it.
struct JpegJob {
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  jpeg_decompress_struct decoder{};
  jmp_buf jump;
  std::size_t file_size = 0;
  char message[JMSG_LENGTH_MAX] = "";
};

[[noreturn]] void on_error(j_common_ptr common) {
  auto* job = static_cast<JpegJob*>(common->client_data);
  common->err->format_message(common, job->message);
  std::longjmp(job->jump, 1);
}

/// Warnings (level -1) mean damaged data, which libjpeg would fill up with grey; they end the reading.
void on_message(j_common_ptr common, int level) {
  if (level < 0) {
    on_error(common);
  }
}

/// A small file can hold thousands of scans over a large picture, each of which takes time; real ones have about ten,
/// and far more bytes a pixel.
void on_progress(j_common_ptr common) {
  constexpr double most_scans = 100, most_pixels_per_byte = 16384;
  auto* job = static_cast<JpegJob*>(common->client_data);
  const double scans = job->decoder.input_scan_number;
  const double pixels = static_cast<double>(job->decoder.image_width) * job->decoder.image_height;
  if (scans > most_scans || scans * pixels > most_pixels_per_byte * static_cast<double>(job->file_size)) {
    std::strcpy(job->message, "too many scans");
    std::longjmp(job->jump, 1);
  }
}

/// Reads the header; false with a message. Holds nothing with a destructor, as the next.
bool start(JpegJob& job, Bytes bytes) {
  job.decoder.err = jpeg_std_error(&job.errors);
  job.errors.error_exit = on_error;
  job.errors.emit_message = on_message;
  job.decoder.client_data = &job;
  if (setjmp(job.jump) != 0) {
    return false;
  }
  jpeg_create_decompress(&job.decoder);
  job.decoder.client_data = &job;
  job.file_size = bytes.size();
  job.progress.progress_monitor = on_progress;
  job.decoder.progress = &job.progress;
  jpeg_mem_src(&job.decoder, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  (void)jpeg_read_header(&job.decoder, TRUE);
  return true;
}

/// Decodes all rows into `pixels` (width * height * components bytes).
bool read_rows(JpegJob& job, std::uint8_t* pixels) {
  if (setjmp(job.jump) != 0) {
    return false;
  }
  job.decoder.out_color_space = job.decoder.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
  (void)jpeg_start_decompress(&job.decoder);
  const std::size_t stride =
      static_cast<std::size_t>(job.decoder.output_width) * static_cast<std::size_t>(job.decoder.output_components);
  while (job.decoder.output_scanline < job.decoder.output_height) {
    JSAMPROW row = pixels + stride * job.decoder.output_scanline;
    (void)jpeg_read_scanlines(&job.decoder, &row, 1);
  }
  (void)jpeg_finish_decompress(&job.decoder);
  return true;
}

struct JpegGuard {
  JpegJob& job;
  ~JpegGuard() { jpeg_destroy_decompress(&job.decoder); }
};

}  // namespace

Image decode_jpeg(Bytes bytes, const std::string& file, PixelEncoding encoding) {
  JpegJob job;
  const JpegGuard guard{job};
  if (!start(job, bytes)) {
    fail_image(file, std::string("bad JPEG file: ") + job.message);
  }
  // Even a flat picture takes a bit for each block of 8x8.
  check_image_size(job.decoder.image_width, job.decoder.image_height, bytes.size(), 1024, file);
  if (job.decoder.num_components != 1 && job.decoder.num_components != 3) {
    fail_image(file, "a JPEG file with " + std::to_string(job.decoder.num_components) +
                         " components; only grey and colour (1 and 3) are read");
  }
  const int channels = job.decoder.num_components;
  Image image =
      make_image(static_cast<int>(job.decoder.image_width), static_cast<int>(job.decoder.image_height), channels);
  std::vector<std::uint8_t> pixels(image.pixels.size());
  if (!read_rows(job, pixels.data())) {
    fail_image(file, std::string("bad JPEG file: ") + job.message);
  }
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const float value = static_cast<float>(pixels[i]) / 255.0f;
    image.pixels[i] = encoding == PixelEncoding::srgb ? srgb_decode(value) : value;
  }
  return image;
}

}  // namespace embrun

// Damaged pictures of every format: each ends in an Error or in a picture of a sane size, never in a crash, a hang or
// memory that the file cannot justify (the sanitised builds watch).
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "base/error.h"
#include "image/film.h"
#include "image/scratch_folder.h"
#include "io/image_read.h"
#include "io/image_write.h"

namespace embrun {
namespace {

struct Seed {
  std::string name;
  std::vector<std::byte> bytes;
};

std::vector<std::byte> bytes_of(const std::string& text) {
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

/// The fixtures, and what our own writers make of a small picture.
std::vector<Seed> seeds() {
  std::vector<Seed> result;
  const std::filesystem::path folder = std::filesystem::path(EMBRUN_TEST_DATA_DIR) / "images";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".md") {
      result.push_back({entry.path().filename().string(), bytes_of(content_of(entry.path()))});
    }
  }
  Film film = make_film(12, 4, {1, 1, 9, 3});
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    FilmSample s;
    s.radiance = grey(static_cast<float>(i / 5));
    add_sample(film, i, s);
  }
  const ImageLayers picture = resolve(film);
  result.push_back({"own.exr", encode_image(ImageFormat::exr, picture, {}, {{"seed", "1"}})});
  result.push_back({"own.hdr", encode_image(ImageFormat::hdr, picture)});
  result.push_back({"own.pfm", encode_image(ImageFormat::pfm, picture)});
  result.push_back({"own.png", encode_image(ImageFormat::png, picture)});
  const std::string old_runs("\x80\x40\x00\x81\x01\x01\x01\x04\x00\x00\x80\x82\x01\x01\x01\x02", 16);
  result.push_back({"old.hdr", bytes_of("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 1 +X 8\n" + old_runs)});
  return result;
}

/// True when the bytes were read, false when there was an Error.
bool survives(const std::vector<std::byte>& bytes, Image* image = nullptr) {
  try {
    const Image read = read_image(bytes, "hostile");
    EXPECT_EQ(read.pixels.size(), read.pixel_count() * static_cast<std::size_t>(read.channels));
    EXPECT_TRUE(read.channels == 1 || read.channels == 3);
    EXPECT_LE(read.pixel_count(), std::size_t{1} << 24);  // the seeds are tiny
    if (image != nullptr) {
      *image = read;
    }
    return true;
  } catch (const Error& e) {
    EXPECT_TRUE(std::string(e.what()).starts_with("hostile: ")) << e.what();
    return false;
  }
}

/// Fails when the process took much more memory in its scope than tiny files justify.
class MemoryWatch {
 public:
  MemoryWatch() : before_(peak_megabytes()) {}
  MemoryWatch(const MemoryWatch&) = delete;
  MemoryWatch& operator=(const MemoryWatch&) = delete;
  // 700 bytes of EXR coded as DWA may stand for 46 MB, which pass through several buffers; a sanitiser keeps up to
  // 256 MB of freed memory on top.
  ~MemoryWatch() { EXPECT_LT(peak_megabytes() - before_, 900); }

 private:
  static long peak_megabytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss / 1024;
  }
  long before_;
};

TEST(HostileImages, TruncatedAtEveryLength) {
  const MemoryWatch watch;
  for (const Seed& seed : seeds()) {
    Image whole;
    const bool readable = survives(seed.bytes, &whole);
    EXPECT_EQ(readable, seed.name != "cmyk.jpg") << seed.name;
    std::size_t read_in_spite = 0;
    for (std::size_t length = 0; length < seed.bytes.size(); ++length) {
      Image image;
      if (survives({seed.bytes.begin(), seed.bytes.begin() + static_cast<std::ptrdiff_t>(length)}, &image)) {
        // Only what comes after the pixels may be missing.
        EXPECT_EQ(image.pixels, whole.pixels) << seed.name << " cut to " << length;
        ++read_in_spite;
      }
    }
    EXPECT_LE(read_in_spite,
              seed.name.ends_with(".png") || seed.name.ends_with(".jpg") || seed.name.starts_with("mipmap")
                  ? seed.bytes.size() / 3
                  : 0u)
        << seed.name;
  }
}

TEST(HostileImages, FlippedBits) {
  const MemoryWatch watch;
  for (const Seed& seed : seeds()) {
    for (std::size_t bit = 0; bit < 8 * std::min<std::size_t>(seed.bytes.size(), 1000); ++bit) {
      std::vector<std::byte> bytes = seed.bytes;
      bytes[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
      survives(bytes);
    }
  }
}

TEST(HostileImages, OverwrittenBytes) {
  const MemoryWatch watch;
  std::mt19937 random(11);
  for (const Seed& seed : seeds()) {
    for (int trial = 0; trial < 1500; ++trial) {
      std::vector<std::byte> bytes = seed.bytes;
      for (unsigned n = 1 + random() % 4; n > 0; --n) {
        const unsigned long extremes[] = {0, 1, 0x7f, 0x80, 0xff, random()};
        bytes[random() % bytes.size()] = static_cast<std::byte>(extremes[random() % 6] & 0xff);
      }
      survives(bytes);
    }
  }
}

TEST(HostileImages, ExrAttributesWhoseLengthIsNotTheirTypes) {
  // OpenEXR would read the value by its type, and then take any bytes for the next attribute.
  const std::string text = content_of(std::filesystem::path(EMBRUN_TEST_DATA_DIR) / "images" / "tiled_piz_half.exr");
  for (const std::string type : {"box2i", "chlist", "compression", "float", "lineOrder", "tiledesc", "v2f"}) {
    const std::size_t length_at = text.rfind('\0' + type + '\0') + type.size() + 2;
    std::string damaged = text;
    damaged[length_at] = static_cast<char>(damaged[length_at] + 1);
    try {
      (void)read_image(bytes_of(damaged), "hostile");
      FAIL() << type;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("attribute of type " + type + " has the wrong length"), std::string::npos)
          << e.what();
    }
  }
}

TEST(HostileImages, HugeSizesInTinyFiles) {
  const MemoryWatch watch;
  // The data window's corners and the tiles' sizes of an EXR header, overwritten with extremes.
  for (const Seed& seed : seeds()) {
    if (!seed.name.ends_with(".exr")) {
      continue;
    }
    const std::string text(reinterpret_cast<const char*>(seed.bytes.data()), seed.bytes.size());
    for (const char* key : {"dataWindow", "displayWindow", "tiledesc", "chlist", "compression"}) {
      const std::size_t place = text.find(key);
      for (std::size_t offset = 0; place != std::string::npos && offset < 40; ++offset) {
        for (const char* value : {"\xff\xff\xff\x7f", "\xff\xff\xff\x0f", "\xff\xff\x0f\x01", "\x01\x01\x01\xff"}) {
          std::string damaged = text;
          if (place + offset + 4 <= damaged.size()) {
            damaged.replace(place + offset, 4, value, 4);
            survives(bytes_of(damaged));
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace embrun

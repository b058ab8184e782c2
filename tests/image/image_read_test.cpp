#include "io/image_read.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/error.h"
#include "image/scratch_folder.h"
#include "math/vec.h"

namespace embrun {
namespace {

std::filesystem::path fixture(const std::string& name) {
  return std::filesystem::path(EMBRUN_TEST_DATA_DIR) / "images" / name;
}

Image read_text(const std::string& text) { return read_image(std::as_bytes(std::span(text)), "memory"); }

std::string error_of(const std::string& text) {
  try {
    (void)read_text(text);
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

float linear(int level) {
  const double v = level / 255.0;
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

// The fixtures hold ramps by formula; see tests/data/images/README.md.

TEST(ImageRead, PngEightBitsRgbPaletteAndAlpha) {
  for (const char* name : {"ramp8.png", "ramp_palette.png", "ramp_alpha.png"}) {
    const Image image = read_image(fixture(name));
    ASSERT_EQ(image.width, 8) << name;
    ASSERT_EQ(image.height, 6) << name;
    ASSERT_EQ(image.channels, 3) << name;
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 8; ++x) {
        const bool transparent = std::string(name) == "ramp_alpha.png" && x < 4;
        EXPECT_NEAR(image.at(x, y, 0), transparent ? 0.0f : linear(30 * x), 1e-6f) << name;
        EXPECT_NEAR(image.at(x, y, 1), transparent ? 0.0f : linear(30 * y), 1e-6f) << name;
        EXPECT_NEAR(image.at(x, y, 2), transparent ? 0.0f : linear(255 - 30 * x), 1e-6f) << name;
      }
    }
  }
}

TEST(ImageRead, PngSixteenBitsGrey) {
  const Image image = read_image(fixture("grey16.png"));
  ASSERT_EQ(image.channels, 1);
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 8; ++x) {
      const double v = (8000 * x + 1000 * y) / 65535.0;
      const double expected = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
      EXPECT_NEAR(image.at(x, y), expected, 2e-3 * expected + 2e-5);
    }
  }
}

TEST(ImageRead, JpegColourProgressiveAndGrey) {
  for (const char* name : {"ramp.jpg", "ramp_progressive.jpg"}) {
    const Image image = read_image(fixture(name));
    ASSERT_EQ(image.width, 24);
    ASSERT_EQ(image.height, 16);
    ASSERT_EQ(image.channels, 3);
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 24; ++x) {
        // Quality 97 keeps a smooth ramp to a few levels; sRGB's slope is at most 2.28 a level of 1/255.
        EXPECT_NEAR(image.at(x, y, 0), linear(10 * x), 4 * 2.28f / 255.0f) << name;
        EXPECT_NEAR(image.at(x, y, 1), linear(15 * y), 4 * 2.28f / 255.0f) << name;
      }
    }
  }
  const Image grey = read_image(fixture("grey.jpg"));
  ASSERT_EQ(grey.channels, 1);
  EXPECT_NEAR(grey.at(10, 7), linear(160), 4 * 2.28f / 255.0f);
}

// Numbers that are no colours come as they are.
TEST(ImageRead, RawValuesAreNotDecoded) {
  const Image png = read_image(fixture("ramp8.png"), "", PixelEncoding::raw);
  EXPECT_NEAR(png.at(3, 0, 0), 90 / 255.0, 1e-6);
  const Image wide = read_image(fixture("grey16.png"), "", PixelEncoding::raw);
  EXPECT_NEAR(wide.at(2, 1), 17000 / 65535.0, 1e-6);
  const Image jpeg = read_image(fixture("grey.jpg"), "", PixelEncoding::raw);
  EXPECT_NEAR(jpeg.at(10, 7), 160 / 255.0, 4 / 255.0);
}

TEST(ImageRead, JpegInFourColoursIsRefused) {
  try {
    (void)read_image(fixture("cmyk.jpg"));
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("cmyk.jpg: a JPEG file with 4 components"), std::string::npos) << e.what();
  }
}

TEST(ImageRead, ExrTilesMipmapsHalvesAndOtherCompressions) {
  for (const char* name : {"tiled_piz_half.exr", "mipmap_zip_float.exr"}) {
    const ImageLayers picture = read_exr_layers(fixture(name));
    EXPECT_EQ(picture.window, (PixelWindow{2, 1, 7, 5})) << name;
    EXPECT_EQ(picture.display_width, 10);
    const Image image = read_image(fixture(name));
    ASSERT_EQ(image.channels, 3);
    EXPECT_EQ(image.pixels, picture.layer("beauty").pixels);
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < 7; ++x) {
        for (int c = 0; c < 3; ++c) {
          EXPECT_EQ(image.at(x, y, c), static_cast<float>(x + 10 * y) + 0.25f * static_cast<float>(c)) << name;
        }
      }
    }
  }
}

TEST(ImageRead, ExrLuminanceAlone) {
  const Image image = read_image(fixture("luminance.exr"));
  ASSERT_EQ(image.channels, 1);
  EXPECT_EQ(image.at(6, 4), 17.0f);
}

TEST(ImageRead, ExrUnknownLayerListsTheChannels) {
  try {
    (void)read_image(fixture("tiled_piz_half.exr"), "depth");
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("it has: B, G, R"), std::string::npos) << e.what();
  }
}

TEST(ImageRead, PfmBothByteOrders) {
  const Image little = read_text(std::string("PF\n1 1\n-1.0\n\x00\x00\x80\x3f\x00\x00\x00\x40\x00\x00\x00\xbf", 24));
  EXPECT_EQ(little.pixels, (std::vector<float>{1.0f, 2.0f, -0.5f}));
  const Image big = read_text(std::string("Pf\n1 2\n2\n\x3f\x80\x00\x00\x40\x00\x00\x00", 17));
  EXPECT_EQ(big.channels, 1);
  EXPECT_EQ(big.pixels, (std::vector<float>{4.0f, 2.0f}));  // rows from the bottom; the scale of 2 multiplies
}

TEST(ImageRead, PfmErrorsNameTheMistake) {
  EXPECT_NE(error_of("PF\n2 2\n-1.0\nshort").find("must hold 48 bytes"), std::string::npos)
      << error_of("PF\n2 2\n-1.0\nshort");
  EXPECT_NE(error_of("PF\n1 1\n-1.0\n12345678901234").find("must hold 12 bytes"), std::string::npos);
  EXPECT_NE(error_of("PF\n100000 100000\n-1.0\n").find("exceeds 2^28"), std::string::npos);
  EXPECT_NE(error_of("PF\n10000 10000\n-1.0\n").find("too large for a file of 20 bytes"), std::string::npos);
  EXPECT_NE(error_of("PF\n-1 4\n-1.0\n").find("not positive"), std::string::npos);
  EXPECT_NE(error_of("PF\n4x 4\n-1.0\n").find("\"4x\" is no number"), std::string::npos);
  EXPECT_NE(error_of("PF\n1 1\n0\n123456789012").find("scale"), std::string::npos);
  EXPECT_NE(error_of("PF\n1 1\nnan\n123456789012").find("scale"), std::string::npos);
  EXPECT_NE(error_of("PF\n1 1").find("header ends early"), std::string::npos);
}

const std::string hdr_head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";

TEST(ImageRead, HdrFlatAndOldRuns) {
  // Pixels 128 64 0 e129 = (1, 0.5, 0). The run 1 1 1 4 repeats it 4 times; then 1 1 1 2, 1 1 1 1 repeats it
  // 2 + 256 times, so the row has 1 + 4 + 1 + 258 pixels.
  std::string text = hdr_head + "-Y 1 +X 264\n";
  text += std::string("\x80\x40\x00\x81\x01\x01\x01\x04\x00\x00\x80\x82\x01\x01\x01\x02\x01\x01\x01\x01", 20);
  const Image image = read_text(text);
  ASSERT_EQ(image.width, 264);
  EXPECT_EQ(image.at(0, 0, 0), 1.0f);
  EXPECT_EQ(image.at(4, 0, 0), 1.0f);
  EXPECT_EQ(image.at(4, 0, 1), 0.5f);
  EXPECT_EQ(image.at(5, 0, 0), 0.0f);
  EXPECT_EQ(image.at(5, 0, 2), 2.0f);
  EXPECT_EQ(image.at(263, 0, 2), 2.0f);
}

TEST(ImageRead, HdrOrientationAndExposure) {
  std::string pixels("\x80\x00\x00\x81\x80\x00\x00\x82\x80\x00\x00\x83\x80\x00\x00\x84", 16);  // 1 2 4 8
  const auto red = [&](const std::string& line, const std::string& head = hdr_head) {
    const Image image = read_text(head + line + "\n" + pixels);
    std::vector<float> values;
    for (std::size_t i = 0; i < image.pixels.size(); i += 3) {
      values.push_back(image.pixels[i]);
    }
    return values;
  };
  EXPECT_EQ(red("-Y 2 +X 2"), (std::vector<float>{1, 2, 4, 8}));
  EXPECT_EQ(red("+Y 2 +X 2"), (std::vector<float>{4, 8, 1, 2}));
  EXPECT_EQ(red("-Y 2 -X 2"), (std::vector<float>{2, 1, 8, 4}));
  EXPECT_EQ(red("-Y 2 +X 2", "#?RGBE\nEXPOSURE= 2\nEXPOSURE=2.0\n# note\n\n"), (std::vector<float>{0.25f, 0.5f, 1, 2}));
}

TEST(ImageRead, HdrErrorsNameTheMistake) {
  EXPECT_NE(error_of("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n1234").find("32-bit_rle_xyze"),
            std::string::npos);
  EXPECT_NE(error_of(hdr_head + "+X 1 -Y 1\n1234").find("resolution line"), std::string::npos);
  EXPECT_NE(error_of(hdr_head + "-Y 20000 +X 20000\n1234").find("2^28"), std::string::npos);
  EXPECT_NE(error_of(hdr_head + "-Y 10000 +X 10000\n1234").find("too large for a file"), std::string::npos);
  EXPECT_NE(error_of(hdr_head + "-Y 0 +X 5\n1234").find("not positive"), std::string::npos);
  EXPECT_NE(error_of(hdr_head + "-Y 1 +X 2\n1234").find("ends early"), std::string::npos);
  EXPECT_NE(error_of(hdr_head + "-Y 1 +X 2\n\x01\x01\x01\x01").find("does not fit its row"), std::string::npos);
  EXPECT_NE(error_of(hdr_head + "-Y 1 +X 2\n1234\x01\x01\x01\x02").find("does not fit its row"), std::string::npos);
  EXPECT_NE(error_of(hdr_head + std::string("-Y 1 +X 8\n\x02\x02\x00\x08\x89\x01", 16)).find("does not fit its row"),
            std::string::npos);
  EXPECT_NE(error_of("#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\n1234").find("EXPOSURE"), std::string::npos);
  EXPECT_NE(error_of("#?RADIANCE\nno end").find("header ends early"), std::string::npos);
}

TEST(ImageRead, UnknownFilesAndFolders) {
  const ScratchFolder folder;
  EXPECT_NE(error_of("").find("none of EXR, HDR, PFM, PNG, JPEG"), std::string::npos);
  EXPECT_NE(error_of("BM, a bitmap").find("none of EXR"), std::string::npos);
  EXPECT_THROW((void)read_image(folder / "missing.exr"), Error);
  EXPECT_THROW((void)read_image(folder / ""), Error);
  EXPECT_THROW((void)read_exr_layers(fixture("ramp8.png")), Error);
}

TEST(ImageRead, CleanEnvironmentCountsPixels) {
  Image image = make_image(4, 1, 3);
  image.pixels = {1, 2, 3, std::numeric_limits<float>::quiet_NaN(), infinity, 3, -1, -2, 3, infinity, -1, 5};
  const EnvironmentRepair repair = clean_environment(image);
  EXPECT_EQ(repair.not_finite, 2u);
  EXPECT_EQ(repair.negative, 2u);
  EXPECT_EQ(image.pixels, (std::vector<float>{1, 2, 3, 0, 0, 3, 0, 0, 3, 0, 0, 5}));
}

}  // namespace
}  // namespace embrun

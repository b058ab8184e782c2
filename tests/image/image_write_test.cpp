#include "io/image_write.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "base/error.h"
#include "image/film.h"
#include "image/scratch_folder.h"
#include "io/image_read.h"

namespace embrun {
namespace {

ImageLayers one_layer(Image image) {
  ImageLayers picture;
  picture.display_width = image.width;
  picture.display_height = image.height;
  picture.window = {0, 0, image.width, image.height};
  picture.layers.push_back(std::move(image));
  return picture;
}

/// A crop of a picture with all the layers, some values of which only floats hold.
ImageLayers rendered_crop() {
  Film film = make_film(20, 12, {3, 2, 11, 7});
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    for (int n = 0; n < 3; ++n) {
      FilmSample s;
      const float v = static_cast<float>(i) + 0.1f * static_cast<float>(n);
      s.radiance = {v, 0.37f * v, 1e-4f * v};
      s.albedo = {0.8f, 0.3f, 0.1f};
      s.normal = {0.6f, -0.8f, 0.0f};
      s.depth = i % 4 == 0 ? infinity : 1.0f + 0.01f * v;
      add_sample(film, i, s);
    }
  }
  return resolve(film);
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(ImageWrite, PfmBytes) {
  Image image = make_image(1, 2, 3, "beauty");
  image.pixels = {1.0f, 2.0f, -0.5f, 0.0f, infinity, 0.25f};  // top pixel, bottom pixel
  std::string expected = "PF\n1 2\n-1.0\n";
  // IEEE 754 single precision, little endian; the bottom row first.
  expected += std::string("\x00\x00\x00\x00\x00\x00\x80\x7f\x00\x00\x80\x3e", 12);
  expected += std::string("\x00\x00\x80\x3f\x00\x00\x00\x40\x00\x00\x00\xbf", 12);
  EXPECT_EQ(text_of(encode_image(ImageFormat::pfm, one_layer(image))), expected);
  Image grey = make_image(1, 1, 1, "beauty");
  grey.pixels = {1.0f};
  EXPECT_EQ(text_of(encode_image(ImageFormat::pfm, one_layer(grey))),
            std::string("Pf\n1 1\n-1.0\n\x00\x00\x80\x3f", 16));
}

TEST(ImageWrite, HdrBytes) {
  // 1 = 0.5 * 2^1: exponent byte 129, mantissas 256 v / 2: 128, 64, 32. Eight pixels make one run per component.
  Image wide = make_image(8, 1, 3, "beauty");
  for (int x = 0; x < 8; ++x) {
    wide.at(x, 0, 0) = 1.0f;
    wide.at(x, 0, 1) = 0.5f;
    wide.at(x, 0, 2) = 0.25f;
  }
  EXPECT_EQ(text_of(encode_image(ImageFormat::hdr, one_layer(wide), {}, {{"seed", "7\n8"}})),
            std::string("#?RADIANCE\n# embrun:seed=7 8\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n"
                        "\x02\x02\x00\x08\x88\x80\x88\x40\x88\x20\x88\x81",
                        75));
  // Rows shorter than 8 are flat; 0 is four zeros; 255.5 of 256 rounds up into the next exponent.
  Image narrow = make_image(3, 1, 3, "beauty");
  narrow.pixels = {0.0f, 0.0f, 0.0f, 3.0f, 1.5f, 0.01f, 0.9999f, 0.0f, 0.0f};
  EXPECT_EQ(text_of(encode_image(ImageFormat::hdr, one_layer(narrow))),
            std::string("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 3\n"
                        "\x00\x00\x00\x00\xc0\x60\x01\x82\x80\x00\x00\x81",
                        57));
}

TEST(ImageWrite, HdrRoundTripIsWithinItsStep) {
  Image image = make_image(300, 5, 3, "beauty");
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    // Stretches of equal pixels, and of different ones, over 12 orders of magnitude.
    const std::size_t k = i / 3 % 300 < 140 ? i / 3 / 20 : i;
    image.pixels[i] = std::pow(10.0f, static_cast<float>(k * 7919 % 1201) / 100.0f - 6.0f);
  }
  const Image back = read_image(encode_image(ImageFormat::hdr, one_layer(image)), "memory");
  ASSERT_EQ(back.pixels.size(), image.pixels.size());
  for (std::size_t i = 0; i < image.pixels.size(); i += 3) {
    const float high = std::fmax(image.pixels[i], std::fmax(image.pixels[i + 1], image.pixels[i + 2]));
    for (std::size_t c = 0; c < 3; ++c) {
      // Half a step of 1/128 of the largest channel's power of two, at most 1/256 of the channel itself.
      EXPECT_NEAR(back.pixels[i + c], image.pixels[i + c], high / 255.0f);
    }
  }
}

TEST(ImageWrite, HdrOfWhatItCannotHold) {
  Image image = make_image(4, 1, 1, "depth");
  image.pixels = {infinity, 2.0f, -3.0f, 3e38f};
  const Image back = read_image(encode_image(ImageFormat::hdr, one_layer(image), {.layer = "depth"}), "memory");
  EXPECT_EQ(back.at(0, 0), 0.0f);
  EXPECT_EQ(back.at(1, 0), 2.0f);
  EXPECT_EQ(back.at(2, 0), 0.0f);
  EXPECT_NEAR(back.at(3, 0) / 1.69e38f, 1.0f, 0.004f);
  Image normal = make_image(1, 1, 3, "normal");
  normal.pixels = {-1.0f, 0.0f, 1.0f};
  const Image mapped = read_image(encode_image(ImageFormat::hdr, one_layer(normal), {.layer = "normal"}), "memory");
  EXPECT_EQ(mapped.pixels, (std::vector<float>{0.0f, 0.5f, 1.0f}));
}

TEST(ImageWrite, ExrKeepsLayersWindowAndMetadata) {
  const ScratchFolder folder;
  const ImageLayers picture = rendered_crop();
  const ImageMetadata metadata = {
      {"command", "embrun render a.bgeo -o \xc3\xa9.exr"}, {"seed", "5"}, {"version", "0.1.0"}, {"time", "3.2 s"}};
  write_image(folder / "a.EXR", picture, {}, metadata);
  ImageMetadata found;
  const ImageLayers back = read_exr_layers(folder / "a.EXR", &found);
  EXPECT_EQ(back.display_width, 20);
  EXPECT_EQ(back.display_height, 12);
  EXPECT_EQ(back.window, (PixelWindow{3, 2, 11, 7}));
  ASSERT_EQ(back.layers.size(), picture.layers.size());
  for (const Image& layer : picture.layers) {
    EXPECT_EQ(back.layer(layer.name).channel_names, layer.channel_names) << layer.name;
    EXPECT_EQ(back.layer(layer.name).pixels, layer.pixels) << layer.name;
  }
  ASSERT_EQ(found.size(), metadata.size());
  for (const auto& entry : metadata) {
    EXPECT_NE(std::find(found.begin(), found.end(), entry), found.end()) << entry.first;
  }
}

TEST(ImageWrite, ExrHalvesRoundAndStayFinite) {
  ImageLayers picture = rendered_crop();
  picture.layers[0].pixels[0] = 1e6f;
  const std::vector<std::byte> bytes = encode_image(ImageFormat::exr, picture, {.half = true});
  const ImageLayers back = read_exr_layers(bytes, "memory");
  EXPECT_EQ(back.layer("beauty").pixels[0], 65504.0f);  // the largest half
  for (std::size_t i = 1; i < picture.layers[0].pixels.size(); ++i) {
    // 11 significant bits: relative error at most 2^-11; below 2^-14 steps of 2^-24.
    const float v = picture.layers[0].pixels[i];
    EXPECT_NEAR(back.layer("beauty").pixels[i], v, v * 0x1p-11f + 0x1p-25f);
  }
  for (const char* exact : {"depth", "samples", "variance"}) {
    EXPECT_EQ(back.layer(exact).pixels, picture.layer(exact).pixels) << exact;
  }
  EXPECT_LT(bytes.size(), encode_image(ImageFormat::exr, picture).size());
}

TEST(ImageWrite, PngHoldsTheToneMappedCropAndText) {
  Image image = make_image(3, 2, 3, "beauty");
  image.pixels = {0, 0, 0, 1, 1, 1, 9, 0, 0, 0.18f, 0.18f, 0.18f, 0.5f, 0.25f, 1, 0, 1, 0};
  const ImageWriteOptions options{.tone = {.curve = ToneCurve::srgb, .dither = false}};
  const auto bytes =
      encode_image(ImageFormat::png, one_layer(image), options, {{"command", "embrun r\xc3\xa9ndu"}, {"seed", "5"}});
  const Image back = read_image(bytes, "memory");
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    // Half a level: 0.5 / 255 in sRGB, whose slope in linear light is at most 2.28 (at 1).
    EXPECT_NEAR(back.pixels[i], std::fmin(image.pixels[i], 1.0f), 2.28f * 0.5f / 255.0f);
  }
  const std::string text = text_of(bytes);
  EXPECT_NE(text.find(std::string("tEXtembrun:seed\0"
                                  "5",
                                  17)),
            std::string::npos);
  EXPECT_NE(text.find("embrun r\xc3\xa9ndu"), std::string::npos);
  EXPECT_NE(text.find("iTXtembrun:command"), std::string::npos);  // not ASCII: UTF-8
  EXPECT_NE(text.find("srgb tone curve"), std::string::npos);
  EXPECT_NE(text.find("sRGB"), std::string::npos);
  EXPECT_EQ(text_of(encode_image(ImageFormat::png, rendered_crop(), {.layer = "normal"})).find("sRGB"),
            std::string::npos);
}

TEST(ImageWrite, EveryLayerGoesIntoEveryFormat) {
  const ScratchFolder folder;
  const ImageLayers picture = rendered_crop();
  for (const char* layer : film_layer_names) {
    for (const char* extension : {".pfm", ".hdr", ".png", ".exr"}) {
      const auto path = folder / (std::string(layer) + extension);
      write_image(path, picture, {.layer = layer});
      const Image back = read_image(path, std::string(extension) == ".exr" ? layer : "");
      EXPECT_EQ(back.width, 11);
      EXPECT_EQ(back.height, 7);
      for (float v : back.pixels) {
        EXPECT_FALSE(std::isnan(v)) << path;
      }
      if (std::string(extension) == ".pfm") {
        EXPECT_EQ(back.pixels, picture.layer(layer).pixels);  // floats, infinities included
      }
    }
  }
  EXPECT_EQ(folder.files().size(), 24u);
}

TEST(ImageWrite, SingleImageKeepsItsName) {
  const ScratchFolder folder;
  Image image = make_image(2, 2, 1, "depth");
  image.pixels = {1, 2, 3, 4};
  write_image(folder / "d.exr", image);
  EXPECT_EQ(read_exr_layers(folder / "d.exr").layer("depth").pixels, image.pixels);
  write_image(folder / "d.pfm", image);
  EXPECT_EQ(read_image(folder / "d.pfm").pixels, image.pixels);
}

template <class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

TEST(ImageWrite, NamesAndFoldersAreCheckedBeforehand) {
  const ScratchFolder folder;
  EXPECT_EQ(message_of([&] { check_image_output(folder / "a.Png"); }), "no error");
  EXPECT_NE(message_of([&] { check_image_output(folder / "a.jpg"); }).find(".exr, .hdr, .pfm or .png"),
            std::string::npos);
  EXPECT_NE(message_of([&] { check_image_output(folder / "a"); }).find("no extension"), std::string::npos);
  EXPECT_NE(message_of([&] { check_image_output(folder / "no" / "a.png"); }).find("does not exist"), std::string::npos);
  EXPECT_EQ(message_of([] { check_layer_name("depth"); }), "no error");
  EXPECT_NE(message_of([] { check_layer_name("color"); }).find("beauty, albedo, normal, depth, samples, variance"),
            std::string::npos);
  EXPECT_NE(message_of([] {
              (void)encode_image(ImageFormat::pfm, rendered_crop(), {.layer = "color"});
            }).find("it has: beauty"),
            std::string::npos);
  Image two = make_image(1, 1, 2, "beauty");
  EXPECT_NE(message_of([&] { (void)encode_image(ImageFormat::png, one_layer(two)); }).find("2 channels"),
            std::string::npos);
  EXPECT_TRUE(folder.files().empty());
}

}  // namespace
}  // namespace embrun

// embrun compare: what it says of pictures made here, and how it ends.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli_fixture.h"
#include "image/false_color.h"
#include "io/image_read.h"
#include "io/image_write.h"

namespace embrun {
namespace {

class CompareCli : public Cli {
 protected:
  /// A picture of one grey.
  static Image filled(int width, int height, float value) {
    Image image = make_image(width, height, 3, "beauty");
    image.pixels.assign(image.pixels.size(), value);
    return image;
  }

  void write(const std::string& name, const Image& image, const ImageWriteOptions& options = {}) const {
    write_image(folder / name, image, options);
  }

  /// As a render writes it: beauty, variance and samples.
  void write_layers(const std::string& name, Image beauty, float variance, float samples, PixelWindow window,
                    const ImageMetadata& metadata = {}) const {
    ImageLayers picture;
    picture.display_width = 64;
    picture.display_height = 64;
    picture.window = window;
    beauty.name = "beauty";
    picture.layers.push_back(beauty);
    picture.layers.push_back(make_image(window.width, window.height, 3, "variance", {"R", "G", "B"}));
    picture.layers.push_back(make_image(window.width, window.height, 1, "samples", {"N"}));
    picture.layers[1].pixels.assign(picture.layers[1].pixels.size(), variance);
    picture.layers[2].pixels.assign(picture.layers[2].pixels.size(), samples);
    write_image(folder / name, picture, {}, metadata);
  }

  nlohmann::json compare(const std::string& arguments) const {
    const Outcome outcome = run("compare --json " + arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
};

TEST_F(CompareCli, EqualPicturesDoNotDiffer) {
  write("a.pfm", filled(32, 24, 0.5f));
  const auto r = compare("a.pfm a.pfm");
  EXPECT_EQ(r["mse"], 0.0);
  EXPECT_TRUE(r["psnr"].is_null());  // JSON has no infinity
  EXPECT_EQ(r["ssim"], 1.0);
  EXPECT_EQ(r["flip"], 0.0);
  EXPECT_EQ(r["mean_ratio"], 1.0);
  EXPECT_EQ(r["block_share"], 1.0);
  EXPECT_TRUE(r["mse_bias"].is_null());  // nothing tells the noise
  const Outcome text = run("compare a.pfm a.pfm");
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find("infinite: the pictures are equal"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("filmic tone curve, exposure +0 stops"), std::string::npos) << text.out;
}

// Radiance 0.2 and 0.1 are sRGB 0.4845292 and 0.3491902 (IEC 61966-2-1): MSE 0.0183166, PSNR 17.3715 dB. On radiance
// (0.1)^2 / (0.01 + 0.01) and the ratio 2.
TEST_F(CompareCli, FiguresOfKnownPictures) {
  write("a.pfm", filled(32, 24, 0.2f));
  write("b.exr", filled(32, 24, 0.1f));
  const auto r = compare("a.pfm b.exr --tone srgb");
  EXPECT_NEAR(r["mse"].get<double>(), 0.0183166, 1e-6);
  EXPECT_NEAR(r["rmse"].get<double>(), 0.1353390, 1e-6);
  EXPECT_NEAR(r["psnr"].get<double>(), 17.3715, 1e-3);
  EXPECT_NEAR(r["relative_mse"].get<double>(), 0.5, 1e-5);
  EXPECT_NEAR(r["mean_ratio"].get<double>(), 2.0, 1e-6);
  EXPECT_EQ(r["block_share"], 0.0);
  EXPECT_NEAR(r["block_rms"].get<double>(), 2.0 / 3.0, 1e-6);  // 0.1 / 0.15
  EXPECT_EQ(r["width"], 32);
  EXPECT_EQ(r["height"], 24);
  EXPECT_EQ(r["display"]["a"], "srgb tone curve, exposure +0 stops");
  // A stop less is half the radiance.
  const auto darker = compare("a.pfm b.exr --tone srgb --exposure -1");
  EXPECT_NEAR(darker["mse"].get<double>(), std::pow(0.3491902 - 0.2478005, 2), 1e-6);  // of 0.1 and 0.05
}

// 8-bit files are taken as they are, whatever the tone curve.
TEST_F(CompareCli, PngFilesHoldDisplayValues) {
  ImageWriteOptions srgb;
  srgb.tone = {0, ToneCurve::srgb, false};
  write("a.png", filled(32, 24, 1.0f), srgb);
  write("b.png", filled(32, 24, 0.0f), srgb);
  const auto r = compare("a.png b.png");
  EXPECT_EQ(r["mse"], 1.0);
  EXPECT_EQ(r["display"]["a"], "as stored");
  EXPECT_TRUE(r["relative_mse"].is_null());
  EXPECT_TRUE(r["mean_ratio"].is_null());
  // With a picture of radiance, that alone goes through the tone curve.
  write("c.pfm", filled(32, 24, 1.0f));
  const auto mixed = compare("a.png c.pfm --tone srgb");
  EXPECT_EQ(mixed["mse"], 0.0);
  EXPECT_NE(mixed["notes"][0].get<std::string>().find("give the tone curve"), std::string::npos);
}

TEST_F(CompareCli, GreyIsComparedWithColour) {
  Image grey = make_image(16, 16, 1, "beauty");
  grey.pixels.assign(grey.pixels.size(), 0.25f);
  write("grey.pfm", grey);
  write("colour.pfm", filled(16, 16, 0.25f));
  EXPECT_EQ(compare("grey.pfm colour.pfm")["mse"], 0.0);
}

// Within the sRGB curve's straight start a variance of 1e-8 is one of 12.92^2 1e-8 = 1.66926e-6 in display values, and
// a difference of 3e-4 in radiance one of 1.50234e-5 in MSE.
TEST_F(CompareCli, VarianceLayersTellTheNoise) {
  write_layers("a.exr", filled(16, 16, 1e-3f), 1e-8f, 4, {0, 0, 16, 16});
  write_layers("b.exr", filled(16, 16, 1.3e-3f), 1e-8f, 4, {0, 0, 16, 16});
  const auto r = compare("a.exr b.exr --tone srgb");
  EXPECT_NEAR(r["mse"].get<double>(), 1.50234e-5, 1e-9);
  EXPECT_NEAR(r["mse_noise"].get<double>(), 2 * 1.66926e-6, 1e-10);
  EXPECT_NEAR(r["mse_bias"].get<double>(), 1.50234e-5 - 2 * 1.66926e-6, 1e-9);
  EXPECT_LE(r["mse_bias_low"].get<double>(), r["mse_bias"].get<double>());
  EXPECT_EQ(r["noise_from"]["a"], "variance");
  // Stratified samples may have less noise than that, or nearly none.
  EXPECT_GE(r["mse_bias_high"].get<double>(), r["mse"].get<double>());
  EXPECT_EQ(r["mse_noise_low"], 0.0);
  // Of a reference without noise, all of the noise is a's.
  write("c.pfm", filled(16, 16, 1.3e-3f));
  const auto one = compare("a.exr c.pfm --tone srgb");
  EXPECT_NEAR(one["mse_noise"].get<double>(), 1.66926e-6, 1e-10);
  EXPECT_TRUE(one["noise_from"]["b"].is_null());
  EXPECT_NE(one["notes"][0].get<std::string>().find("c.pfm is not known"), std::string::npos);
}

TEST_F(CompareCli, VariancesThatTellNothingAreLeftOut) {
  write_layers("one.exr", filled(16, 16, 0.1f), 0, 1, {0, 0, 16, 16});
  write_layers("clean.exr", filled(16, 16, 0.1f), 1e-6f, 4, {0, 0, 16, 16}, {{"denoised", "yes"}});
  const auto r = compare("one.exr clean.exr");
  EXPECT_TRUE(r["mse_noise"].is_null());
  EXPECT_NE(r["notes"][0].get<std::string>().find("at least two samples"), std::string::npos) << r["notes"];
  EXPECT_NE(r["notes"][1].get<std::string>().find("denoised"), std::string::npos) << r["notes"];
}

TEST_F(CompareCli, DenoisedRendersSaySo) {
  ASSERT_EQ(run("render water.xyz -q -o a.exr --denoise" + small).exit_code, 0);
  ASSERT_EQ(run("render water.xyz -q -o b.exr" + small).exit_code, 0);
  const auto r = compare("a.exr b.exr");
  EXPECT_TRUE(r["noise_from"]["a"].is_null());
  EXPECT_EQ(r["noise_from"]["b"], "variance");
}

// Two renders of one scene differ by their noise alone.
TEST_F(CompareCli, HalvesTellNoiseFromDifference) {
  for (const char* seed : {"1", "2", "3", "4"})
    ASSERT_EQ(run(std::string("render water.xyz -q --size 64x48 --spp 4 --order 2 -o s") + seed + ".exr --seed " + seed)
                  .exit_code,
              0);
  const auto same = compare("s1.exr s3.exr --half-a s2.exr --half-b s4.exr");
  EXPECT_GT(same["mse"].get<double>(), 0.0);
  EXPECT_EQ(same["noise_from"]["a"], "half");
  EXPECT_EQ(same["mse_bias_low"], 0.0);
  EXPECT_GE(same["mse_noise_high"].get<double>(), same["mse"].get<double>());
  EXPECT_NEAR(same["mse_bias"].get<double>() + same["mse_noise"].get<double>(), same["mse"].get<double>(), 1e-12);

  // Other water: most of it stays with any number of samples.
  for (const char* seed : {"1", "2"})
    ASSERT_EQ(run(std::string("render water.xyz -q --size 64x48 --spp 4 --order 2 --ior 1.6 --absorption 9,1,1 -o t") +
                  seed + ".exr --seed " + seed)
                  .exit_code,
              0);
  const auto other = compare("s1.exr t1.exr --half-a s2.exr --half-b t2.exr");
  EXPECT_GT(other["mse_bias_low"].get<double>(), 0.0);
  EXPECT_TRUE(other["notes"].empty()) << other["notes"];
  // Where the noise is taken for independent and cannot be, it is said.
  const auto crossed = compare("s1.exr t2.exr --half-a s2.exr --half-b t1.exr");
  EXPECT_NE(crossed["notes"][0].get<std::string>().find("same seed"), std::string::npos) << crossed["notes"];
  const auto layers = compare("s1.exr t1.exr");
  EXPECT_NE(layers["notes"].dump().find("same seed"), std::string::npos) << layers["notes"];
}

TEST_F(CompareCli, WritesAPictureOfTheDifferences) {
  Image b = filled(160, 20, 0.0f);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 80; ++x)
      for (int c = 0; c < 3; ++c) b.at(x, y, c) = 1.0f;
  write("a.pfm", filled(160, 20, 0.0f));
  write("b.pfm", b);
  const auto r = compare("a.pfm b.pfm --tone srgb --diff x.png");
  EXPECT_EQ(r["diff_scale"], 1.0);
  const Image picture = read_image(folder / "x.png", {}, PixelEncoding::raw);
  EXPECT_EQ(picture.width, 160);
  EXPECT_EQ(picture.height, 20 + legend_height);
  EXPECT_NEAR(picture.at(10, 10, 0), 252.0 / 255, 1e-6);  // the last colour
  EXPECT_NEAR(picture.at(100, 10, 2), 4.0 / 255, 1e-6);   // the first
  const Outcome text = run("compare a.pfm b.pfm --tone srgb --diff x.png --diff-scale 0.25");
  EXPECT_NE(text.out.find("black 0, pale yellow 0.25 and above"), std::string::npos) << text.out;
  // The values themselves.
  compare("a.pfm b.pfm --tone srgb --diff x.pfm");
  EXPECT_EQ(read_image(folder / "x.pfm").at(10, 10), 1.0f);
  EXPECT_EQ(read_image(folder / "x.pfm").at(100, 10), 0.0f);
  compare("a.pfm b.pfm --diff y.pfm --diff-of relative");
  EXPECT_NEAR(read_image(folder / "y.pfm").at(10, 10), std::sqrt(1 / 1.01), 1e-6);
  compare("a.pfm b.pfm --diff z.exr --diff-of flip");
  EXPECT_GT(read_image(folder / "z.exr").at(10, 10), 0.9f);
}

TEST_F(CompareCli, LimitsEndIn3) {
  write("a.pfm", filled(32, 24, 0.2f));
  write("b.pfm", filled(32, 24, 0.1f));  // MSE 0.0183 with --tone srgb
  EXPECT_EQ(run("compare a.pfm b.pfm --tone srgb --fail-above mse=0.02 --fail-below psnr=17").exit_code, 0);
  const Outcome above = run("compare a.pfm b.pfm --tone srgb --fail-above mse=0.018");
  EXPECT_EQ(above.exit_code, 3);
  EXPECT_NE(above.err.find("mse is 0.018316"), std::string::npos) << above.err;
  EXPECT_NE(above.out.find("MSE"), std::string::npos);
  EXPECT_EQ(run("compare a.pfm b.pfm --tone srgb --fail-above mse=0.02 --fail-below psnr=18").exit_code, 3);
  EXPECT_EQ(run("compare a.pfm a.pfm --fail-below psnr=100").exit_code, 0);  // infinite
  expect_refused("compare a.pfm b.pfm --fail-above mse_bias=1", 1, "mse_bias is not known");
  expect_refused("compare a.pfm b.pfm --fail-above mse", 2, "\"mse\" is not METRIC=VALUE");
  expect_refused("compare a.pfm b.pfm --fail-above mse=low", 2, "--fail-above");
  expect_refused("compare a.pfm b.pfm --fail-above error=1", 2, "unknown metric \"error\"; there are: mse, rmse");
}

TEST_F(CompareCli, BadOptionsEndIn2) {
  write("a.pfm", filled(16, 16, 0.2f));
  expect_refused("compare a.pfm", 2, "B");
  expect_refused("compare a.pfm a.pfm --tone log", 2, "srgb, filmic");
  expect_refused("compare a.pfm a.pfm --exposure nan", 2, "exposure");
  expect_refused("compare a.pfm a.pfm --ppd 0", 2, "pixels per degree");
  expect_refused("compare a.pfm a.pfm --diff x.png --diff-of colour", 2, "display, flip, relative");
  expect_refused("compare a.pfm a.pfm --diff x.png --diff-scale 0", 2, "must be positive");
}

TEST_F(CompareCli, PicturesThatCannotBeComparedEndIn1) {
  write("a.pfm", filled(16, 16, 0.2f));
  write("small.pfm", filled(16, 12, 0.2f));
  expect_refused("compare a.pfm none.pfm --diff x.png", 1, "none.pfm");
  expect_refused("compare a.pfm water.xyz --diff x.png", 1, "none of EXR, HDR, PFM, PNG, JPEG");
  expect_refused("compare a.pfm small.pfm --diff x.png", 1,
                 "a.pfm has 16x16 pixels, small.pfm has 16x12: only pictures of one size can be compared");
  Image bad = filled(16, 16, 0.2f);
  bad.at(3, 5, 1) = std::numeric_limits<float>::quiet_NaN();
  bad.at(4, 6, 0) = std::numeric_limits<float>::infinity();
  write("bad.pfm", bad);
  expect_refused("compare a.pfm bad.pfm --diff x.png", 1,
                 "bad.pfm: 2 pixels are not finite (NaN or infinite), the first at column 3, row 5");
  expect_refused("compare a.pfm a.pfm --diff x.tiff", 1, "x.tiff");
  expect_refused("compare a.pfm small.pfm --diff small.pfm", 1, "would replace a picture that is compared");
  expect_refused("compare a.pfm a.pfm --half-a a.pfm --diff x.png", 1, "is the same picture");
  expect_refused("compare a.pfm a.pfm --half-b small.pfm --diff x.png", 1, "16x12");
  write("a.png", filled(16, 16, 0.2f));
  expect_refused("compare a.pfm a.pfm --half-a a.png --diff x.png", 1, "files of one kind");
  expect_refused("compare a.png a.pfm --diff x.png --diff-of relative", 1, "need radiance");

  write_layers("left.exr", filled(16, 16, 0.2f), 0, 4, {0, 0, 16, 16});
  write_layers("right.exr", filled(16, 16, 0.2f), 0, 4, {8, 0, 16, 16});
  expect_refused("compare left.exr right.exr --diff x.png", 1, "begins at 0,0, right.exr the one at 8,0");
  write_layers("noise.exr", filled(16, 16, 0.2f), std::numeric_limits<float>::quiet_NaN(), 4, {0, 0, 16, 16});
  expect_refused("compare left.exr noise.exr --diff x.png", 1,
                 "not finite (NaN or infinite) in the layer \"variance\"");
  Image depth = make_image(16, 16, 1, "depth", {"Z"});
  write("depth.exr", depth);
  expect_refused("compare left.exr depth.exr --diff x.png", 1, "depth.exr: EXR file has no channels R, G, B nor Y");
}

TEST_F(CompareCli, HelpTeachesHowToCompare) {
  const Outcome help = run("compare --help");
  EXPECT_EQ(help.exit_code, 0);
  for (const char* word :
       {"--json", "--diff", "--half-a", "--fail-above", "Metrics: mse rmse psnr ssim flip", "Examples:", "Exit codes:"})
    EXPECT_NE(help.out.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace embrun

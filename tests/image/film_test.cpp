#include "image/film.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "base/error.h"
#include "base/parallel.h"

namespace embrun {
namespace {

FilmSample grey_sample(float radiance, float depth = infinity) {
  FilmSample s;
  s.radiance = grey(radiance);
  s.depth = depth;
  return s;
}

TEST(Film, MeanAndVarianceOfFourKnownSamples) {
  Film film = make_film(1, 1);
  for (float v : {1.0f, 2.0f, 3.0f, 4.0f}) {
    FilmSample s;
    s.radiance = {v, 2.0f * v, 0.0f};
    ASSERT_TRUE(add_sample(film, 0, s));
  }
  const ImageLayers layers = resolve(film);
  // Mean 5/2; sum of squared deviations 2.25 + 0.25 + 0.25 + 2.25 = 5, s^2 = 5/3, variance of the mean 5/12.
  EXPECT_FLOAT_EQ(layers.layer("beauty").at(0, 0, 0), 2.5f);
  EXPECT_FLOAT_EQ(layers.layer("beauty").at(0, 0, 1), 5.0f);
  EXPECT_FLOAT_EQ(layers.layer("variance").at(0, 0, 0), 5.0f / 12.0f);
  EXPECT_FLOAT_EQ(layers.layer("variance").at(0, 0, 1), 5.0f / 3.0f);  // doubled values: four times
  EXPECT_EQ(layers.layer("variance").at(0, 0, 2), 0.0f);
  EXPECT_EQ(layers.layer("samples").at(0, 0), 4.0f);
}

TEST(Film, VarianceOfUniformNoiseMatchesTheory) {
  // Uniform on [1000, 1001): variance 1/12, of the mean of n 1/(12 n); the large offset tests the cancellation.
  constexpr int pixels = 400, n = 64;
  Film film = make_film(pixels, 1);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (int k = 0; k < n; ++k) {
      add_sample(film, i, grey_sample(static_cast<float>(1000.0 + uniform(random))));
    }
  }
  const ImageLayers layers = resolve(film);
  double estimated = 0, observed = 0;
  for (int x = 0; x < pixels; ++x) {
    estimated += static_cast<double>(layers.layer("variance").at(x, 0, 1)) / pixels;
    const double error = film.pixels[static_cast<std::size_t>(x)].radiance[0] / n - 1000.5;
    observed += error * error / pixels;
  }
  const double theory = 1.0 / 12.0 / n;
  // s^2 of a uniform law has relative deviation sqrt(0.8 / n) (kurtosis 1.8), over 400 pixels 0.56 %: 5 sigma.
  EXPECT_NEAR(estimated / theory, 1.0, 0.028);
  // The squared error of one pixel has relative deviation sqrt(2), over 400 pixels 7 %: 4 sigma.
  EXPECT_NEAR(observed / theory, 1.0, 0.28);
}

TEST(Film, BadSamplesAreCountedAndLeftOut) {
  Film film = make_film(1, 1);
  EXPECT_TRUE(add_sample(film, 0, grey_sample(1.0f)));
  EXPECT_FALSE(add_sample(film, 0, grey_sample(std::numeric_limits<float>::quiet_NaN())));
  EXPECT_FALSE(add_sample(film, 0, grey_sample(infinity)));
  EXPECT_FALSE(add_sample(film, 0, grey_sample(-1e-6f)));
  FilmSample failed = grey_sample(1.0f);
  failed.valid = false;
  EXPECT_FALSE(add_sample(film, 0, failed));
  EXPECT_EQ(bad_samples(film), 4u);
  EXPECT_EQ(good_samples(film), 1u);
  EXPECT_EQ(resolve(film).layer("beauty").at(0, 0), 1.0f);
}

TEST(Film, FeaturesThatAreNotFiniteCountAsZeroAndAsMisses) {
  Film film = make_film(1, 1);
  FilmSample s = grey_sample(1.0f, std::numeric_limits<float>::quiet_NaN());
  s.albedo = {infinity, 0.5f, 0.5f};
  s.normal = {0.0f, std::numeric_limits<float>::quiet_NaN(), 1.0f};
  EXPECT_TRUE(add_sample(film, 0, s));
  const ImageLayers layers = resolve(film);
  EXPECT_EQ(layers.layer("albedo").at(0, 0, 0), 0.0f);
  EXPECT_EQ(layers.layer("albedo").at(0, 0, 1), 0.5f);
  EXPECT_EQ(layers.layer("normal").at(0, 0, 1), 0.0f);
  EXPECT_EQ(layers.layer("depth").at(0, 0), infinity);
}

TEST(Film, DepthIsTheMeanOfTheHits) {
  Film film = make_film(2, 1);
  add_sample(film, 0, grey_sample(0.0f, 2.0f));
  add_sample(film, 0, grey_sample(0.0f));
  add_sample(film, 0, grey_sample(0.0f, 5.0f));
  add_sample(film, 1, grey_sample(0.0f));
  const ImageLayers layers = resolve(film);
  EXPECT_EQ(layers.layer("depth").at(0, 0), 3.5f);
  EXPECT_EQ(layers.layer("depth").at(1, 0), infinity);
}

TEST(Film, PixelsWithoutSamplesResolveToZero) {
  const ImageLayers layers = resolve(make_film(3, 2));
  ASSERT_EQ(layers.layers.size(), std::size(film_layer_names));
  for (std::size_t i = 0; i < layers.layers.size(); ++i) {
    EXPECT_EQ(layers.layers[i].name, film_layer_names[i]);
    for (float v : layers.layers[i].pixels) {
      EXPECT_EQ(v, layers.layers[i].name == "depth" ? infinity : 0.0f);
    }
  }
}

TEST(Film, OneSampleHasAnUnknownVarianceOfZero) {
  Film film = make_film(1, 1);
  add_sample(film, 0, grey_sample(3.0f));
  EXPECT_EQ(resolve(film).layer("variance").at(0, 0), 0.0f);
}

/// Adds samples n0 to n1 of every pixel of the film; a sample is a function of the pixel and its number alone.
void add_samples(Film& film, int n0, int n1) {
  const PixelWindow w = film.window;
  parallel_for(static_cast<std::size_t>(w.height), 1, [&](std::size_t begin, std::size_t end) {
    for (int y = w.y + static_cast<int>(begin); y < w.y + static_cast<int>(end); ++y) {
      for (int x = w.x; x < w.x + w.width; ++x) {
        for (int n = n0; n < n1; ++n) {
          std::mt19937 random(static_cast<unsigned>(1 + x + 100 * y + 10000 * n));
          const auto draw = [&] { return static_cast<float>(random() % 1000) / 999.0f; };
          FilmSample s;
          s.radiance = {draw(), draw(), draw()};
          s.albedo = {draw(), draw(), draw()};
          s.normal = {draw(), draw(), draw()};
          s.depth = draw() < 0.3f ? infinity : draw();
          add_sample(film, film.pixel_index(x, y), s);
        }
      }
    }
  });
}

void expect_same_bits(const ImageLayers& a, const ImageLayers& b) {
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (std::size_t i = 0; i < a.layers.size(); ++i) {
    EXPECT_EQ(a.layers[i].pixels, b.layers[i].pixels) << a.layers[i].name;
  }
}

TEST(Film, CropsMergeIntoTheSameBitsAsTheWhole) {
  Film whole = make_film(9, 7);
  add_samples(whole, 0, 5);
  Film pieces = make_film(9, 7);
  for (const PixelWindow window : {PixelWindow{0, 0, 4, 7}, PixelWindow{4, 0, 5, 3}, PixelWindow{4, 3, 5, 4}}) {
    Film piece = make_film(9, 7, window);
    add_samples(piece, 0, 5);
    merge(pieces, piece);
  }
  expect_same_bits(resolve(whole), resolve(pieces));
}

TEST(Film, PassesMergeToTheWholeUpToRounding) {
  Film whole = make_film(5, 4), first = make_film(5, 4), second = make_film(5, 4);
  add_samples(whole, 0, 12);
  add_samples(first, 0, 5);
  add_samples(second, 5, 12);
  merge(first, second);
  const ImageLayers a = resolve(whole), b = resolve(first);
  for (std::size_t i = 0; i < a.layers.size(); ++i) {
    for (std::size_t k = 0; k < a.layers[i].pixels.size(); ++k) {
      const float expected = a.layers[i].pixels[k];
      if (std::isinf(expected)) {
        EXPECT_EQ(b.layers[i].pixels[k], expected);
      } else {
        EXPECT_NEAR(b.layers[i].pixels[k], expected, 2e-6f * std::fabs(expected) + 1e-9f) << a.layers[i].name;
      }
    }
  }
}

TEST(Film, MergeRefusesOtherPicturesAndWindowsThatStickOut) {
  Film film = make_film(8, 8, {2, 2, 4, 4});
  EXPECT_THROW(merge(film, make_film(8, 7, {2, 2, 4, 4})), Error);
  EXPECT_THROW(merge(film, make_film(8, 8)), Error);
  EXPECT_NO_THROW(merge(film, make_film(8, 8, {3, 3, 3, 3})));
}

TEST(Film, RefusesSizesAndCropsThatMakeNoPicture) {
  EXPECT_THROW(make_film(0, 5), Error);
  EXPECT_THROW(make_film(5, -1), Error);
  EXPECT_THROW(make_film(1 << 20, 1 << 20), Error);
  EXPECT_THROW(make_film(10, 10, {0, 0, 0, 5}), Error);
  EXPECT_THROW(make_film(10, 10, {-1, 0, 5, 5}), Error);
  EXPECT_THROW(make_film(10, 10, {6, 0, 5, 5}), Error);
  EXPECT_THROW(make_film(10, 10, {2147483647, 0, 2147483647, 5}), Error);
  const Film film = make_film(10, 10, {6, 5, 4, 5});
  EXPECT_EQ(film.pixel_count(), 20u);
  EXPECT_EQ(film.pixel_index(6, 5), 0u);
  EXPECT_EQ(film.pixel_index(9, 9), 19u);
}

TEST(Film, RelativeErrorOfKnownNoise) {
  // Each pixel: samples 0 and 2 (mean 1, s^2 = 2, variance of the mean 1), in all channels alike.
  Film film = make_film(3, 3);
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    add_sample(film, i, grey_sample(0.0f));
    add_sample(film, i, grey_sample(2.0f));
  }
  EXPECT_NEAR(relative_error(resolve(film)), 1.0, 1e-6);
  EXPECT_EQ(relative_error(resolve(make_film(2, 2))), 0.0);
}

TEST(Film, UnknownLayerListsTheNames) {
  try {
    (void)resolve(make_film(1, 1)).layer("colour");
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("beauty, albedo, normal, depth, samples, variance"), std::string::npos);
  }
}

}  // namespace
}  // namespace embrun

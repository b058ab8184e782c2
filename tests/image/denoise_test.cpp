#include "image/denoise.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <limits>
#include <random>

#include "base/error.h"
#include "image/film.h"
#include "image/metrics.h"

namespace embrun {
namespace {

/// A made-up render of 160 x 120 whose true picture is known: left a checker floor (in the albedo) with a shadow
/// edge (in no feature), right a wall, in the middle a dark ball in front (albedo, normal, depth), above a sky that
/// nothing hits. Every sample is the true radiance times an exponential variable: relative deviation 1.
constexpr int width = 160, height = 120;

FilmSample truth_at(int x, int y) {
  FilmSample s;
  const float dx = static_cast<float>(x) - 80.0f, dy = static_cast<float>(y) - 70.0f;
  const float r2 = (dx * dx + dy * dy) / (30.0f * 30.0f);
  if (r2 < 1.0f) {
    s.normal = {dx / 30.0f, -dy / 30.0f, sqrtf(1.0f - r2)};
    s.albedo = {0.7f, 0.3f, 0.2f};
    s.depth = 3.0f - 0.5f * s.normal.z;
    s.radiance = s.albedo * (0.2f + 0.6f * max_of(0.0f, s.normal.x));
  } else if (y < 40) {
    s.radiance = Rgb{0.4f, 0.6f, 0.9f} * (1.0f - 0.01f * static_cast<float>(y));
  } else if (x < 80) {
    const bool light = (x / 16 + y / 16) % 2 == 0;
    s.albedo = grey(light ? 0.8f : 0.2f);
    s.normal = {0, 1, 0};
    s.depth = 500.0f / static_cast<float>(y);
    s.radiance = s.albedo * (x + y < 120 ? 0.3f : 1.0f);
  } else {
    s.albedo = grey(0.5f);
    s.normal = {-1, 0, 0};
    s.depth = 6.0f;
    s.radiance = grey(0.5f);
  }
  return s;
}

struct Scene {
  ImageLayers noisy;
  Image truth;

  explicit Scene(int samples, unsigned seed = 1, double firefly_probability = 0.0) {
    Film film = make_film(width, height), exact = make_film(width, height);
    std::mt19937 random(seed);
    std::exponential_distribution<float> exponential(1.0f);
    std::uniform_real_distribution<double> uniform;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const FilmSample s = truth_at(x, y);
        add_sample(exact, film.pixel_index(x, y), s);
        for (int n = 0; n < samples; ++n) {
          FilmSample with_noise = s;
          with_noise.radiance *= exponential(random) * (uniform(random) < firefly_probability ? 1000.0f : 1.0f);
          add_sample(film, film.pixel_index(x, y), with_noise);
        }
      }
    }
    noisy = resolve(film);
    truth = resolve(exact).layers[0];
  }
};

/// Root mean square error over the pixels that the condition picks.
template <class Condition>
double error_where(const Image& image, const Image& truth, const Condition& condition) {
  double sum = 0, count = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3 && condition(x, y); ++c) {
        const double d = static_cast<double>(image.at(x, y, c)) - static_cast<double>(truth.at(x, y, c));
        sum += d * d;
        count += 1;
      }
    }
  }
  return std::sqrt(sum / count);
}

/// Pixels with a neighbour of another truth: both sides of an edge.
bool at_edge_of(const Image& truth, int x, int y) {
  for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j) {
    for (int i = std::max(0, x - 1); i <= std::min(width - 1, x + 1); ++i) {
      if (std::fabs(truth.at(i, j, 1) - truth.at(x, y, 1)) > 0.05f) {
        return true;
      }
    }
  }
  return false;
}

TEST(Denoise, ErrorFallsByAtLeastTwoAndAHalf) {
  for (int samples : {8, 32, 128}) {
    const Scene scene(samples);
    const Image result = denoise(scene.noisy);
    const double before = root_mean_squared_error(scene.noisy.layers[0], scene.truth);
    const double after = root_mean_squared_error(result, scene.truth);
    RecordProperty("gain_at_" + std::to_string(samples), std::to_string(before / after));
    EXPECT_GT(before / after, 2.5) << samples << " samples: " << before << " -> " << after;
    // Skewed noise costs a little brightness, no more.
    EXPECT_NEAR(mean_value(result) / mean_value(scene.truth), 1.0, 0.01);
  }
}

TEST(Denoise, EdgesInTheFeaturesStay) {
  const Scene scene(16);
  const Image result = denoise(scene.noisy);
  // Edges of the checker (albedo) away from the shadow; rim of the ball (all features): the error there falls too,
  // which it would not if the sides ran into each other (a mix of 0.8 and 0.2 errs by up to 0.3).
  const auto checker = [&](int x, int y) { return x < 48 && y >= 42 && x + y > 130 && at_edge_of(scene.truth, x, y); };
  const auto rim = [&](int x, int y) {
    const double r = std::hypot(x - 80, y - 70);
    return r > 28 && r < 32;
  };
  const Image& noisy = scene.noisy.layers[0];
  EXPECT_LT(error_where(result, scene.truth, checker), 0.5 * error_where(noisy, scene.truth, checker));
  EXPECT_LT(error_where(result, scene.truth, rim), 0.6 * error_where(noisy, scene.truth, rim));

  // The step across an albedo edge, averaged along it: full height from one pixel to the next.
  double light = 0, dark = 0, true_light = 0, true_dark = 0;
  for (int y = 82; y < 94; ++y) {  // x 47 | 48 in the row of squares y = 80..95
    light += static_cast<double>(result.at(47, y));
    dark += static_cast<double>(result.at(48, y));
    true_light += static_cast<double>(scene.truth.at(47, y));
    true_dark += static_cast<double>(scene.truth.at(48, y));
  }
  EXPECT_NEAR((light - dark) / (true_light - true_dark), 1.0, 0.15);
}

TEST(Denoise, AnEdgeInNoFeatureSurvives) {
  const Scene scene(64);
  const Image result = denoise(scene.noisy);
  // The shadow's edge x + y = 120 on the floor, along its pixels: lit minus shadowed, two pixels to either side.
  double step = 0, true_step = 0;
  for (int x = 30; x < 70; ++x) {
    step += static_cast<double>(result.at(x, 122 - x, 1) - result.at(x, 117 - x, 1));
    true_step += static_cast<double>(scene.truth.at(x, 122 - x, 1) - scene.truth.at(x, 117 - x, 1));
  }
  EXPECT_NEAR(step / true_step, 1.0, 0.1);
}

TEST(Denoise, ConstantAndNoiseFreePicturesStayAsTheyAre) {
  Scene scene(2);
  for (float& v : scene.noisy.find("beauty")->pixels) {
    v = 0.7f;
  }
  EXPECT_EQ(denoise(scene.noisy).pixels, scene.noisy.layer("beauty").pixels);
  // No noise by the variance layer: every difference is real.
  *scene.noisy.find("beauty") = scene.truth;
  for (float& v : scene.noisy.find("variance")->pixels) {
    v = 0.0f;
  }
  EXPECT_LT(root_mean_squared_error(denoise(scene.noisy), scene.truth), 1e-3);
}

TEST(Denoise, FirefliesDoNotSpread) {
  // One sample in 10^4 is 1000 times too bright: about 60 pixels of 19200 with 32 samples.
  const Scene scene(32, 5, 1e-4);
  const Image result = denoise(scene.noisy);
  std::size_t before = 0, after = 0;
  for (std::size_t i = 0; i < result.pixels.size(); ++i) {
    before += scene.noisy.layers[0].pixels[i] > 2.0f * scene.truth.pixels[i] + 0.5f ? 1u : 0u;
    after += result.pixels[i] > 2.0f * scene.truth.pixels[i] + 0.5f ? 1u : 0u;
  }
  EXPECT_GT(before, 100u);
  EXPECT_LE(after, before / 50);
  // They are a tenth of the light, which is kept: but for what is above 64 times the neighbours. A firefly is
  // 1000 X / 32 = 31 X times as bright, X exponential, so that is exp(-64 / 31) = 13 % of the tenth.
  EXPECT_NEAR(mean_value(result) / mean_value(scene.noisy.layers[0]), 1.0 - 0.013, 0.02);
}

TEST(Denoise, AGlintThatAllSamplesAgreeOnStays) {
  Scene scene(16);
  Image& beauty = *scene.noisy.find("beauty");
  Image& variance = *scene.noisy.find("variance");
  for (int c = 0; c < 3; ++c) {
    beauty.at(120, 90, c) = 20.0f;
    variance.at(120, 90, c) = 0.25f;  // standard error 0.5
  }
  const Image result = denoise(scene.noisy);
  EXPECT_GT(result.at(120, 90), 18.0f);
  EXPECT_LT(result.at(121, 90), 1.0f);
}

TEST(Denoise, TheSameBitsAtAnyThreadCount) {
  const Scene scene(4);
  const tbb::global_control workers(tbb::global_control::max_allowed_parallelism, 7);  // on fewer cores, too
  std::vector<Image> results;
  for (int threads : {1, 2, 7}) {
    tbb::task_arena arena(threads);
    arena.execute([&] { results.push_back(denoise(scene.noisy)); });
  }
  EXPECT_EQ(results[0].pixels, results[1].pixels);
  EXPECT_EQ(results[0].pixels, results[2].pixels);
}

TEST(Denoise, WorksWithoutFeaturesOrVariance) {
  const Scene scene(16);
  const double before = root_mean_squared_error(scene.noisy.layers[0], scene.truth);
  ImageLayers no_features = scene.noisy;
  std::erase_if(no_features.layers, [](const Image& i) { return i.name != "beauty" && i.name != "variance"; });
  EXPECT_LT(root_mean_squared_error(denoise(no_features), scene.truth), before / 1.8);
  ImageLayers beauty_alone = scene.noisy;
  beauty_alone.layers.resize(1);
  EXPECT_LT(root_mean_squared_error(denoise(beauty_alone), scene.truth), before / 1.5);
  EXPECT_THROW(denoise(ImageLayers{}), Error);
}

TEST(Denoise, OneSampleAPixelCountsAsUnknownVariance) {
  const Scene scene(1);
  const double before = root_mean_squared_error(scene.noisy.layers[0], scene.truth);
  EXPECT_LT(root_mean_squared_error(denoise(scene.noisy), scene.truth), before / 2.5);
}

TEST(Denoise, OddSizesAndBadValuesGiveFinitePictures) {
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 37}, {53, 1}, {2, 2}, {65, 3}, {64, 64}}) {
    Film film = make_film(w, h);
    std::mt19937 random(3);
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
      for (unsigned n = random() % 4; n > 0; --n) {  // some pixels without a sample
        FilmSample s;
        s.radiance = grey(static_cast<float>(random() % 100) / 50.0f);
        s.depth = random() % 2 == 0 ? infinity : 1.0f;
        add_sample(film, i, s);
      }
    }
    ImageLayers layers = resolve(film);
    layers.layers[0].pixels[0] = std::numeric_limits<float>::quiet_NaN();
    for (Image& layer : layers.layers) {
      layer.pixels.back() = std::numeric_limits<float>::infinity();
    }
    const Image result = denoise(layers);
    EXPECT_EQ(result.width, w);
    EXPECT_EQ(result.height, h);
    for (float v : result.pixels) {
      EXPECT_TRUE(is_finite(v) && v >= 0.0f);
    }
  }
}

}  // namespace
}  // namespace embrun

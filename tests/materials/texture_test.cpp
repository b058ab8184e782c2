#include "materials/texture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "materials/material.h"

namespace embrun {
namespace {

Texture floor_checker() {
  Texture t;
  t.kind = TextureKind::checker;
  t.cell = 0.25f;
  t.first = grey(0.8f);
  t.second = grey(0.2f);
  return t;
}

TEST(Texture, CheckerCells) {
  const Texture t = floor_checker();
  EXPECT_EQ(evaluate_texture(t, {0.1f, 9, 0.1f}, {}).r, 0.8f);    // cell (0, 0)
  EXPECT_EQ(evaluate_texture(t, {0.3f, 9, 0.1f}, {}).r, 0.2f);    // (1, 0)
  EXPECT_EQ(evaluate_texture(t, {-0.1f, 9, 0.1f}, {}).r, 0.2f);   // (-1, 0)
  EXPECT_EQ(evaluate_texture(t, {-0.1f, 9, -0.1f}, {}).r, 0.8f);  // (-1, -1)
  EXPECT_EQ(evaluate_texture(t, {-0.3f, 9, 0.6f}, {}).r, 0.8f);   // (-2, 2)
  EXPECT_EQ(evaluate_texture(t, {-0.3f, 9, 0.8f}, {}).r, 0.2f);   // (-2, 3)
}

TEST(Texture, CheckerFollowsItsOriginAndAxes) {
  Texture t = floor_checker();
  t.origin = {0.25f, 0, 0};
  EXPECT_EQ(evaluate_texture(t, {0.1f, 0, 0.1f}, {}).r, 0.2f);
  t = floor_checker();
  t.axis_v = 1;  // a floor of a scene with z up
  EXPECT_EQ(evaluate_texture(t, {0.1f, 0.3f, 0.1f}, {}).r, 0.2f);
  EXPECT_EQ(evaluate_texture(t, {0.1f, 0.1f, 0.3f}, {}).r, 0.8f);
}

TEST(Texture, Constant) { EXPECT_EQ(evaluate_texture(constant_texture({1, 2, 3}), {4, 5, 6}, {}), (Rgb{1, 2, 3})); }

// Cells of half a unit, so that the pattern repeats with every whole one.
TEST(Texture, UvChecker) {
  Texture t = floor_checker();
  t.kind = TextureKind::uv_checker;
  const auto at = [&](float u, float v) { return evaluate_texture(t, {9, 9, 9}, {u, v}).r; };
  EXPECT_EQ(at(0.25f, 0.25f), 0.8f);
  EXPECT_EQ(at(0.75f, 0.25f), 0.2f);
  EXPECT_EQ(at(0.75f, 0.75f), 0.8f);
  EXPECT_EQ(at(-0.25f, 0.25f), 0.2f);
  EXPECT_EQ(at(3.25f, -1.75f), 0.8f);
  // Turned by a quarter and moved: (u, v) -> (v + 0.5, 2 u).
  t.u_axis = {0, 1, 0.5f};
  t.v_axis = {2, 0, 0};
  EXPECT_EQ(at(0.1f, 0.25f), 0.2f);
  EXPECT_EQ(at(0.3f, 0.25f), 0.8f);
}

/// Two rows of two pixels: 0 1 above 2 3.
const float four[] = {0, 1, 2, 3};

Texture four_pixels(TextureWrap wrap, TextureFilter filter = TextureFilter::bilinear) {
  Texture t;
  t.kind = TextureKind::bitmap;
  t.wrap = wrap;
  t.filter = filter;
  t.picture = {four, 2, 2, 1};
  return t;
}

float shown(const Texture& t, float u, float v) { return evaluate_texture(t, {}, {u, v}).g; }

// Pixels' middles at 1/4 and 3/4; between them the mean; the first row at v = 0.
TEST(Texture, BitmapIsBilinear) {
  const Texture t = four_pixels(TextureWrap::clamp);
  EXPECT_FLOAT_EQ(shown(t, 0.25f, 0.25f), 0);
  EXPECT_FLOAT_EQ(shown(t, 0.75f, 0.25f), 1);
  EXPECT_FLOAT_EQ(shown(t, 0.25f, 0.75f), 2);
  EXPECT_FLOAT_EQ(shown(t, 0.5f, 0.5f), 1.5f);
  EXPECT_FLOAT_EQ(shown(t, 0.375f, 0.25f), 0.25f);
  EXPECT_FLOAT_EQ(shown(t, 0.25f, 0.625f), 1.5f);
}

// A row 0 1 continues as 0 1 0 1, as 0 1 1 0 0 1, and as 1 1 1. At a picture's edge half of each neighbour shows.
TEST(Texture, BitmapGoesOnOutside) {
  const Texture repeat = four_pixels(TextureWrap::repeat), mirror = four_pixels(TextureWrap::mirror),
                clamped = four_pixels(TextureWrap::clamp);
  EXPECT_FLOAT_EQ(shown(repeat, 1.0f, 0.25f), 0.5f);
  EXPECT_FLOAT_EQ(shown(repeat, 0.0f, 0.25f), 0.5f);
  EXPECT_FLOAT_EQ(shown(repeat, 1.25f, 0.25f), 0);
  EXPECT_FLOAT_EQ(shown(repeat, -0.25f, 0.25f), 1);
  EXPECT_FLOAT_EQ(shown(mirror, 1.0f, 0.25f), 1);
  EXPECT_FLOAT_EQ(shown(mirror, 1.25f, 0.25f), 1);
  EXPECT_FLOAT_EQ(shown(mirror, 1.75f, 0.25f), 0);
  EXPECT_FLOAT_EQ(shown(mirror, 2.0f, 0.25f), 0);
  EXPECT_FLOAT_EQ(shown(mirror, -0.25f, 0.25f), 0);
  EXPECT_FLOAT_EQ(shown(mirror, -0.75f, 0.25f), 1);
  EXPECT_FLOAT_EQ(shown(clamped, 7, 0.25f), 1);
  EXPECT_FLOAT_EQ(shown(clamped, -7, -7), 0);
}

TEST(Texture, BitmapWithoutFilter) {
  const Texture t = four_pixels(TextureWrap::repeat, TextureFilter::nearest);
  EXPECT_EQ(shown(t, 0.49f, 0.49f), 0);
  EXPECT_EQ(shown(t, 0.51f, 0.49f), 1);
  EXPECT_EQ(shown(t, 1.49f, -0.01f), 2);
}

TEST(Texture, BitmapOfColours) {
  const float pixels[] = {1, 2, 3, 4, 5, 6};
  Texture t = four_pixels(TextureWrap::clamp);
  t.picture = {pixels, 2, 1, 3};
  EXPECT_EQ(evaluate_texture(t, {}, {1, 0.5f}), (Rgb{4, 5, 6}));
  EXPECT_EQ(evaluate_texture(t, {}, {0.5f, 0.5f}), (Rgb{2.5f, 3.5f, 4.5f}));
}

// Whatever the coordinates, a pixel of the picture is shown.
TEST(Texture, BitmapTakesAnyCoordinates) {
  for (const TextureWrap wrap : {TextureWrap::repeat, TextureWrap::mirror, TextureWrap::clamp})
    for (const TextureFilter filter : {TextureFilter::bilinear, TextureFilter::nearest})
      for (const float u : {-1e30f, -1e9f, -1e-9f, 0.99999994f, 1.9999999f, 1e9f, 3e38f, infinity, std::nanf("")}) {
        const float value = shown(four_pixels(wrap, filter), u, -u);
        EXPECT_GE(value, 0);
        EXPECT_LE(value, 3);
      }
}

TEST(Material, OneSidedSurfacesAreAbsentFromBehind) {
  Material m;
  m.one_sided = true;
  m.reflectance = constant_texture(grey(0.7f));
  EXPECT_EQ(bsdf_at(m, {}, true, 1).kind, BsdfKind::diffuse);
  EXPECT_EQ(bsdf_at(m, {}, true, 1).reflectance.g, 0.7f);
  EXPECT_EQ(bsdf_at(m, {}, false, 1).kind, BsdfKind::null);
  m.one_sided = false;
  EXPECT_EQ(bsdf_at(m, {}, false, 1).kind, BsdfKind::diffuse);
}

}  // namespace
}  // namespace embrun

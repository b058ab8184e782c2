#include "materials/texture.h"

#include <gtest/gtest.h>

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

// Pictures of the same particles by independent renderers (tests/data/reference/README.md), which had a triangle mesh of
// the surface in place of the surface itself.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "image/metrics.h"
#include "io/file_bytes.h"
#include "io/image_read.h"
#include "io/read_particles.h"
#include "io/read_scene.h"
#include "render/render_loop.h"
#include "render/scene_file_meshes.h"

namespace embrun {
namespace {

/// The floor of the reference scenes: square, seen from above only, light where floor(x/cell) + floor(z/cell) is even.
PatchDescription checker_floor(double half_side, double cell) {
  PatchDescription floor;
  floor.center = {0, -0.05, 0};
  floor.axis_u = {0, 0, 1};
  floor.axis_v = {1, 0, 0};
  floor.half_u = floor.half_v = half_side;
  floor.material = diffuse_material({0.8f, 0.8f, 0.8f});
  floor.material.one_sided = true;
  floor.material.reflectance.kind = TextureKind::checker;
  floor.material.reflectance.second = {0.2f, 0.2f, 0.2f};
  floor.material.reflectance.cell = cell;
  return floor;
}

/// Water of the file's particles as the reference meshes were made: hard recovery, gradient normals, T = D_in/2.
FluidDescription reference_water(const std::string& file, int order, double radius) {
  FluidDescription fluid;
  fluid.positions = read_particles(std::string(EMBRUN_DATA_DIR) + "/" + file).positions;
  fluid.surface.order = order;
  fluid.surface.radius = static_cast<float>(radius);
  fluid.surface.recover = RecoverMode::thesis;
  fluid.surface.normal = NormalMode::gradient;
  fluid.surface.threshold_mode = ThresholdMode::number;
  fluid.surface.threshold = order == 3 ? 10.415897f : 3.086192f;
  fluid.material = dielectric_material(1.33);
  return fluid;
}

/// The drop at a quarter of the reference's resolution: a pixel is four by four of its pixels (box filter).
SceneDescription drop_scene(int order, int samples) {
  SceneDescription scene;
  scene.fluids.push_back(reference_water("droplets.ply", order, 0.0375));
  scene.patches.push_back(checker_floor(6, 0.25));
  scene.camera.eye = {1.7, 1.7, 3.1};
  scene.camera.target = {-0.06, 0.62, 0.25};
  scene.camera.vertical_fov = 40;
  scene.film.width = scene.film.height = 128;
  scene.integrator.samples = samples;
  scene.integrator.max_depth = 64;
  return scene;
}

Image grey_of(const Image& colour) {
  Image grey = make_image(colour.width, colour.height, 1);
  for (std::size_t i = 0; i < grey.pixels.size(); ++i) {
    grey.pixels[i] = (colour.pixels[3 * i] + colour.pixels[3 * i + 1] + colour.pixels[3 * i + 2]) / 3.0f;
  }
  return grey;
}

/// The mean of each 4 x 4 pixels.
Image quarter_of(const Image& full) {
  Image small = make_image(full.width / 4, full.height / 4, 1);
  for (int y = 0; y < small.height * 4; ++y) {
    for (int x = 0; x < small.width * 4; ++x) {
      small.pixels[static_cast<std::size_t>(y / 4 * small.width + x / 4)] +=
          full.pixels[static_cast<std::size_t>(y * full.width + x)] / 16.0f;
    }
  }
  return small;
}

struct Agreement {
  double ratio, ratio_error;  ///< of the means, and its standard error
  double share;               ///< of the blocks within 2.5 % beyond noise
};

/// `reference_error`: standard error of a full pixel of the reference, of which sixteen make one of its copy.
Agreement compare(const RenderResult& result, const std::string& reference_file, double reference_error) {
  Image beauty = grey_of(result.layers.layer("beauty"));
  Image variance = grey_of(result.layers.layer("variance"));
  const Image reference = read_image(std::string(EMBRUN_TEST_DATA_DIR) + "/reference/" + reference_file);
  Image reference_variance = make_image(reference.width, reference.height, 1);
  for (float& v : reference_variance.pixels) v = static_cast<float>(reference_error * reference_error / 16);
  if (beauty.width == 4 * reference.width) {
    beauty = quarter_of(beauty);
    variance = quarter_of(variance);
    for (float& v : variance.pixels) v /= 16;
  }
  EXPECT_EQ(beauty.width, reference.width);
  EXPECT_EQ(beauty.height, reference.height);

  Agreement agreement;
  agreement.ratio = mean_value(beauty) / mean_value(reference);
  const auto pixels = static_cast<double>(beauty.pixels.size());
  agreement.ratio_error =
      std::sqrt((mean_value(variance) + mean_value(reference_variance)) / pixels) / mean_value(reference);
  // Blocks of 2 x 2 are 8 x 8 pixels of the full picture. One standard error: the variance of a Sobol pixel is
  // overestimated, and two would hide a difference of several per cent.
  agreement.share = share_within(compare_blocks(beauty, reference, &variance, &reference_variance, 2), 0.025, 1.0);
  return agreement;
}

TEST(Reference, DropOfOrderThree) {
  const RenderResult result = render(drop_scene(3, 128));
  const Agreement mitsuba = compare(result, "drop_small_n3_mitsuba.pfm", 0.043);
  EXPECT_NEAR(mitsuba.ratio, 1.0, 0.001 + 2 * mitsuba.ratio_error);
  EXPECT_GE(mitsuba.share, 0.95);
  const Agreement pbrt = compare(result, "drop_small_n3_pbrt.pfm", 0.0308);
  EXPECT_NEAR(pbrt.ratio, 1.0, 0.001 + 2 * pbrt.ratio_error);
  EXPECT_GE(pbrt.share, 0.95);
  EXPECT_EQ(result.counts.paths.contradictions, 0u);
}

TEST(Reference, DropOfOrderTwo) {
  const RenderResult result = render(drop_scene(2, 128));
  const Agreement pbrt = compare(result, "drop_small_n2_pbrt.pfm", 0.0303);
  EXPECT_NEAR(pbrt.ratio, 1.0, 0.001 + 2 * pbrt.ratio_error);
  EXPECT_GE(pbrt.share, 0.95);
  EXPECT_EQ(result.counts.paths.contradictions, 0u);
}

TEST(Reference, DamBreak) {
  SceneDescription scene;
  scene.fluids.push_back(reference_water("dam_break.bgeo", 3, 0.025));
  scene.patches.push_back(checker_floor(8, 0.5));
  scene.camera.eye = {-4.4, 3.9, 6.4};
  scene.camera.target = {0, 1.15, 0};
  scene.camera.vertical_fov = 40;
  scene.film.width = 768;
  scene.film.height = 574;
  scene.film.crop = PixelWindow{0, 0, 768, 568};
  scene.integrator.samples = 8;
  scene.integrator.max_depth = 64;
  const RenderResult result = render(scene);
  const Agreement mitsuba = compare(result, "dambreak_mitsuba.pfm", 0.081);
  EXPECT_NEAR(mitsuba.ratio, 1.0, 0.003);
  EXPECT_GE(mitsuba.share, 0.95);
  const Agreement pbrt = compare(result, "dambreak_pbrt.pfm", 0.0534);
  EXPECT_NEAR(pbrt.ratio, 1.0, 0.003);
  EXPECT_GE(pbrt.share, 0.95);
  EXPECT_EQ(result.counts.paths.contradictions, 0u);
}

/// What the particles of the drop do to light: extinction by the file's own column, albedo 0.9, g = 0.5.
ParticleMediumDescription reference_milk(const ParticleSet& particles) {
  ParticleMediumDescription milk;
  milk.albedo = grey(0.9f);
  milk.phase = {PhaseKind::henyey_greenstein, 0.5f};
  for (const float k : particles.find("extinction")->floats) milk.extinctions.push_back(grey(k));
  return milk;
}

TEST(Reference, MilkyDrop) {
  SceneDescription scene = drop_scene(3, 128);
  scene.fluids[0].medium = reference_milk(read_particles(std::string(EMBRUN_DATA_DIR) + "/droplets.ply"));
  scene.integrator.max_depth = 200;
  const RenderResult result = render(scene);
  const Agreement pbrt = compare(result, "milky_pbrt.pfm", 0.0350);
  EXPECT_NEAR(pbrt.ratio, 1.0, 0.001 + 2 * pbrt.ratio_error);
  EXPECT_GE(pbrt.share, 0.95);
  const Agreement mitsuba = compare(result, "milky_mitsuba.pfm", 0.044);
  EXPECT_NEAR(mitsuba.ratio, 1.0, 0.001 + 2 * mitsuba.ratio_error);
  EXPECT_GE(mitsuba.share, 0.95);
  EXPECT_EQ(result.counts.paths.contradictions, 0u);
  EXPECT_EQ(result.counts.paths.majorants, 0u);
}

// The same particles in air, without a surface.
TEST(Reference, Fog) {
  const ParticleSet particles = read_particles(std::string(EMBRUN_DATA_DIR) + "/droplets.ply");
  SceneDescription scene = drop_scene(3, 128);
  scene.fluids.clear();
  VolumeDescription fog;
  fog.positions = particles.positions;
  fog.radius = 0.0375;
  fog.medium = reference_milk(particles);
  scene.volumes.push_back(fog);
  scene.integrator.max_depth = 200;
  const RenderResult result = render(scene);
  const Agreement pbrt = compare(result, "fog_pbrt.pfm", 0.0359);
  EXPECT_NEAR(pbrt.ratio, 1.0, 0.001 + 2 * pbrt.ratio_error);
  EXPECT_GE(pbrt.share, 0.95);
  EXPECT_EQ(result.counts.paths.majorants, 0u);

  // The judge can tell other fog.
  scene.volumes[0].medium.phase.g = 0.4f;
  scene.integrator.samples = 64;
  const Agreement other = compare(render(scene), "fog_pbrt.pfm", 0.0359);
  EXPECT_TRUE(std::abs(other.ratio - 1) > 0.001 + 2 * other.ratio_error || other.share < 0.95);
}

/// The mean extinction of the droplets' balls in the cells of a grid over the references' box, as Mitsuba's binary format
/// has it: two points along each side of a cell, of about a third of a ball's radius.
std::string droplets_on_a_grid() {
  constexpr int nx = 117, ny = 124, nz = 88, points = 2;
  constexpr Vec3d low{-0.79375, -0.01875, -0.26875}, size{1.4625, 1.54375, 1.09375};
  constexpr std::array<int, 3> n{points * nx, points * ny, points * nz};
  const auto at = [&](int x, int y, int z) {
    return (static_cast<std::size_t>(z) * n[1] + static_cast<std::size_t>(y)) * n[0] + static_cast<std::size_t>(x);
  };
  std::vector<float> sum(at(0, 0, n[2])), count(sum.size());
  const ParticleSet particles = read_particles(std::string(EMBRUN_DATA_DIR) + "/droplets.ply");
  const std::vector<float>& extinction = particles.find("extinction")->floats;
  constexpr double radius = 0.0375;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vec3d p = particles.positions[i], from = p - low;
    const auto limit = [](double share, int points_along) {
      return std::clamp(static_cast<int>(std::floor(share * points_along)), 0, points_along - 1);
    };
    for (int z = limit((from.z - radius) / size.z, n[2]); z <= limit((from.z + radius) / size.z, n[2]); ++z)
      for (int y = limit((from.y - radius) / size.y, n[1]); y <= limit((from.y + radius) / size.y, n[1]); ++y)
        for (int x = limit((from.x - radius) / size.x, n[0]); x <= limit((from.x + radius) / size.x, n[0]); ++x) {
          const Vec3d point{low.x + (x + 0.5) * size.x / n[0], low.y + (y + 0.5) * size.y / n[1],
                            low.z + (z + 0.5) * size.z / n[2]};
          if (length(point - p) >= radius) continue;
          sum[at(x, y, z)] += extinction[i];
          ++count[at(x, y, z)];
        }
  }
  std::string file("VOL\x03\x01\0\0\0", 8);
  const auto append = [&](const auto& value) { file.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const std::int32_t cells : {nx, ny, nz, 1}) append(cells);
  for (const float corner : {0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f}) append(corner);
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        float mean = 0;
        for (int i = 0; i < 8; ++i) {
          const std::size_t point = at(points * x + (i & 1), points * y + (i >> 1 & 1), points * z + (i >> 2));
          if (count[point] > 0) mean += sum[point] / count[point] / 8;
        }
        append(mean);
      }
  return file;
}

// The very file that Mitsuba was given for the fog, with its floor, its box and its grid made anew.
TEST(Reference, FogOnAGridFromItsSceneFile) {
  const auto read = [&](const std::string& path) {
    const std::string name = std::filesystem::path(path).filename();
    if (name == "floor3_light.ply") return testing_support::bytes_of(testing_support::floor_ply(6, 0.25, true));
    if (name == "floor3_dark.ply") return testing_support::bytes_of(testing_support::floor_ply(6, 0.25, false));
    if (name == "box_s6.ply")
      return testing_support::bytes_of(
          testing_support::box_ply({-0.79375, -0.01875, -0.26875}, {0.66875, 1.525, 0.825}));
    if (name == "medium_s5.vol") return testing_support::bytes_of(droplets_on_a_grid());
    return read_file_bytes(path);
  };
  const SceneFile file = read_scene(std::string(EMBRUN_TEST_DATA_DIR) + "/fog/scene.m3.xml", {}, read);
  // Which format a picture has its file's name says.
  EXPECT_EQ(file.warnings.size(), 2u);
  SceneDescription scene = file.scene;
  ASSERT_EQ(scene.grid_media.size(), 1u);
  EXPECT_EQ(scene.integrator.max_depth, 200);
  scene.film.width = scene.film.height = 128;
  scene.integrator.samples = 128;
  scene.integrator.sampler = SamplerKind::sobol;
  const RenderResult result = render(scene);
  const Agreement pbrt = compare(result, "fog_pbrt.pfm", 0.0359);
  EXPECT_NEAR(pbrt.ratio, 1.0, 0.001 + 2 * pbrt.ratio_error);
  EXPECT_GE(pbrt.share, 0.95);
  EXPECT_EQ(result.counts.paths.majorants, 0u);
  EXPECT_EQ(result.counts.paths.contradictions, 0u);
}

// The judge can tell: another index of refraction, or another threshold, is seen at once.
TEST(Reference, AnotherWaterDisagrees) {
  SceneDescription scene = drop_scene(3, 32);
  scene.fluids[0].material.ior = 1.36;
  const Agreement denser = compare(render(scene), "drop_small_n3_pbrt.pfm", 0.0308);
  EXPECT_LT(denser.share, 0.93);
  scene = drop_scene(3, 32);
  scene.fluids[0].surface.threshold *= 1.1f;
  const Agreement thinner = compare(render(scene), "drop_small_n3_pbrt.pfm", 0.0308);
  EXPECT_LT(thinner.share, 0.93);
}

}  // namespace
}  // namespace embrun

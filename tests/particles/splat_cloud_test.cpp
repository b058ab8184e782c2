// From points to splats as a whole, against surfaces known in closed form; and scans, where a folder has them.

#include "particles/splat_cloud.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include "base/error.h"
#include "io/read_particles.h"
#include "particles/cloud_kind.h"
#include "particles/cloud_shapes.h"

namespace embrun {
namespace {

using namespace test;

Attribute vectors(const char* name, const std::vector<Vec3d>& values) {
  Attribute attribute;
  attribute.name = name;
  attribute.components = 3;
  for (const Vec3d v : values) {
    for (const double x : {v.x, v.y, v.z}) attribute.floats.push_back(static_cast<float>(x));
  }
  return attribute;
}

/// The points of a surface, each with its number as the attribute "number".
ParticleSet numbered(const SampledSurface& surface, bool with_normals = false) {
  ParticleSet set;
  set.positions = surface.points;
  Attribute number;
  number.name = "number";
  number.type = AttributeType::int32;
  for (std::size_t i = 0; i < set.size(); ++i) number.ints.push_back(static_cast<std::int32_t>(i));
  set.attributes.push_back(number);
  if (with_normals) set.attributes.push_back(vectors("normal", surface.normals));
  return set;
}

std::size_t number_of(const SplatCloud& cloud, std::size_t i) {
  return static_cast<std::size_t>(cloud.particles.find("number")->ints[i]);
}

SampledSurface part_of(const SampledSurface& surface, const std::function<bool(Vec3d)>& keep) {
  SampledSurface part;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    if (!keep(surface.exact[i])) continue;
    part.points.push_back(surface.points[i]);
    part.normals.push_back(surface.normals[i]);
    part.exact.push_back(surface.exact[i]);
  }
  return part;
}

TEST(SplatCloud, TellsClosedFromOpen) {
  const SampledSurface sphere = sample_sphere(8000, 0), torus = sample_torus(8000, 0), box = sample_box(8000, 0);
  struct Case {
    const char* name;
    SampledSurface surface;
    bool closed;
  };
  const Case cases[] = {{"sphere", sphere, true},
                        {"torus", torus, true},
                        {"box", box, true},
                        {"noisy sphere", sample_sphere(8000, 0.01), true},
                        {"half a sphere", part_of(sphere, [](Vec3d p) { return p.z > 0; }), false},
                        {"a hole of 1 %", part_of(sample_sphere(30000, 0), [](Vec3d p) { return p.x < 0.98; }), false},
                        {"a box without one face", part_of(box, [](Vec3d p) { return p.y < 1; }), false},
                        {"a square", part_of(box, [](Vec3d p) { return p.y == 1; }), false},
                        {"half a torus", part_of(torus, [](Vec3d p) { return p.x > 0; }), false}};
  for (const Case& one : cases) {
    for (const bool given : {true, false}) {
      const SplatCloud cloud = make_splats(numbered(one.surface, given), {}, one.name);
      EXPECT_EQ(cloud.closed, one.closed)
          << one.name << (given ? ", its normals: " : ", estimated normals: ") << cloud.report.open_share;
    }
  }
  // A room seen from inside bounds no body.
  SampledSurface room = box;
  for (Vec3d& n : room.normals) n = n * -1.0;
  EXPECT_FALSE(make_splats(numbered(room, true), {}, "room").closed);
  SplatOptions options;
  options.closed = true;
  EXPECT_TRUE(make_splats(numbered(room, true), options, "room").closed);
}

TEST(SplatCloud, KeepsEveryPointsOwnAttributesAndNormal) {
  SampledSurface sphere = sample_sphere(3000, 0);
  for (std::size_t i = 0; i < 50; ++i) {
    sphere.points.push_back(sphere.points[i]);
    sphere.normals.push_back(sphere.normals[i]);
  }
  sphere.points.push_back({0, 0, 5});
  sphere.normals.push_back({0, 0, 1});
  SplatOptions options;
  options.thin = 0.02;
  const SplatCloud cloud = make_splats(numbered(sphere, true), options, "sphere");
  EXPECT_EQ(cloud.report.points_in, 3051u);
  EXPECT_EQ(cloud.report.duplicates, 50u);
  EXPECT_EQ(cloud.report.outliers, 1u);
  EXPECT_GT(cloud.report.thinned, 0u);
  EXPECT_EQ(cloud.size(), 3000 - cloud.report.thinned);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::size_t n = number_of(cloud, i);
    ASSERT_LT(n, 3000u);
    EXPECT_EQ(cloud.particles.positions[i], sphere.points[n]);
    EXPECT_NEAR(dot(to_double(cloud.normals[i]), sphere.normals[n]), 1, 1e-6);
  }
  options = {};
  options.outlier_ratio = 0;
  options.keep_duplicates = true;
  EXPECT_EQ(make_splats(numbered(sphere, true), options, "sphere").size(), 3051u);
}

// sRGB 188/255 is linear 0.5029 (IEC 61966-2-1), 1 is 1.
TEST(SplatCloud, ColoursBecomeLinear) {
  const SampledSurface sphere = sample_sphere(100, 0);
  for (const double full : {1.0, 255.0}) {
    ParticleSet set = numbered(sphere, true);
    set.attributes.push_back(vectors("color", std::vector<Vec3d>(100, Vec3d{188.0 / 255, 0, 1} * full)));
    const SplatCloud cloud = make_splats(set, {}, "sphere");
    ASSERT_EQ(cloud.colours.size(), 100u);
    for (const Rgb c : cloud.colours) {
      EXPECT_NEAR(c.r, 0.5029f, 1e-4f);
      EXPECT_EQ(c.g, 0);
      EXPECT_EQ(c.b, 1);
    }
  }
  EXPECT_TRUE(make_splats(numbered(sphere, true), {}, "sphere").colours.empty());
}

TEST(SplatCloud, MendsNormalsThatAreZero) {
  SampledSurface sphere = sample_sphere(3000, 0);
  const std::vector<Vec3d> exact = sphere.normals;
  for (std::size_t i = 0; i < 3000; i += 3) sphere.normals[i] = {0, 0, 0};
  const SplatCloud cloud = make_splats(numbered(sphere, true), {}, "sphere");
  EXPECT_EQ(cloud.report.normals, NormalSource::file);
  EXPECT_EQ(cloud.report.replaced_normals, 1000u);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_GT(dot(to_double(cloud.normals[i]), exact[number_of(cloud, i)]), 0.95);
  }
}

TEST(SplatCloud, TurnsNormalsToTheSensor) {
  const SampledSurface sphere = sample_sphere(3000, 0);
  // From the middle all must look inwards: the place may come from the file or from the options.
  ParticleSet set = numbered(sphere);
  set.sensor = Vec3d{0, 0, 0};
  const SplatCloud by_file = make_splats(set, {}, "sphere");
  EXPECT_EQ(by_file.report.normals, NormalSource::estimated_to_sensor);
  SplatOptions options;
  options.sensor = Vec3d{0, 0, 0};
  const SplatCloud by_options = make_splats(numbered(sphere, true), options, "sphere");
  EXPECT_EQ(by_options.report.turned_normals, 3000u);
  for (const SplatCloud* cloud : {&by_file, &by_options}) {
    for (std::size_t i = 0; i < cloud->size(); ++i) {
      EXPECT_LT(dot(to_double(cloud->normals[i]), sphere.normals[number_of(*cloud, i)]), -0.9);
    }
  }
}

TEST(SplatCloud, RadiiFromTheOptionsAndTheFile) {
  const SampledSurface sphere = sample_sphere(1000, 0);
  SplatOptions options;
  options.radius = 0.25;
  SplatCloud cloud = make_splats(numbered(sphere), options, "sphere");
  EXPECT_EQ(cloud.report.radius, SplatRadiusSource::given);
  for (const float radius : cloud.radii) EXPECT_EQ(radius, 0.25f);

  ParticleSet set = numbered(sphere, true);
  Attribute radii;
  radii.name = "radius";
  for (int i = 0; i < 1000; ++i) radii.floats.push_back(i % 10 ? 0.125f : 0.0f);
  set.attributes.push_back(radii);
  options = {};
  options.radius_scale = 2;
  cloud = make_splats(set, options, "sphere");
  EXPECT_EQ(cloud.report.radius, SplatRadiusSource::file);
  EXPECT_EQ(cloud.report.replaced_radii, 100u);
  for (const float radius : cloud.radii) EXPECT_EQ(radius, 0.25f);

  // The greater half axis stands for an ellipse; the scale applies to both.
  options.ellipses = true;
  cloud = make_splats(numbered(sphere), options, "sphere");
  options.radius_scale = 1;
  const SplatCloud smaller = make_splats(numbered(sphere), options, "sphere");
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_NEAR(cloud.radii[i], length(cloud.axes[i].major), 1e-6f);
    EXPECT_GE(length(cloud.axes[i].major), 0.9999f * length(cloud.axes[i].minor));
    EXPECT_NEAR(length(cloud.axes[i].minor), 2 * length(smaller.axes[i].minor), 1e-5f);
  }
}

// Coordinates of a land survey: metres from an origin that is 5,000 km away.
TEST(SplatCloud, FarFromTheOriginNothingChanges) {
  const SampledSurface near = sample_torus(4000, 0);
  SampledSurface far = near;
  for (Vec3d& p : far.points) p = p + Vec3d{500000, 5000000, 300};
  const SplatCloud a = make_splats(numbered(near), {}, "near"), b = make_splats(numbered(far), {}, "far");
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.closed, b.closed);
  std::vector<std::size_t> place(near.points.size());
  for (std::size_t i = 0; i < b.size(); ++i) place[number_of(b, i)] = i;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::size_t j = place[number_of(a, i)];
    EXPECT_NEAR(dot(a.normals[i], b.normals[j]), 1, 1e-5);
    EXPECT_NEAR(a.radii[i], b.radii[j], 1e-4f * a.radii[i]);
  }
}

// A scanner's lines: 8 times as dense along a line as across. The least radius that closes is half the diagonal.
TEST(SplatCloud, LinesOfAScanner) {
  SampledSurface plane;
  for (int i = 0; i < 160; ++i) {
    for (int j = 0; j < 30; ++j) plane.points.push_back({i * 0.125, j * 1.0, 0.3 * j});
  }
  const SplatCloud cloud = make_splats(numbered(plane), {}, "lines");
  const Vec3d normal = normalize(Vec3d{0, -0.3, 1});
  const double expected = 1.05 * 0.5 * std::hypot(0.125, std::hypot(1, 0.3));
  std::size_t inside = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3d p = cloud.particles.positions[i];
    if (p.x < 3 || p.x > 17 || p.y < 3 || p.y > 26) continue;
    ++inside;
    EXPECT_NEAR(std::abs(dot(to_double(cloud.normals[i]), normal)), 1, 1e-6);
    EXPECT_NEAR(static_cast<double>(cloud.radii[i]), expected, 1e-4);
  }
  EXPECT_GT(inside, 2000u);
}

TEST(SplatCloud, SaysWhatCannotBe) {
  const auto message = [](ParticleSet set, const SplatOptions& options) {
    try {
      make_splats(std::move(set), options, "cloud.ply");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  const SampledSurface sphere = sample_sphere(100, 0);
  ParticleSet two;
  two.positions = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}};
  EXPECT_NE(message(two, {}).find("cloud.ply: normals: the file has none, and fewer than 3"), std::string::npos);
  EXPECT_NE(message({}, {}).find("there are none"), std::string::npos);
  SplatOptions options;
  options.normals = NormalChoice::file;
  EXPECT_NE(message(numbered(sphere), options).find("let them be estimated"), std::string::npos);
  options = {};
  options.radius = -1;
  EXPECT_NE(message(numbered(sphere), options).find("splat radius"), std::string::npos);
  options = {};
  options.neighbours = 2;
  EXPECT_NE(message(numbered(sphere), options).find("2 is not from 3 to 256"), std::string::npos);
  options = {};
  options.thin = std::nan("");
  EXPECT_NE(message(numbered(sphere), options).find("thinning"), std::string::npos);
  options = {};
  options.outlier_ratio = -3;
  EXPECT_NE(message(numbered(sphere), options).find("outlier"), std::string::npos);
  // One point with a normal has no spacing, but a radius may be given.
  ParticleSet one;
  one.positions = {{1, 2, 3}};
  one.attributes.push_back(vectors("normal", {{0, 0, 2}}));
  EXPECT_NE(message(one, {}).find("give one"), std::string::npos);
  options = {};
  options.radius = 0.5;
  const SplatCloud cloud = make_splats(one, options, "one");
  ASSERT_EQ(cloud.size(), 1u);
  EXPECT_EQ(cloud.normals[0], (Vec3{0, 0, 1}));
  EXPECT_FALSE(cloud.closed);
}

TEST(SplatCloud, SameBitsForAnyNumberOfThreads) {
  SampledSurface surface = sample_torus(4000, 0.005);
  surface.points.push_back({5, 5, 5});
  SplatOptions options;
  options.ellipses = true;
  std::vector<SplatCloud> clouds;
  for (const std::size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    clouds.push_back(make_splats(numbered(surface), options, "torus"));
  }
  EXPECT_EQ(clouds[0].particles.positions, clouds[1].particles.positions);
  EXPECT_EQ(clouds[0].normals, clouds[1].normals);
  EXPECT_EQ(clouds[0].radii, clouds[1].radii);
  EXPECT_EQ(clouds[0].report.open_share, clouds[1].report.open_share);
}

TEST(CloudVerdict, TellsScansFromFluids) {
  const SampledSurface sphere = sample_sphere(2000, 0);
  const auto with = [](ParticleSet set, const char* name) {
    Attribute attribute;
    attribute.name = name;
    attribute.floats.assign(set.size(), 1);
    set.attributes.push_back(attribute);
    return set;
  };
  EXPECT_TRUE(tell_surface(numbered(sphere)).is_surface);
  EXPECT_TRUE(tell_surface(numbered(sphere, true)).is_surface);
  EXPECT_FALSE(tell_surface(with(numbered(sphere, true), "velocity")).is_surface);
  ParticleSet block;
  for (int i = 0; i < 4096; ++i) {
    block.positions.push_back({1.0 * (i % 16), 1.0 * (i / 16 % 16), 1.0 * (i / 256)});
  }
  EXPECT_FALSE(tell_surface(block).is_surface);
  ParticleSet with_normals = block;
  with_normals.attributes.push_back(vectors("normal", std::vector<Vec3d>(4096, Vec3d{0, 1, 0})));
  EXPECT_FALSE(tell_surface(with_normals).is_surface);
  EXPECT_TRUE(tell_surface(with(block, "intensity")).is_surface);
  ParticleSet few;
  few.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_FALSE(tell_surface(few).is_surface);
  EXPECT_TRUE(tell_surface(with(few, "confidence")).is_surface);
}

// ---- scans -------------------------------------------------------------------------------------------------------

/// A file in the folder that EMBRUN_CLOUD_DATA names, or nothing.
std::string scan(const char* name) {
  const char* folder = std::getenv("EMBRUN_CLOUD_DATA");
  if (!folder) return {};
  const std::filesystem::path path = std::filesystem::path(folder) / name;
  return std::filesystem::exists(path) ? path.string() : std::string();
}

// Their normals are means over the faces of the scanners' meshes, which know more than the points: so the mean angle says
// little, but the side must be the same.
TEST(Scans, NormalsLookTheRightWayAndOpenBasesAreSeen) {
  struct Case {
    const char* name;
    bool closed;
  };
  for (const Case& one : {Case{"bunny_35947.ply", false}, Case{"igea_70658.ply", true}}) {
    const std::string path = scan(one.name);
    if (path.empty()) GTEST_SKIP() << "set EMBRUN_CLOUD_DATA to a folder with " << one.name;
    const ParticleSet set = read_particles(path);
    EXPECT_TRUE(tell_surface(set).is_surface);
    EXPECT_EQ(make_splats(set, {}, path).closed, one.closed);
    SplatOptions options;
    options.normals = NormalChoice::estimate;
    const SplatCloud cloud = make_splats(set, options, path);
    EXPECT_EQ(cloud.closed, one.closed);
    const Attribute* normal = cloud.particles.find("normal");
    ASSERT_TRUE(normal);
    double flipped = 0, degrees = 0;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Vec3d n{normal->value(3 * i), normal->value(3 * i + 1), normal->value(3 * i + 2)};
      const double cosine = dot(normalize(n), to_double(cloud.normals[i]));
      flipped += cosine < 0;
      degrees += std::acos(std::min(1.0, std::abs(cosine))) * 180 / 3.14159265358979;
    }
    EXPECT_LT(flipped / static_cast<double>(cloud.size()), 0.005);
    EXPECT_LT(degrees / static_cast<double>(cloud.size()), 4);
  }
}

}  // namespace
}  // namespace embrun

// Files of splats with levels of detail: how they are made, in however little memory, and what is read of them.

#include <gtest/gtest.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "base/error.h"
#include "geometry/splat_clouds.h"
#include "particles/cloud_splats.h"
#include "particles/splat_attributes.h"
#include "render/splat_building.h"

namespace embrun {
namespace {

/// The unit sphere's 10 * 4^steps + 2 points, with normals and colours (red grows with x), in no order that helps.
ParticleSet sphere_points(int steps, bool with_radius = true, Vec3d center = {}) {
  std::vector<Vec3> places = icosphere(steps);
  std::shuffle(places.begin(), places.end(), std::mt19937(1));
  ParticleSet points;
  Attribute normal, color, radius;
  normal.name = "normal", color.name = "color", radius.name = "radius";
  normal.components = color.components = 3;
  for (const Vec3& p : places) {
    points.positions.push_back(to_double(p) + center);
    normal.floats.insert(normal.floats.end(), {p.x, p.y, p.z});
    color.floats.insert(color.floats.end(), {std::round(127.5f + 127.5f * p.x) / 255, 0.5f, 0});
    radius.floats.push_back(0.055f * std::ldexp(1.0f, 4 - steps));
  }
  points.attributes = {normal, color};
  if (with_radius) points.attributes.push_back(radius);
  return points;
}

/// A file in memory, where mapped ones may lie.
class FileBytes {
 public:
  explicit FileBytes(const std::vector<std::byte>& bytes) : room_(bytes.size() + 64) {
    const auto place = reinterpret_cast<std::uintptr_t>(room_.data());
    data_ = room_.data() + (64 - place % 64) % 64;
    size_ = bytes.size();
    std::copy(bytes.begin(), bytes.end(), data_);
  }
  std::span<std::byte> span() { return {data_, size_}; }
  SplatHierarchy view() { return view_splat_file(span(), "cloud.splats"); }

 private:
  std::vector<std::byte> room_;
  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
};

struct Built {
  std::vector<std::byte> bytes;
  SplatBuildReport report;
};

Built build(PointStream& stream, const SplatBuildOptions& options) {
  Built built;
  stream.rewind();
  SplatBuildOptions own = options;
  if (own.scratch.empty()) own.scratch = ::testing::TempDir();
  built.report = write_splats_of(
      stream, own, "cloud.ply",
      [&](std::span<const std::byte> piece) { built.bytes.insert(built.bytes.end(), piece.begin(), piece.end()); },
      [](const char*, double fraction) { EXPECT_TRUE(fraction >= 0 && fraction <= 1); });
  return built;
}

Built build(const ParticleSet& points, std::size_t brick = 500) {
  SplatBuildOptions options;
  options.brick = brick;
  const auto stream = stream_of(points);
  return build(*stream, options);
}

SplatSet set_of(const SplatHierarchy& splats, bool closed) {
  SplatSet set = splats.set();
  set.closed = closed;
  return set;
}

std::vector<Splat> splats_of(const SplatHierarchy& splats) {
  std::vector<Splat> found;
  for (std::uint32_t b = 0; b < splats.splat_blocks; ++b)
    for (std::uint32_t i = 0; i < splats_per_block; ++i)
      if (length(splats.blocks[b].splat(i).normal) > 0) found.push_back(splats.blocks[b].splat(i));
  return found;
}

TEST(SplatFile, IsTheSameWhateverTheMemoryAndTheThreads) {
  const ParticleSet points = sphere_points(5);
  const auto stream = stream_of(points);
  SplatBuildOptions options;
  options.brick = 700;
  const Built all = build(*stream, options);
  EXPECT_EQ(all.report.runs, 0u);
  EXPECT_EQ(all.report.splats, points.size());
  // 10,242 points of 48 bytes.
  options.memory = 100'000;
  const Built some = build(*stream, options);
  EXPECT_EQ(some.report.runs, 5u);
  EXPECT_TRUE(some.bytes == all.bytes);
  options.memory = 1;
  Built least;
  tbb::task_arena(1).execute([&] { least = build(*stream, options); });
  EXPECT_GT(least.report.runs, 9u);
  EXPECT_TRUE(least.bytes == all.bytes);
}

TEST(SplatFile, HoldsEachSplatOnceAndTheirColours) {
  const Built built = build(sphere_points(4, true, {1e5, -2e5, 3e4}));
  FileBytes file(built.bytes);
  const SplatHierarchy splats = file.view();
  EXPECT_EQ(splats.splat_count, 2562u);
  EXPECT_GT(built.report.bricks, 5u);
  // The centre is the median point: within the sphere.
  EXPECT_LT(length(splats.center - Vec3d{1e5, -2e5, 3e4}), 1);
  const Vec3 off = to_float(splats.center - Vec3d{1e5, -2e5, 3e4});
  std::size_t count = 0;
  for (std::uint32_t b = 0; b < splats.splat_blocks; ++b)
    for (std::uint32_t i = 0; i < splats_per_block; ++i) {
      const Splat splat = splats.blocks[b].splat(i);
      if (length(splat.normal) == 0) continue;
      ++count;
      EXPECT_NEAR(length(splat.center + off - splat.normal), 0, 1e-5);
      EXPECT_NEAR(splat.radius, 0.055, 1e-7);
      const Rgb color = splats.colors[b * splats_per_block + i];
      // sRGB of a half is 0.2140 in light.
      EXPECT_NEAR(color.g, 0.2140, 3e-3);
      const float encoded = 0.5f + 0.5f * splat.normal.x;
      EXPECT_NEAR(std::pow((std::max(encoded, 0.1f) + 0.055) / 1.055, 2.4),
                  encoded < 0.1f ? std::pow((0.1 + 0.055) / 1.055, 2.4) : static_cast<double>(color.r), 8e-3);
    }
  EXPECT_EQ(count, 2562u);
  EXPECT_NEAR(splats.median_radius, 0.055, 1e-7);
}

TEST(SplatFile, WithoutLevelsShowsWhatATreeOfAllShows) {
  const Built built = build(sphere_points(5));
  FileBytes file(built.bytes);
  const SplatHierarchy splats = file.view();
  const SplatTree tree = build_splat_tree(splats_of(splats));
  int hits = 0;
  for (const bool closed : {true, false})
    for (const Ray& ray : rays_at(tree.bounds, 2000, 11)) {
      // Along the same line from the same place, wherever boxes begin.
      SplatSet own = set_of(splats, closed), expected = set_of(tree, closed);
      own.bounds = expected.bounds;
      SurfaceHit a, b;
      const bool found = intersect_splats(expected, tree.view(), ray, false, {}, a);
      ASSERT_EQ(intersect_splats(own, splats.tree(0), ray, false, {}, b), found);
      if (!found) continue;
      ++hits;
      EXPECT_EQ(a.t, b.t);
      EXPECT_NEAR(length(a.shading_normal - b.shading_normal), 0, 1e-6);
    }
  EXPECT_GT(hits, 2000);
}

TEST(SplatFile, HasNoHoleBetweenBricksAtAnyLevel) {
  const Built built = build(sphere_points(6), 300);
  FileBytes file(built.bytes);
  const SplatHierarchy splats = file.view();
  EXPECT_GT(built.report.bricks, 130u);
  const Vec3 center = to_float(splats.center);
  for (const float width : {0.0f, 0.03f, 0.1f, 0.3f}) {
    int coarse = 0;
    for (const bool closed : {true, false}) {
      std::mt19937 random(12);
      std::uniform_real_distribution<float> unit(-1, 1);
      for (int rays = 0; rays < 3000;) {
        const Vec3 from{unit(random), unit(random), unit(random)}, to{unit(random), unit(random), unit(random)};
        if (length(from) > 1 || length(from) < 0.1f || length(to) > 0.85f) continue;
        Ray ray;
        ray.origin = 3.0f * normalize(from) - center;
        ray.direction = normalize(to - center - ray.origin);
        ray.cone_width = width;
        SurfaceHit hit;
        ASSERT_TRUE(intersect_splats(set_of(splats, closed), splats.tree(1), ray, false, {}, hit))
            << "footprint " << width << ", ray " << rays;
        // A disc that touches the sphere is farther from its centre by r^2 / 2 at the outline; several lie in a group.
        EXPECT_NEAR(length(hit.position + center), 1, 0.002 + 0.5 * static_cast<double>(square(width)));
        coarse += hit.splat_radius > 0.02f;
        ++rays;
      }
    }
    // Parts of eight splats are 0.08 wide, as a rule.
    if (width > 0.2f) {
      EXPECT_GT(coarse, 5500) << width;
    }
  }
}

TEST(SplatFile, RadiiAcrossBricksAreThoseOfTheWhole) {
  // What the cloud's radii are where it is one piece, and in bricks of 400 points.
  const ParticleSet points = sphere_points(5, false);
  const std::vector<Vec3> normals = normals_of_points(points);
  const PointTree tree(points.positions);
  const SplatSizes whole = estimate_splats(tree, points.positions, normals, false);
  std::map<std::array<float, 3>, float> expected;
  for (std::size_t i = 0; i < normals.size(); ++i)
    expected[{normals[i].x, normals[i].y, normals[i].z}] = whole.radii[i];
  const Built built = build(points, 400);
  EXPECT_TRUE(built.report.estimated_radii);
  FileBytes file(built.bytes);
  const std::vector<Splat> splats = splats_of(file.view());
  ASSERT_EQ(splats.size(), points.size());
  for (const Splat& splat : splats) {
    const auto found = expected.find({splat.normal.x, splat.normal.y, splat.normal.z});
    ASSERT_NE(found, expected.end());
    // Positions are of single precision here.
    EXPECT_NEAR(splat.radius, found->second, 1e-4 * static_cast<double>(found->second));
  }
}

TEST(SplatFile, DuplicatesAreLeftOut) {
  ParticleSet points = sphere_points(3);
  const std::size_t count = points.size();
  const std::vector<Vec3d> again(points.positions.begin(), points.positions.begin() + 100);
  points.positions.insert(points.positions.end(), again.begin(), again.end());
  for (Attribute& attribute : points.attributes) {
    const std::vector<float> values(attribute.floats.begin(), attribute.floats.begin() + 100 * attribute.components);
    attribute.floats.insert(attribute.floats.end(), values.begin(), values.end());
  }
  EXPECT_EQ(build(points).report.splats, count);
  EXPECT_EQ(build(points).report.duplicates, 100u);
}

/// Some points, then a piece of which nothing was left.
class DroppingStream : public PointStream {
 public:
  explicit DroppingStream(ParticleSet points) : points_(std::move(points)) {}
  std::uint64_t count() const override { return points_.size() + 7; }
  ParticleSet next() override {
    ParticleSet piece;
    if (turn_ == 0) piece = points_;
    if (turn_++ == 1) piece.dropped_non_finite = 7;
    return piece;
  }
  void rewind() override { turn_ = 0; }

 private:
  ParticleSet points_;
  int turn_ = 0;
};

TEST(SplatFile, PointsThatAreDroppedInTheEndCount) {
  DroppingStream stream(sphere_points(3));
  const Built built = build(stream, {});
  EXPECT_EQ(built.report.dropped, 7u);
  EXPECT_EQ(built.report.points, 642u);
}

TEST(SplatFile, NormalsAreAskedFor) {
  ParticleSet points = sphere_points(3);
  points.attributes[0].floats[3] = points.attributes[0].floats[4] = points.attributes[0].floats[5] = 0;
  try {
    build(points);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("cloud.ply: normals: 1 of 642"), std::string::npos) << error.what();
  }
  EXPECT_THROW(build(ParticleSet{}), Error);
}

TEST(SplatFile, PointsOfAPlyFileInPiecesAreThoseOfTheFile) {
  const std::string path = ::testing::TempDir() + "/embrun_stream_" + std::to_string(::getpid()) + ".ply";
  const ParticleSet points = sphere_points(4);
  const auto write = [&](const std::string& extra, std::size_t cut) {
    std::ofstream out(path, std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\ncomment element vertex 7\nelement vertex " << points.size()
        << "\nproperty double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty "
           "float nz\nproperty float radius\n"
        << extra << "element face 0\nproperty list uchar int vertex_index\nend_header\n";
    std::string body;
    for (std::size_t i = 0; i < points.size(); ++i) {
      body.append(reinterpret_cast<const char*>(&points.positions[i]), 24);
      body.append(reinterpret_cast<const char*>(&points.attributes[0].floats[3 * i]), 12);
      body.append(reinterpret_cast<const char*>(&points.attributes[2].floats[i]), 4);
      if (!extra.empty()) body.append(1, '\0');
    }
    out << body.substr(0, body.size() - cut);
  };
  write("", 0);
  const auto stream = open_point_stream(path);
  ASSERT_NE(stream, nullptr);
  EXPECT_EQ(stream->count(), points.size());
  ParticleSet colorless = points;
  colorless.attributes.erase(colorless.attributes.begin() + 1);
  EXPECT_TRUE(build(*stream, {}).bytes == build(*stream_of(colorless), {}).bytes);
  // What has lists is read whole, what is cut off is refused.
  write("property list uchar int neighbours\n", 0);
  EXPECT_EQ(open_point_stream(path), nullptr);
  write("", 1);
  EXPECT_THROW(open_point_stream(path), Error);
  EXPECT_EQ(open_point_stream(path + ".none"), nullptr);
  std::filesystem::remove(path);
}

/// Looks along some rays: what there is must be within the arrays, which the sanitizers see to.
void look_into(const SplatHierarchy& splats) {
  for (const float width : {0.0f, 0.2f})
    for (Ray ray : rays_at(splats.bounds, 40, 13)) {
      ray.cone_width = width;
      SurfaceHit hit;
      intersect_splats(set_of(splats, splats.closed), splats.tree(1), ray, false, {}, hit);
    }
}

TEST(SplatFile, DamagedOnesAreRefusedOrHarmless) {
  const Built built = build(sphere_points(3), 100);
  for (std::size_t size = 0; size < built.bytes.size(); size += size < 300 ? 1 : 997) {
    FileBytes cut({built.bytes.begin(), built.bytes.begin() + static_cast<std::ptrdiff_t>(size)});
    EXPECT_THROW(cut.view(), Error) << size;
  }
  std::mt19937 random(14);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    FileBytes file(built.bytes);
    const auto tail = built.bytes.size() - sizeof(SplatFileTail);
    // Mostly nodes and the tail: splats say nothing of where to look.
    const std::size_t at = i % 3 == 0 ? tail + random() % sizeof(SplatFileTail)
                                      : built.bytes.size() / 2 + random() % (built.bytes.size() / 2);
    file.span()[at] ^= std::byte{static_cast<unsigned char>(1u << random() % 8)};
    try {
      look_into(file.view());
    } catch (const Error& error) {
      EXPECT_TRUE(std::string_view(error.what()).starts_with("cloud.splats: offset ")) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 300);
}

TEST(SplatFile, LinksThatLeadAstrayAreRefused) {
  const Built built = build(sphere_points(3), 100);
  FileBytes sound(built.bytes);
  const SplatHierarchy splats = sound.view();
  const auto nodes = static_cast<std::size_t>(reinterpret_cast<const std::byte*>(splats.nodes) - sound.span().data());
  const auto refused = [&](std::uint32_t node, std::uint32_t child, std::uint32_t link) {
    FileBytes file(built.bytes);
    std::memcpy(file.span().data() + nodes + node * sizeof(SplatNode) + offsetof(SplatNode, child) + 4 * child, &link,
                4);
    try {
      file.view();
    } catch (const Error&) {
      return true;
    }
    return false;
  };
  const std::uint32_t root = splats.node_count - 1;
  EXPECT_FALSE(refused(root, 0, splats.nodes[root].child[0]));
  EXPECT_TRUE(refused(root, 0, root));                              // itself
  EXPECT_TRUE(refused(root, 0, splats.nodes[root].child[1]));       // the same as another: as often as there are ways
  EXPECT_TRUE(refused(0, 0, root));                                 // round in a circle
  EXPECT_TRUE(refused(root, 0, splats.node_count));                 // beyond the nodes
  EXPECT_TRUE(refused(root, 0, splats.splat_blocks | splat_leaf));  // beyond the blocks
}

TEST(SplatFile, BoxesOfNoChildAreEmpty) {
  // A box that is inside out along one axis alone holds no child, yet a search may come by what it is linked to.
  const Built built = build(sphere_points(3), 100);
  FileBytes file(built.bytes);
  SplatHierarchy splats = file.view();
  auto* nodes = const_cast<SplatNode*>(splats.nodes);
  std::uint32_t node = 0, lane = 0;
  for (std::uint32_t n = 0; n < splats.node_count; ++n)
    for (std::uint32_t i = 0; i < splat_tree_width; ++i)
      if (!has_child(nodes[n], i)) node = n, lane = i;
  ASSERT_FALSE(has_child(nodes[node], lane));
  for (int axis = 0; axis < 3; ++axis) {
    nodes[node].face[axis][0][lane] = axis == 0 ? 1.0f : -1.0f;
    nodes[node].face[axis][1][lane] = axis == 0 ? -1.0f : 1.0f;
  }
  EXPECT_THROW(file.view(), Error);
  nodes[node].face[0][0][lane] = std::nanf("");
  EXPECT_THROW(file.view(), Error);
}

TEST(SplatFile, WhatIsNoneIsToldSo) {
  const std::string path = ::testing::TempDir() + "/embrun_none_" + std::to_string(::getpid()) + ".splats";
  std::ofstream(path) << "ply\n";
  EXPECT_FALSE(is_splat_file(path));
  EXPECT_THROW(open_splat_file(path), Error);
  EXPECT_FALSE(is_splat_file(path + ".none"));
  EXPECT_THROW(open_splat_file(path + ".none"), Error);
  EXPECT_THROW(open_splat_file(::testing::TempDir()), Error);
  const Built built = build(sphere_points(3));
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(built.bytes.data()), static_cast<std::streamsize>(built.bytes.size()));
  EXPECT_TRUE(is_splat_file(path));
  EXPECT_EQ(open_splat_file(path)->splat_count, 642u);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace embrun

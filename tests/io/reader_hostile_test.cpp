// Damaged files of every format: a reader may succeed or throw one Error that names the file and the place; it may not
// crash, hang, or allocate what the file cannot justify. This program counts its allocations for that.

#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <new>
#include <random>

#include "base/error.h"
#include "io/cloud_files.h"
#include "io/particle_files.h"
#include "io/read_mesh.h"
#include "io/read_particles.h"
#include "io/read_volume.h"

namespace {

// Tests run on one thread; other threads of the program may allocate too.
std::atomic<std::size_t> live_bytes{0}, peak_bytes{0};

void* counted_allocation(std::size_t size) {
  void* memory = std::malloc(size ? size : 1);
  if (!memory) throw std::bad_alloc();
  const std::size_t now = live_bytes += malloc_usable_size(memory);
  if (now > peak_bytes) peak_bytes = now;
  return memory;
}

void counted_release(void* memory) {
  if (memory) live_bytes -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) { return counted_allocation(size); }
void* operator new[](std::size_t size) { return counted_allocation(size); }
void operator delete(void* memory) noexcept { counted_release(memory); }
void operator delete[](void* memory) noexcept { counted_release(memory); }
void operator delete(void* memory, std::size_t) noexcept { counted_release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { counted_release(memory); }

namespace embrun {
namespace {

using namespace test;

struct Seed {
  std::string name;
  std::string file;
  bool is_mesh = false;
  bool is_volume = false;
};

/// A grid of 3 x 2 x 2 cells of three channels.
std::string volume_file(std::int32_t encoding) {
  FileBytes bytes(false);
  bytes.text("VOL").number(std::uint8_t{3}).number(encoding);
  for (const std::int32_t n : {3, 2, 2, 3}) bytes.number(n);
  for (const float b : {0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f}) bytes.number(b);
  for (int i = 0; i < 36; ++i) {
    if (encoding == 1)
      bytes.number(0.25f * static_cast<float>(i));
    else
      bytes.number(static_cast<std::uint8_t>(7 * i));
  }
  return bytes.str();
}

std::vector<Seed> seeds() {
  const ParticleSet set = some_particles(8);
  std::vector<Seed> all{
      {"plain.bgeo", as_bgeo(set)},
      {"packed.bgeo", gzipped(as_bgeo(set))},
      {"ascii.ply", as_ply(set, PlyKind::ascii)},
      {"little.ply", as_ply(set, PlyKind::little_endian)},
      {"big.ply", as_ply(set, PlyKind::big_endian)},
      {"ascii.vtk", as_vtk(set, false, "POLYDATA")},
      {"binary.vtk", as_vtk(set, true, "UNSTRUCTURED_GRID")},
      {"table.csv", as_csv(set, ',', true)},
      {"table.xyz", as_csv(set, ' ', false)},
      {"chemist.xyz", "2\nname\nO 1 2 3\nH 4 5 6\n"},
      {"faces.ply", tetrahedron_ply(PlyKind::little_endian), true},
      {"faces_ascii.ply", tetrahedron_ply(PlyKind::ascii), true},
      {"faces.obj", tetrahedron_obj(), true},
  };
  const std::vector<CloudPoint> points = cloud_points(8);
  all.push_back({"ascii.pcd", as_pcd(points, PcdKind::ascii)});
  all.push_back({"binary.pcd", as_pcd(points, PcdKind::binary)});
  all.push_back({"compressed.pcd", as_pcd(points, PcdKind::compressed)});
  all.push_back({"colours.las", as_las(points, {2, 3})});
  all.push_back({"extended.las", as_las(points, {4, 8, 2})});
  all.push_back({"vertices.obj", as_obj_cloud(points, true, true)});
  all.push_back({"grid.vol", volume_file(1), false, true});
  all.push_back({"bytes.vol", volume_file(3), false, true});
  all.push_back({"packed.vol", gzipped(volume_file(1)), false, true});
  // Meshes are also read as particles: the vertices stand before or after lists.
  for (std::size_t i = 10; i < 12; ++i) all.push_back({"particles_of_" + all[i].name, all[i].file, false});
  return all;
}

// The seeds have a few hundred bytes; what they may justify is far below this.
constexpr std::size_t most_memory = std::size_t{64} << 20;

/// Reads the file; true when it was accepted. Fails the test when the error is not as promised.
bool read_hostile(const Seed& seed, const std::string& file, const std::string& what) {
  const std::string name = "dir/" + seed.name;
  const std::size_t before = live_bytes;
  peak_bytes = before;
  bool accepted = false;
  try {
    if (seed.is_volume) {
      const VolumeFile volume = read_volume_from_memory(as_bytes(file), name);
      accepted = true;
      EXPECT_EQ(volume.values.size(), static_cast<std::size_t>(volume.nx) * static_cast<std::size_t>(volume.ny) *
                                          static_cast<std::size_t>(volume.nz) *
                                          static_cast<std::size_t>(volume.channels));
    } else if (seed.is_mesh) {
      const TriangleMesh mesh = read_mesh_from_memory(as_bytes(file), name);
      accepted = true;
      EXPECT_FALSE(mesh.triangles.empty());
      for (const auto& triangle : mesh.triangles) {
        for (const std::uint32_t corner : triangle) EXPECT_LT(corner, mesh.positions.size());
      }
      for (const Vec3 p : mesh.positions) EXPECT_TRUE(is_finite(p));
      EXPECT_TRUE(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
    } else {
      const ParticleSet set = read_particles_from_memory(as_bytes(file), name);
      accepted = true;
      EXPECT_GT(set.size(), 0u);
      for (const Vec3d p : set.positions) EXPECT_TRUE(std::abs(p.x) + std::abs(p.y) + std::abs(p.z) < 1e16);
      for (const Attribute& a : set.attributes) {
        EXPECT_EQ(a.value_count(), set.size() * static_cast<std::size_t>(a.components)) << a.name;
        for (const float value : a.floats) EXPECT_TRUE(is_finite(value));
      }
    }
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with(name + ": line ") || message.starts_with(name + ": offset ") ||
                message.starts_with(name + ": point "))
        << what << ": " << message;
    EXPECT_LT(message.size(), 700u) << what;
    EXPECT_EQ(message.find('\n'), std::string::npos) << what;
  }
  EXPECT_LT(peak_bytes - before, most_memory) << what;
  return accepted;
}

TEST(HostileFiles, SeedsAreGood) {
  for (const Seed& seed : seeds()) EXPECT_TRUE(read_hostile(seed, seed.file, seed.name)) << seed.name;
}

TEST(HostileFiles, EveryTruncation) {
  for (const Seed& seed : seeds()) {
    std::size_t accepted = 0;
    for (std::size_t length = 0; length < seed.file.size(); ++length) {
      accepted += read_hostile(seed, seed.file.substr(0, length), seed.name + " cut at " + std::to_string(length));
    }
    // Without its end a file may be complete all the same (a trailer, a last line feed, later rows of a table), but a
    // binary one must not pass when a particle is missing.
    if (seed.name.ends_with(".bgeo")) {
      EXPECT_LE(accepted, 2u) << seed.name;
    }
    if (seed.name == "binary.pcd" || seed.name == "compressed.pcd" || seed.name.ends_with(".las")) {
      EXPECT_EQ(accepted, 0u) << seed.name;
    }
    if (seed.name == "little.ply" || seed.name == "big.ply" || seed.is_volume) {
      EXPECT_EQ(accepted, 0u) << seed.name;
    }
  }
}

TEST(HostileFiles, FlippedBits) {
  std::mt19937 random(7);
  for (const Seed& seed : seeds()) {
    for (int round = 0; round < 1500; ++round) {
      std::string file = seed.file;
      const int flips = 1 + static_cast<int>(random() % 4);
      for (int i = 0; i < flips; ++i) file[random() % file.size()] ^= static_cast<char>(1 << random() % 8);
      read_hostile(seed, file, seed.name + " round " + std::to_string(round));
    }
  }
}

// Extreme numbers over every four bytes of the start, where the counts are, and digits prefixed in text.
TEST(HostileFiles, GigabyteCounts) {
  const std::string numbers[] = {std::string("\x7f\xff\xff\xff", 4),
                                 std::string("\xff\xff\xff\x7f", 4),
                                 std::string("\xff\xff\xff\xff", 4),
                                 std::string("\x80\x00\x00\x00", 4),
                                 std::string("\x10\x00\x00\x00", 4),
                                 "9999",
                                 "4e18"};
  for (const Seed& seed : seeds()) {
    const std::size_t end = std::min<std::size_t>(seed.file.size(), 600);
    for (std::size_t place = 0; place + 4 <= end; ++place) {
      for (const std::string& number : numbers) {
        std::string file = seed.file;
        file.replace(place, 4, number);
        read_hostile(seed, file, seed.name + " at " + std::to_string(place));
      }
      if (seed.file[place] < '0' || seed.file[place] > '9') continue;
      for (const char* digits : {"1000000000", "99999999999999999999999", "-"}) {
        std::string file = seed.file;
        file.insert(place, digits);
        read_hostile(seed, file, seed.name + " at " + std::to_string(place));
      }
    }
  }
}

// Kilobytes of gzip that hold a hundred thousand times what they should: memory follows the announced points.
TEST(HostileFiles, PackedZeroes) {
  const std::string zeroes(32 << 20, '\0');
  const Seed seed{"bomb.bgeo", gzipped(bgeo_header(10, 0).text(zeroes).str())};
  ASSERT_LT(seed.file.size(), 100000u);
  EXPECT_TRUE(read_hostile(seed, seed.file, "bomb"));
  // Two billion announced: they cannot be in there.
  const Seed greedy{"bomb.bgeo", gzipped(bgeo_header(2000000000, 0).text(zeroes).str())};
  EXPECT_FALSE(read_hostile(greedy, greedy.file, "bomb"));
  // Attribute tables without end.
  FileBytes table = bgeo_header(10, 1);
  table.number(std::uint16_t{1})
      .text("s")
      .number(std::uint16_t{1})
      .number(std::int32_t{4})
      .number(std::int32_t{16 << 20});
  const Seed strings{"bomb.bgeo", gzipped(table.text(zeroes).str())};
  EXPECT_FALSE(read_hostile(strings, strings.file, "bomb"));
}

TEST(HostileFiles, ManyColumnsOfOneName) {
  std::string header = "x,y,z", row = "1,2,3";
  for (int i = 0; i < 4000; ++i) header += ",same", row += ",1";
  const Seed seed{"wide.csv", header + "\n" + row + "\n"};
  EXPECT_TRUE(read_hostile(seed, seed.file, "wide"));
  for (int i = 0; i < 200; ++i) header += ",same", row += ",1";
  EXPECT_FALSE(read_hostile(seed, header + "\n" + row + "\n", "wider"));
}

TEST(HostileFiles, RandomBytes) {
  std::mt19937 random(11);
  const std::string starts[] = {"",
                                "BgeoV",
                                "ply\n",
                                "ply\nformat ascii 1.0\nelement vertex ",
                                "# vtk DataFile Version 3.0\nt\nBINARY\n",
                                "\x1f\x8b\x08",
                                "x,y,z\n",
                                "v 0 0 0\nv ",
                                "LASF",
                                "VERSION .7\nFIELDS x y z\nWIDTH 1\nDATA binary_compressed\n",
                                "v 0 0 0\nf ",
                                std::string("VOL\x03\x01\0\0\0", 8)};
  for (const std::string& start : starts) {
    for (int round = 0; round < 500; ++round) {
      std::string file = start;
      for (std::size_t i = random() % 200; i-- > 0;) file += static_cast<char>(random());
      read_hostile({"noise", "", false}, file, "noise");
      read_hostile({"noise", "", true}, file, "noise");
      read_hostile({"noise", "", false, true}, file, "noise");
    }
  }
}

/// A folder that goes away with its files.
struct TemporaryFolder {
  std::string path = testing::TempDir() + "embrun_hostile_XXXXXX";
  TemporaryFolder() { EXPECT_NE(mkdtemp(path.data()), nullptr); }
  ~TemporaryFolder() {
    for (const char* name : {"file.bgeo", "pipe"}) unlink((path + "/" + name).c_str());
    rmdir(path.c_str());
  }
};

std::string error_of(const std::string& path) {
  try {
    read_particles(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(HostileFiles, PathsThatAreNoFiles) {
  const TemporaryFolder folder;
  EXPECT_EQ(error_of(folder.path + "/none.bgeo"), folder.path + "/none.bgeo: cannot open: No such file or directory");
  EXPECT_EQ(error_of(folder.path), folder.path + ": is a directory, not a file");
  ASSERT_EQ(mkfifo((folder.path + "/pipe").c_str(), 0600), 0);
  EXPECT_EQ(error_of(folder.path + "/pipe"), folder.path + "/pipe: is not a regular file");
  const std::string file = folder.path + "/file.bgeo";
  std::ofstream(file) << "x y z\n1 2 3\n";
  EXPECT_EQ(error_of(file), "");  // content decides, not the name
  EXPECT_THROW(read_mesh(file), Error);
  if (geteuid() == 0) return;  // root may read everything
  chmod(file.c_str(), 0);
  EXPECT_EQ(error_of(file), file + ": cannot open: Permission denied");
}

}  // namespace
}  // namespace embrun

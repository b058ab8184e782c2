// Readers of scanned clouds: PCD, OBJ vertices, LAS, and the names and tables that scans come with.

#include <gtest/gtest.h>

#include "io/cloud_files.h"
#include "io/lzf.h"
#include "io/particle_files.h"
#include "io/read_particles.h"

namespace embrun {
namespace {

using namespace test;

ParticleSet read(std::string_view file) { return read_particles_from_memory(as_bytes(file), "some.file"); }

void expect_colour(const ParticleSet& set, const std::vector<CloudPoint>& points) {
  const Attribute* colour = set.find("color");
  ASSERT_NE(colour, nullptr);
  ASSERT_EQ(colour->components, 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_FLOAT_EQ(colour->floats[3 * i], static_cast<float>(points[i].red) / 255.0f) << i;
    EXPECT_FLOAT_EQ(colour->floats[3 * i + 1], static_cast<float>(points[i].green) / 255.0f);
    EXPECT_FLOAT_EQ(colour->floats[3 * i + 2], static_cast<float>(points[i].blue) / 255.0f);
  }
}

TEST(Lzf, UnpacksRunsAndReferences) {
  const auto unpack = [](std::string packed, std::size_t size) {
    std::string out(size, '?');
    const bool good = unpack_lzf(as_bytes(packed), std::as_writable_bytes(std::span(out)));
    return good ? out : "damaged";
  };
  EXPECT_EQ(unpack("", 0), "");
  EXPECT_EQ(unpack(std::string("\x02"
                               "abc",
                               4),
                   3),
            "abc");
  // Length 1 + 2 from 3 back; length 7 + 3 + 2 from 1 back, over itself.
  EXPECT_EQ(unpack(std::string("\x02"
                               "abc"
                               "\x20\x02",
                               6),
                   6),
            "abcabc");
  EXPECT_EQ(unpack(std::string("\x00"
                               "x"
                               "\xe0\x03\x00",
                               5),
                   13),
            "xxxxxxxxxxxxx");
  EXPECT_EQ(unpack(std::string("\x02"
                               "abc"
                               "\x20\x03",
                               6),
                   6),
            "damaged");  // before the start
  EXPECT_EQ(unpack(std::string("\x02"
                               "abc"
                               "\x20",
                               5),
                   6),
            "damaged");
  EXPECT_EQ(unpack(std::string("\x03"
                               "abc",
                               4),
                   3),
            "damaged");
  EXPECT_EQ(unpack(std::string("\x02"
                               "abc",
                               4),
                   2),
            "damaged");
  EXPECT_EQ(unpack(std::string("\x02"
                               "abc",
                               4),
                   4),
            "damaged");
  std::string text;
  for (int i = 0; i < 3000; ++i) text += std::to_string(i * i % 1013);
  ASSERT_LT(lzf_packed(text).size(), text.size());
  EXPECT_EQ(unpack(lzf_packed(text), text.size()), text);
}

TEST(PcdReader, ReadsEveryEncoding) {
  const std::vector<CloudPoint> points = cloud_points(200);
  for (const PcdKind kind : {PcdKind::ascii, PcdKind::binary, PcdKind::compressed}) {
    const ParticleSet set = read(as_pcd(points, kind));
    ASSERT_EQ(set.size(), 200u);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(to_float(set.positions[i]), (Vec3{points[i].x, points[i].y, points[i].z}));
      EXPECT_EQ(set.find("intensity")->ints[i], 1000 + static_cast<int>(i));
      EXPECT_EQ(set.find("histogram")->floats[2 * i + 1], -static_cast<float>(i));
    }
    expect_colour(set, points);
    EXPECT_EQ(set.find("rgb"), set.find("color"));
    ASSERT_EQ(set.attributes.size(), 3u);  // no padding
    ASSERT_TRUE(set.sensor.has_value());
    EXPECT_EQ(*set.sensor, (Vec3d{1, 2.5, -3}));
  }
  EXPECT_EQ(read(as_pcd(points, PcdKind::compressed)).format, "PCD binary_compressed");
}

TEST(PcdReader, ReadsOrganizedCloudsNormalsAndDoubles) {
  const ParticleSet set = read(
      "VERSION 0.7\nFIELDS x y z normal_x normal_y normal_z curvature rgba\nSIZE 8 8 8 4 4 4 4 4\n"
      "TYPE F F F F F F F U\nWIDTH 2\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nDATA ascii\n"
      "500000.0005 1 2 0 0 1 0.5 4278255360\nnan nan nan 0 0 1 0 0\n3 4 5 1 0 0 0.25 255\n6 7 8 0 1 0 0 0\n");
  ASSERT_EQ(set.size(), 3u);
  EXPECT_EQ(set.dropped_non_finite, 1u);
  EXPECT_EQ(set.positions[0].x, 500000.0005);
  EXPECT_EQ(set.find("normal")->floats, (std::vector<float>{0, 0, 1, 1, 0, 0, 0, 1, 0}));
  EXPECT_EQ(set.find("curvature")->floats, (std::vector<float>{0.5f, 0.25f, 0}));
  EXPECT_EQ(set.find("color")->floats, (std::vector<float>{0, 1, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_EQ(set.find("alpha")->ints, (std::vector<std::int32_t>{255, 0, 0}));
  EXPECT_FALSE(set.sensor.has_value());
}

TEST(PcdReader, ErrorsNameFilePlaceAndField) {
  const std::string start = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  EXPECT_EQ(particle_error(start), "some.file: line 4: header: the file ends before DATA");
  EXPECT_EQ(particle_error(start + "POINTS 1\nDATA ascii\n1 two 3\n"),
            "some.file: line 7: field 'y': 'two' is no number of its type");
  EXPECT_EQ(particle_error(start + "POINTS 2\nDATA ascii\n1 2\n3 4 5000\n"),
            "some.file: line 7: field 'z': the line ends before it");
  EXPECT_EQ(particle_error(start + "WIDTH 2\nHEIGHT 3\nPOINTS 5\nDATA ascii\n"),
            "some.file: line 8: POINTS: 5 points, but WIDTH x HEIGHT is 6");
  EXPECT_EQ(particle_error(start + "POINTS 1000\nDATA binary\nabc"),
            "some.file: offset 70: points: 1000 times 12 bytes are announced, but only 3 are left in the file");
  EXPECT_EQ(particle_error("VERSION .7\nFIELDS x y z\nSIZE 4 4 3\n"),
            "some.file: line 3: SIZE: '3' is not one for field 'z'");
  EXPECT_EQ(particle_error(start + "POINTS 1\nDATA zipped\n"),
            "some.file: line 6: DATA: 'zipped' is not ascii, binary or binary_compressed");
  std::string damaged = as_pcd(cloud_points(50), PcdKind::compressed);
  damaged.back() ^= '\x7f';
  damaged[damaged.find("compressed\n") + 11 + 8] = '\x7f';  // the first thing is a reference back
  EXPECT_NE(particle_error(damaged).find("points: the compressed data are damaged"), std::string::npos);
}

TEST(ObjVertices, ReadsColoursAndNormals) {
  const std::vector<CloudPoint> points = cloud_points(40);
  const ParticleSet set = read(as_obj_cloud(points, true, true));
  ASSERT_EQ(set.size(), 40u);
  EXPECT_EQ(to_float(set.positions[39]), (Vec3{points[39].x, points[39].y, points[39].z}));
  expect_colour(set, points);
  EXPECT_EQ(set.find("normal")->value(5), 1);
  EXPECT_TRUE(set.notes.empty());
  EXPECT_EQ(set.format, "OBJ vertices");
  // Positions in double, bytes for colours, a weight, further statements.
  const ParticleSet bytes = read("mtllib a.mtl\nv 500000.0005 2 3 255 0 51\nv 1 2 \\\n3 0 0 0 # black\nf 1 2 1\n");
  EXPECT_EQ(bytes.positions[0].x, 500000.0005);
  EXPECT_EQ(bytes.find("color")->floats, (std::vector<float>{1, 0, 0.2f, 0, 0, 0}));
  EXPECT_EQ(read("v 1 2 3 1\nv 4 5 6 1\n").attributes.size(), 0u);
}

TEST(ObjVertices, LeavesOutWhatDoesNotBelongToVertices) {
  EXPECT_EQ(read("v 0 0 0\nv 1 0 0 1 1 1\n").notes,
            std::vector<std::string>{"colours were left out: 1 of 2 vertices have one"});
  EXPECT_EQ(read("v 0 0 0\nv 1 0 0\nvn 0 0 1\n").notes,
            std::vector<std::string>{"normals were left out: 1 of them for 2 vertices"});
  const std::string start = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvn 0 1 0\nvn 1 0 0\n";
  EXPECT_NE(read(start + "f 1//1 2//2 3//3\n").find("normal"), nullptr);
  const ParticleSet mixed = read(start + "f 1//1 2//3 3//2\n");
  EXPECT_EQ(mixed.find("normal"), nullptr);
  EXPECT_EQ(mixed.notes, std::vector<std::string>{"normals were left out: they belong to the corners of faces"});
}

TEST(ObjVertices, ErrorsNameFileAndLine) {
  EXPECT_EQ(particle_error("v 0 0 0\nv 1 x 0\n"), "some.file: line 2: v: 'x' is not a number; three are needed");
  EXPECT_EQ(particle_error("v 0 0 0\nvv 1 2 0\n"), "some.file: line 2: 'vv' is not an OBJ keyword");
  EXPECT_EQ(particle_error("v 0 0 0 1 1\n"),
            "some.file: line 1: v: there are five numbers: not a weight, not a colour");
  EXPECT_EQ(particle_error("v 0 0 0\n\nv 1e17 0 0\n"),
            "some.file: line 3: position: coordinate 1e+17 of particle 1 is beyond 1e+15 m: single precision cannot "
            "render that");
  // A table whose first column is called v is none.
  EXPECT_EQ(read("v x y z\n1 2 3 4\n").format, "text table");
}

TEST(LasReader, ReadsVersionsAndPointFormats) {
  const std::vector<CloudPoint> points = cloud_points(20);
  const LasKind kinds[] = {{2, 0}, {2, 1}, {2, 2},    {2, 3, 6}, {3, 4},  {3, 5},
                           {4, 6}, {4, 7}, {4, 8, 2}, {4, 9},    {4, 10}, {4, 1}};
  for (const LasKind kind : kinds) {
    SCOPED_TRACE(testing::Message() << "1." << kind.minor << ", format " << kind.format);
    const ParticleSet set = read(as_las(points, kind));
    ASSERT_EQ(set.size(), 20u);
    const bool extended = kind.format >= 6;
    for (std::size_t i = 0; i < points.size(); ++i) {
      // In single precision the second coordinate would be off by up to 0.25 m.
      EXPECT_NEAR(set.positions[i].x, 500000 + static_cast<double>(points[i].x), 1e-9);
      EXPECT_NEAR(set.positions[i].y, 4000000 + static_cast<double>(points[i].y), 1e-8);
      EXPECT_NEAR(set.positions[i].z, 100 + static_cast<double>(points[i].z), 1e-9);
      EXPECT_EQ(set.find("intensity")->ints[i], points[i].intensity);
    }
    EXPECT_EQ(set.find("return_number")->ints[3], 2);
    EXPECT_EQ(set.find("number_of_returns")->ints[3], extended ? 9 : 3);
    EXPECT_EQ(set.find("classification")->ints[3], extended ? 64 : 6);
    EXPECT_EQ(set.find("classification_flags")->ints[3], extended ? 4 : 1);
    EXPECT_FLOAT_EQ(set.find("scan_angle")->floats[3], -15.0f);
    EXPECT_EQ(set.find("user_data")->ints[3], 5);
    EXPECT_EQ(set.find("point_source_id")->ints[3], 77);
    if (extended) {
      EXPECT_EQ(set.find("scanner_channel")->ints[3], 1);
    }
    const int f = kind.format;
    if (f == 0 || f == 2) {
      EXPECT_EQ(set.find("gps_time"), nullptr);
    } else {
      EXPECT_EQ(set.find("gps_time")->longs[3], 123456792250000000);
    }
    if (f == 2 || f == 3 || f == 5 || f == 7 || f == 8 || f == 10) {
      expect_colour(set, points);
    } else {
      EXPECT_EQ(set.find("color"), nullptr);
    }
    if (f == 8 || f == 10) {
      EXPECT_EQ(set.find("near_infrared")->ints[3], 4321);
    }
    const std::size_t notes =
        (extended ? 1u : 0u) + (kind.extra_bytes > 0 ? 1u : 0u) + (f == 4 || f == 5 || f > 8 ? 1u : 0u);
    EXPECT_EQ(set.notes.size(), notes);
  }
}

TEST(LasReader, EightBitColoursAreToldByTheirRange) {
  std::vector<CloudPoint> points = cloud_points(2);
  for (CloudPoint& p : points) p.red = p.green = p.blue = 0;
  std::string file = as_las(points, {2, 2});
  file[file.size() - 6] = '\xff';  // red of the last point: 255 of 255, not of 65535
  const ParticleSet set = read(file);
  EXPECT_EQ(set.find("color")->floats, (std::vector<float>{0, 0, 0, 1, 0, 0}));
  EXPECT_EQ(set.notes, std::vector<std::string>{"no colour is above 255: they were taken as 8 bits"});
}

TEST(LasReader, ErrorsNameFileAndOffset) {
  const std::string file = as_las(cloud_points(3), {2, 0});
  const auto with = [&](std::size_t at, std::string_view bytes) {
    std::string changed = file;
    return particle_error(changed.replace(at, bytes.size(), bytes));
  };
  EXPECT_EQ(with(104, "\x80"),
            "some.file: offset 104: point format: the points are packed (LAZ), which is not read; unpack them first "
            "(laszip, pdal)");
  EXPECT_EQ(with(104, "\x0b"), "some.file: offset 104: point format: 11 is not one of 0 to 10");
  EXPECT_EQ(with(104, "\x03"), "some.file: offset 105: point record length: 20 bytes, but points of format 3 take 34");
  EXPECT_EQ(with(25, "\x05"), "some.file: offset 24: version: LAS 1.5 is not supported, only 1.0 to 1.4");
  EXPECT_EQ(with(107, "\x04"),
            "some.file: offset 291: points: 4 times 20 bytes are announced, but only 60 are left in the file");
  EXPECT_EQ(with(107, std::string_view("\0", 1)),
            "some.file: offset 107: number of points: the file holds no particles");
  EXPECT_EQ(with(131, std::string(8, '\0')), "some.file: offset 131: scale factor: it is 0");
  EXPECT_EQ(with(131, "\xff\xff\xff\xff\xff\xff\xff\xff"), "some.file: offset 131: scale factor: it is not finite");
  EXPECT_EQ(with(96, "\xff\xff\xff\xff"),
            "some.file: offset 96: offset to the points: 4294967295 is not in the file of 351 bytes");
}

TEST(CloudNames, PlyOfScanners) {
  const ParticleSet set = read(
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n"
      "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nproperty float radius\nproperty float confidence\nproperty float curvature\n"
      "property float intensity\nend_header\n500000.0005 2 3 0 0 1 255 0 51 0.5 0.75 0.125 9\n"
      "4 5 6 1 0 0 0 0 0 0.25 1 0 8\n");
  EXPECT_EQ(set.positions[0].x, 500000.0005);
  EXPECT_EQ(set.find("normal")->floats, (std::vector<float>{0, 0, 1, 1, 0, 0}));
  EXPECT_EQ(set.find("color")->floats, (std::vector<float>{1, 0, 0.2f, 0, 0, 0}));
  EXPECT_EQ(set.find("radius")->floats, (std::vector<float>{0.5f, 0.25f}));
  EXPECT_EQ(set.find("confidence")->floats, (std::vector<float>{0.75f, 1}));
  EXPECT_EQ(set.find("curvature")->floats, (std::vector<float>{0.125f, 0}));
  EXPECT_EQ(set.find("intensity")->floats, (std::vector<float>{9, 8}));
  EXPECT_EQ(set.attributes.size(), 6u);
}

TEST(CloudNames, TablesWithoutHeader) {
  // XYZRGB, and with normals behind or before.
  ParticleSet set = read("0.5 1 2 255 0 51\n3 4 5 0 0 0\n");
  EXPECT_EQ(set.find("color")->floats, (std::vector<float>{1, 0, 0.2f, 0, 0, 0}));
  EXPECT_EQ(set.notes, std::vector<std::string>{"columns 4 to 6 were taken as the colour"});
  set = read("0.5 1 2 0 0.6 0.8 255 0 51\n3 4 5 0 0 0 0 0 0\n");
  EXPECT_EQ(set.find("normal")->floats, (std::vector<float>{0, 0.6f, 0.8f, 0, 0, 0}));
  EXPECT_EQ(set.find("color")->floats, (std::vector<float>{1, 0, 0.2f, 0, 0, 0}));
  // PTS: a count, then x y z intensity r g b.
  set = read("2\n1.5 2 3 -812 10 20 30\n1 2 3 -800 0 0 255\n");
  EXPECT_EQ(set.find("intensity")->ints, (std::vector<std::int32_t>{-812, -800}));
  EXPECT_FLOAT_EQ(set.find("color")->floats[5], 1);
  // No bytes, no unit vectors: nothing is guessed.
  for (const char* table : {"1 2 3 4 5 256\n1 2 3 4 5 6\n", "1 2 3 0 1 1\n1 2 3 1 1 0\n", "1 2 3 0.5 0.5 0.5\n"}) {
    EXPECT_NE(read(table).find("column_4"), nullptr) << table;
    EXPECT_TRUE(read(table).notes.empty());
  }
}

}  // namespace
}  // namespace embrun

#include <gtest/gtest.h>

#include "io/particle_files.h"
#include "io/read_particles.h"

namespace embrun {
namespace {

using namespace test;

ParticleSet read(std::string_view file) { return read_particles_from_memory(as_bytes(file), "some.vtk"); }

// The solver wrote the bundled frame as VTK too, with the same bits (its documentation says so); here the file is
// built again from the BGEO in the same layout, all 110,592 particles of it.
TEST(VtkReader, EqualsTheBgeoOfTheSameFrame) {
  const ParticleSet bgeo = read_particles(EMBRUN_DATA_DIR "/dam_break.bgeo");
  const ParticleSet vtk = read(as_vtk(bgeo, true, "UNSTRUCTURED_GRID"));
  EXPECT_EQ(vtk.format, "legacy VTK binary, UNSTRUCTURED_GRID");
  ASSERT_EQ(vtk.size(), bgeo.size());
  std::size_t different = 0;
  for (std::size_t i = 0; i < vtk.size(); ++i)
    different += !(to_float(vtk.positions[i]) == to_float(bgeo.positions[i]));
  EXPECT_EQ(different, 0u);
  EXPECT_EQ(vtk.find("id")->ints, bgeo.find("id")->ints);
  EXPECT_EQ(vtk.find("velocity")->floats, bgeo.find("velocity")->floats);
  EXPECT_EQ(vtk.find("density")->floats, bgeo.find("density")->floats);
}

TEST(VtkReader, AsciiAndBinaryOfBothDatasetsAgree) {
  const ParticleSet set = some_particles(200);
  for (const bool binary : {false, true}) {
    for (const char* dataset : {"POLYDATA", "UNSTRUCTURED_GRID"}) {
      const ParticleSet again = read(as_vtk(set, binary, dataset));
      ASSERT_EQ(again.size(), set.size());
      for (std::size_t i = 0; i < set.size(); ++i) EXPECT_EQ(to_float(again.positions[i]), to_float(set.positions[i]));
      EXPECT_EQ(again.find("id")->ints, set.find("id")->ints);
      EXPECT_EQ(again.find("density")->floats, set.find("density")->floats);
      EXPECT_EQ(again.find("velocity")->floats, set.find("velocity")->floats);
    }
  }
}

// The sections that ParaView and others write around the points.
TEST(VtkReader, ReadsEveryKindOfAttribute) {
  const ParticleSet set = read(
      "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET POLYDATA\n"
      "FIELD FieldData 2\nTIME 1 1 double\n0.5\nnote 1 1 string\nhello world\n"
      "METADATA\nINFORMATION 1\nNAME L2 LOCATION vtkDataArray\nDATA 2 0 1\n\n"
      "POINTS 2 double\n0 0 0\n1 2\n3\nMETADATA\nINFORMATION 0\n\n"
      "VERTICES 1 3\n2 0 1\n"
      "CELL_DATA 1\nSCALARS cells int\nLOOKUP_TABLE default\n7\n"
      "POINT_DATA 2\nSCALARS temperature float 2\nLOOKUP_TABLE default\n1 2 3 4\n"
      "LOOKUP_TABLE default 2\n0 0 0 1 1 1 1 1\n"
      "VECTORS vel double\n1 2 3 4 5 6\nNORMALS n float\n0 0 1 0 1 0\n"
      "COLOR_SCALARS tint 3\n1 0.5 0 0 0.5 1\nTENSORS stress float\n1 2 3 4 5 6 7 8 9\n9 8 7 6 5 4 3 2 1\n"
      "TEXTURE_COORDINATES uv 2 float\n0 1 1 0\nGLOBAL_IDS gid vtkIdType\n5 6\n"
      "FIELD FieldData 4\nname%20with%20blanks 1 2 unsigned_long\n4294967296 1\n"
      "names 1 2 string\nfirst one\nsecond\nMETADATA\nINFORMATION 0\n\nflags 1 2 bit\n1 0\nvtkGhostType 1 2 "
      "unsigned_char\n0 1\n");
  ASSERT_EQ(set.size(), 2u);
  EXPECT_EQ(to_float(set.positions[1]), (Vec3{1, 2, 3}));
  EXPECT_EQ(set.find("cells"), nullptr);
  EXPECT_EQ(set.find("temperature")->floats, (std::vector<float>{1, 2, 3, 4}));
  EXPECT_EQ(set.find("temperature")->components, 2);
  EXPECT_EQ(set.find("velocity")->floats, (std::vector<float>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(set.find("velocity")->file_name, "vel");
  EXPECT_EQ(set.find("normal")->floats, (std::vector<float>{0, 0, 1, 0, 1, 0}));
  EXPECT_EQ(set.find("color")->floats, (std::vector<float>{1, 0.5f, 0, 0, 0.5f, 1}));
  EXPECT_EQ(set.find("color")->file_name, "tint");
  EXPECT_EQ(set.find("stress")->components, 9);
  EXPECT_EQ(set.find("uv")->floats, (std::vector<float>{0, 1, 1, 0}));
  EXPECT_EQ(set.find("gid")->ints, (std::vector<std::int32_t>{5, 6}));
  EXPECT_EQ(set.find("name with blanks")->longs, (std::vector<std::int64_t>{4294967296, 1}));
  EXPECT_EQ(set.find("flags")->ints, (std::vector<std::int32_t>{1, 0}));
  EXPECT_EQ(set.find("vtkGhostType")->ints, (std::vector<std::int32_t>{0, 1}));
  EXPECT_EQ(set.notes, std::vector<std::string>{"text array 'names' was left out"});
}

// Version 5 splits cells into offsets and connectivity; here with byte colours, bits and texts, all binary.
TEST(VtkReader, ReadsBinaryVersion5) {
  FileBytes file;
  file.text("# vtk DataFile Version 5.1\ntitle\nBINARY\nDATASET POLYDATA\nPOINTS 2 float\n");
  for (const float x : {0.0f, 0.0f, 0.0f, 1.0f, 2.0f, 3.0f}) file.number(x);
  file.text("\nVERTICES 3 2\nOFFSETS vtktypeint64\n");
  for (const std::int64_t offset : {0, 1, 2}) file.number(offset);
  file.text("\nCONNECTIVITY vtktypeint64\n").number(std::int64_t{0}).number(std::int64_t{1});
  file.text("\nPOINT_DATA 2\nCOLOR_SCALARS rgb 3\n").text(std::string("\xff\x00\x33\x00\x00\x00", 6));
  file.text("\nFIELD FieldData 3\nflags 1 2 bit\n\x40\n");
  // Length 3 in six bits after the bits 11; length 300 in 14 bits after the bits 10.
  file.text(
          "names 1 2 string\n\xc3"
          "abc")
      .number(static_cast<std::uint16_t>(0x8000 | 300))
      .text(std::string(300, 'x'));
  file.text("\nmass 1 2 double\n").number(0.5).number(0.25).text("\nMETADATA\nINFORMATION 0\n\n");
  const ParticleSet set = read(file.str());
  ASSERT_EQ(set.size(), 2u);
  EXPECT_EQ(to_float(set.positions[1]), (Vec3{1, 2, 3}));
  EXPECT_EQ(set.find("color")->floats, (std::vector<float>{1, 0, 0.2f, 0, 0, 0}));
  EXPECT_EQ(set.find("flags")->ints, (std::vector<std::int32_t>{0, 1}));
  EXPECT_EQ(set.find("mass")->floats, (std::vector<float>{0.5f, 0.25f}));
}

// SCALARS without LOOKUP_TABLE, as some writers have it.
TEST(VtkReader, TheLookupTableLineMayBeMissing) {
  FileBytes file;
  file.text("# vtk DataFile Version 2.0\n\nBINARY\nDATASET POLYDATA\nPOINTS 1 float\n");
  file.number(1.0f).number(2.0f).number(3.0f).text("\nPOINT_DATA 1\nSCALARS density float\n").number(998.0f).text("\n");
  EXPECT_EQ(read(file.str()).find("density")->floats, std::vector<float>{998});
}

TEST(VtkReader, ErrorsNameFilePlaceAndArray) {
  const std::string ascii = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET POLYDATA\n";
  const std::string points = ascii + "POINTS 2 float\n0 0 0 1 2 3\n";
  ASSERT_EQ(particle_error(points), "");
  EXPECT_EQ(particle_error(ascii), "some.file: line 5: POINTS: the file has none");
  EXPECT_EQ(particle_error(ascii + "POINTS 0 float\n"), "some.file: line 5: POINTS: the file holds no particles");
  EXPECT_EQ(particle_error(ascii + "POINTS 2 float\n0 0 0 1 2 x\n"),
            "some.file: line 6: 'position': 'x' is no number of its type");
  EXPECT_EQ(particle_error(ascii + "POINTS 2 float\n0 0 0 1 2.125\n"),
            "some.file: line 7: 'position': the file ends after 5 of 6 numbers");
  EXPECT_EQ(particle_error(ascii + "POINTS 1000000000 float\n0 0 0\n"),
            "some.file: line 5: 'position': 1000000000 numbers are announced, but only 7 bytes are left in the file");
  EXPECT_EQ(particle_error(ascii + "POINTS 18446744073709551615 float\n0 0 0\n").substr(0, 35),
            "some.file: line 5: 'position': 1844");
  EXPECT_EQ(particle_error(points + "POINT_DATA 3\n"), "some.file: line 7: POINT_DATA: 3 values for 2 points");
  EXPECT_EQ(particle_error(points + "POINT_DATA 2\nFIELD f 1\nrho 1 3 float\n1 2 3\n"),
            "some.file: line 9: 'rho': 3 values for 2 points");
  EXPECT_EQ(particle_error(points + "POINT_DATA 2\nVECTORS v real\n"),
            "some.file: line 8: vectors: 'real' is not a type that is read");
  EXPECT_EQ(particle_error(points + "NONSENSE 1\n"), "some.file: line 7: 'NONSENSE' is not a VTK keyword");
  EXPECT_EQ(
      particle_error("# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n"),
      "some.file: line 4: DATASET: 'STRUCTURED_POINTS' has no particles; POLYDATA and UNSTRUCTURED_GRID are read");
  EXPECT_EQ(particle_error("# vtk DataFile Version 3.0\nt\nXML\n"),
            "some.file: line 3: header: 'xml' is neither ASCII nor BINARY");
  const std::string binary = "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET POLYDATA\nPOINTS 2 float\n";
  EXPECT_EQ(particle_error(binary + std::string(20, '\0')),
            "some.file: offset 68: 'position': 2 times 12 bytes are announced, but only 20 are left in the file");
}

}  // namespace
}  // namespace embrun

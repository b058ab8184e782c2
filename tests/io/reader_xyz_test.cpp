#include <gtest/gtest.h>

#include "io/particle_files.h"
#include "io/read_particles.h"

namespace embrun {
namespace {

using namespace test;

ParticleSet read(std::string_view file) { return read_particles_from_memory(as_bytes(file), "some.csv"); }

TEST(XyzReader, ReadsEverySeparator) {
  const ParticleSet set = some_particles(200);
  for (const char separator : {',', ';', '\t', ' '}) {
    const ParticleSet again = read(as_csv(set, separator, true));
    ASSERT_EQ(again.size(), 200u);
    for (std::size_t i = 0; i < set.size(); ++i) EXPECT_EQ(to_float(again.positions[i]), to_float(set.positions[i]));
    EXPECT_EQ(again.find("id")->ints, set.find("id")->ints);
    EXPECT_EQ(again.find("density")->floats, set.find("density")->floats);
    EXPECT_EQ(again.find("velocity")->floats, set.find("velocity")->floats);
  }
}

TEST(XyzReader, ReadsWithoutHeader) {
  const ParticleSet set = some_particles(50);
  const ParticleSet again = read(as_csv(set, ' ', false));
  ASSERT_EQ(again.size(), 50u);
  EXPECT_EQ(to_float(again.positions[49]), to_float(set.positions[49]));
  // Columns x y z id vx vy vz density.
  EXPECT_EQ(again.find("column_4")->ints, set.find("id")->ints);
  EXPECT_EQ(again.find("column_8")->floats, set.find("density")->floats);
}

TEST(XyzReader, UnderstandsCommentsBlankLinesQuotesAndUnits) {
  const ParticleSet set = read(
      "\xef\xbb\xbf# a table\r\n\r\n\"X [m]\", \"Y [m]\" ,\"Z [m]\",\"rho, \"\"wet\"\"\",Cd\r\n1, 2, 3, 998,5\r\n"
      "// half way\r\n+4e0,5.,.6e1,999,6,\r\n% end\r\n");
  ASSERT_EQ(set.size(), 2u);
  EXPECT_EQ(to_float(set.positions[1]), (Vec3{4, 5, 6}));
  ASSERT_NE(set.find("rho, \"\"wet\"\""), nullptr);
  EXPECT_EQ(set.find("Cd")->ints, (std::vector<std::int32_t>{5, 6}));  // one component: no colour
}

TEST(XyzReader, FindsColumnsByName) {
  const ParticleSet set = read("id,vz,vy,vx,z,y,x,pscale,r,g,b\n9,3,2,1,30,20,10,0.5,255,0,51\n");
  EXPECT_EQ(to_float(set.positions[0]), (Vec3{10, 20, 30}));
  // Whole numbers in the table, real numbers for the renderer.
  EXPECT_EQ(set.find("velocity")->floats, (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(set.find("radius")->floats, std::vector<float>{0.5f});
  EXPECT_EQ(set.find("color")->floats, (std::vector<float>{1, 0, 0.2f}));
  // ParaView's export.
  const ParticleSet paraview =
      read("\"velocity:0\",\"velocity:1\",\"velocity:2\",\"Points:0\",\"Points:1\",\"Points:2\"\n1,2,3,4,5,6\n");
  EXPECT_EQ(to_float(paraview.positions[0]), (Vec3{4, 5, 6}));
  EXPECT_EQ(paraview.find("velocity")->value(1), 2);
  // A header in a comment, as numpy.savetxt writes it.
  const ParticleSet numpy = read("# x y z density\n1 2 3 4\n");
  EXPECT_EQ(numpy.find("density")->value(0), 4);
}

TEST(XyzReader, DecimalCommasBetweenSemicolons) {
  const ParticleSet set = read("x;y;z\n0,5;1,25;-2\n");
  EXPECT_EQ(to_float(set.positions[0]), (Vec3{0.5f, 1.25f, -2}));
}

TEST(XyzReader, KeepsWordsAndWholeNumbers) {
  const ParticleSet set = read("kind,x,y,z,big\nwater,1,2,3,9007199254740993\nfoam,4,5,6,1\nwater,7,8,9,2\n");
  ASSERT_EQ(set.size(), 3u);
  EXPECT_EQ(set.find("type")->strings, (std::vector<std::string>{"water", "foam"}));
  EXPECT_EQ(set.find("kind")->ints, (std::vector<std::int32_t>{0, 1, 0}));
  // 2^53 + 1: no double holds it.
  EXPECT_EQ(set.find("big")->longs, (std::vector<std::int64_t>{9007199254740993, 1, 2}));
}

TEST(XyzReader, ReadsTheChemistsFormat) {
  const ParticleSet set = read("2\na comment\nO 1 2 3\nH 4 5 6\n");
  ASSERT_EQ(set.size(), 2u);
  EXPECT_EQ(to_float(set.positions[1]), (Vec3{4, 5, 6}));
  EXPECT_EQ(set.find("element")->strings, (std::vector<std::string>{"O", "H"}));
  EXPECT_EQ(read("1\n\nO 1 2 3\n").size(), 1u);
  EXPECT_EQ(read("2\n1 2 3\n4 5 6\n").size(), 2u);  // a count without a comment
  EXPECT_EQ(read("1\nc\nO 1 2 3\n1\nc\nO 4 5 6\n").notes,
            std::vector<std::string>{"only the first of several frames was read"});
  EXPECT_EQ(particle_error("3\nc\nO 1 2 3\n"), "some.file: line 3: number of particles: 3 are announced, 1 are there");
  EXPECT_EQ(particle_error("1\nc\nO 1 2 3\nH 1 2 3\n"),
            "some.file: line 4: number of particles: 1 are announced, but there are more");
}

TEST(XyzReader, NonFiniteAndMissingValues) {
  const ParticleSet set =
      read("x,y,z,id,t\n1,2,3,7,0.5\nnan,0,0,8,1\n0,-inf,0,9,1\n0,,0,9,1\n0,1e999,0,9,1\n4,5,1e-999,,inf\n");
  ASSERT_EQ(set.size(), 2u);
  EXPECT_EQ(set.dropped_non_finite, 4u);
  EXPECT_EQ(set.positions[1].z, 0.0);
  EXPECT_EQ(set.find("id")->ints, (std::vector<std::int32_t>{7, 0}));
  EXPECT_EQ(set.find("id")->replaced_non_finite, 1u);
  EXPECT_EQ(set.find("t")->floats, (std::vector<float>{0.5f, 0}));
  EXPECT_EQ(particle_error("x y z\n\nnan 0 0\n"),
            "some.file: line 3: position: none of the 1 particles has a finite position");
}

TEST(XyzReader, ErrorsNameFileLineAndColumn) {
  ASSERT_EQ(particle_error("x,y,z\n1,2,3\n"), "");
  EXPECT_EQ(particle_error("x,y,z\n1,2,3\n# c\n1,2\n"), "some.file: line 4: 2 values on the line, 3 columns");
  EXPECT_EQ(particle_error("x,y,z\n1,2,3\n1,two,3\n"), "some.file: line 3: column 'y': 'two' is not a number");
  EXPECT_EQ(particle_error("x,y,z\n"), "some.file: line 1: the file holds no particles");
  EXPECT_EQ(particle_error("# nothing\n"), "some.file: line 1: the file holds no particles");
  EXPECT_EQ(particle_error("a,b,c\n1,2,3\n"),
            "some.file: line 2: position: no columns x, y and z of numbers; there are 'a', 'b', 'c'");
  EXPECT_EQ(particle_error("1 2\n3 4\n"),
            "some.file: line 1: position: 2 numbers on the line where x, y and z are needed");
  EXPECT_EQ(particle_error("x y z\n# c\n1 2 3\n\n1 2e18 3\n"),
            "some.file: line 5: position: coordinate 2e+18 of particle 1 is beyond 1e+15 m: single precision cannot "
            "render that");
}

TEST(FormatByContent, NamesWhatItIsNot) {
  EXPECT_EQ(particle_error(""), "some.file: offset 0: the file is empty");
  EXPECT_NE(particle_error("\x7fNSJb").find("newer binary BGEO"), std::string::npos);
  EXPECT_NE(particle_error("<?xml version=\"1.0\"?>\n<VTKFile>").find("legacy VTK"), std::string::npos);
  EXPECT_NE(particle_error(std::string("\x89PNG\r\n\x1a\n\0\0", 10)).find("offset 0: format: starts with '?PNG"),
            std::string::npos);
}

}  // namespace
}  // namespace embrun

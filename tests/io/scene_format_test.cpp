// The format itself: parameters, includes, references, values, transforms, what is refused and where.

#include "io/scene_files.h"

namespace embrun {
namespace {

using namespace test;

// ---- parameters and includes -------------------------------------------------------------------------------------

const char* sphere_with_radius = "<shape type=\"sphere\"><float name=\"radius\" value=\"$r\"/></shape>";

TEST(SceneParameters, DefaultsGiveAValueAndTheCallersOverruleIt) {
  const std::string elements = std::string("<default name=\"r\" value=\"2.5\"/>") + sphere_with_radius;
  EXPECT_EQ(read_elements(elements).scene.balls[0].balls[0].radius, 2.5);
  EXPECT_EQ(read_elements(elements, {{"r", "4"}}).scene.balls[0].balls[0].radius, 4);
}

TEST(SceneParameters, TheLongestNameCounts) {
  const std::string elements =
      "<default name=\"r\" value=\"1\"/><default name=\"r_big\" value=\"7\"/>"
      "<shape type=\"sphere\"><float name=\"radius\" value=\"$r_big\"/></shape>"
      "<shape type=\"sphere\"><float name=\"radius\" value=\"$r0\"/></shape>";
  const SceneDescription scene = scene_of(elements);
  EXPECT_EQ(scene.balls[0].balls[0].radius, 7);
  EXPECT_EQ(scene.balls[0].balls[1].radius, 10);  // $r and then 0
}

TEST(SceneParameters, AreMissedWithTheirPlace) {
  EXPECT_EQ(
      error_of(std::string("\n") + sphere_with_radius),
      "/scenes/scene.xml: line 3: float: the parameter '$r' has no value: give it one by a <default> above, or by "
      "-D r=VALUE");
  EXPECT_EQ(error_of(sphere_with_radius, {{"r", "1"}, {"q", "2"}}),
            "/scenes/scene.xml: nothing in it uses the parameter $q");
  EXPECT_NE(error_of(sphere_with_radius, {{"", "1"}}).find("the parameter's name ''"), std::string::npos);
}

TEST(SceneIncludes, AreRelativeToTheFileThatNamesThem) {
  const Files files = {
      {"/scenes/scene.xml",
       whole("<default name=\"r\" value=\"3\"/>\n<include filename=\"parts/ball.xml\"/>\n<shape type=\"ply\"><string "
             "name=\"filename\" value=\"square.ply\"/></shape>")},
      {"/scenes/parts/ball.xml",
       "<scene version=\"3.0.0\"><include filename=\"other.xml\"/>" + std::string(sphere_with_radius) + "</scene>"},
      {"/scenes/parts/other.xml",
       "<scene version=\"3.0.0\"><shape type=\"ply\"><string name=\"filename\" "
       "value=\"square.ply\"/></shape></scene>"},
      {"/scenes/square.ply", square_ply},
      {"/scenes/parts/square.ply", square_ply}};
  const SceneDescription scene = read_file(files).scene;
  EXPECT_EQ(scene.balls[0].balls[0].radius, 3);
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0].file, "/scenes/parts/square.ply");
  EXPECT_EQ(scene.meshes[1].file, "/scenes/square.ply");
}

TEST(SceneIncludes, MustEnd) {
  const Files cycle = {{"/scenes/scene.xml", whole("<include filename=\"scene.xml\"/>")}};
  EXPECT_THROW(read_file(cycle), Error);
  // Each level includes the next twice: 2^16 files in all.
  Files bomb = {{"/scenes/scene.xml", whole("<include filename=\"0.xml\"/>")}};
  for (int i = 0; i < 15; ++i) {
    const std::string next = "<include filename=\"" + std::to_string(i + 1) + ".xml\"/>";
    bomb["/scenes/" + std::to_string(i) + ".xml"] = "<scene>" + next + next + "</scene>";
  }
  bomb["/scenes/15.xml"] = "<scene/>";
  EXPECT_THROW(read_file(bomb), Error);
}

TEST(SceneIncludes, ErrorsAreLocatedInTheIncludedFile) {
  const Files files = {{"/scenes/scene.xml", whole("<include filename=\"a.xml\"/>")},
                       {"/scenes/a.xml", "<scene>\n\n<shape type=\"teapot\"/></scene>"}};
  try {
    read_file(files);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(
        std::string(error.what()).rfind("/scenes/a.xml: line 3: shape \"teapot\": this shape is not supported", 0), 0u)
        << error.what();
  }
}

// ---- references --------------------------------------------------------------------------------------------------

TEST(SceneReferences, ReachForwardAndThroughEachOther) {
  const SceneDescription scene = scene_of(
      "<shape type=\"sphere\"><ref id=\"red\"/></shape>"
      "<bsdf type=\"diffuse\" id=\"red\"><rgb name=\"reflectance\" value=\"0.5 0 0\"/></bsdf>");
  EXPECT_EQ(scene.balls[0].material.reflectance.first, (Rgb{0.5f, 0, 0}));
}

TEST(SceneReferences, ThatLeadNowhereAreErrors) {
  EXPECT_EQ(error_of("<shape type=\"sphere\"><ref id=\"red\"/></shape>"),
            "/scenes/scene.xml: line 2: ref: nothing has the id 'red'");
  EXPECT_NE(error_of("<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"diffuse\" id=\"a\"/>")
                .find("line 3: bsdf: the id 'a' is given twice"),
            std::string::npos);
  EXPECT_NE(error_of("<shape type=\"sphere\" id=\"s\"/><shape type=\"sphere\"><ref id=\"s\"/></shape>")
                .find("<ref> to 's' is not supported here"),
            std::string::npos);
}

// ---- values ------------------------------------------------------------------------------------------------------

Rgb reflectance_of(const std::string& property) {
  return scene_of("<shape type=\"sphere\"><bsdf type=\"diffuse\">" + property + "</bsdf></shape>")
      .balls[0]
      .material.reflectance.first;
}

TEST(SceneValues, Colors) {
  EXPECT_EQ(reflectance_of("<rgb name=\"reflectance\" value=\"0.1, 0.2,0.3\"/>"), (Rgb{0.1f, 0.2f, 0.3f}));
  EXPECT_EQ(reflectance_of("<rgb name=\"reflectance\" value=\"0.25\"/>"), grey(0.25f));
  EXPECT_EQ(reflectance_of("<float name=\"reflectance\" value=\"0.25\"/>"), grey(0.25f));
  EXPECT_EQ(reflectance_of("<spectrum name=\"reflectance\" value=\"0.25\"/>"), grey(0.25f));
  // 0x80 / 255 = 0.50196, ((0.50196 + 0.055) / 1.055)^2.4 = 0.215861; 0x0a / 255 / 12.92 = 0.0030353.
  expect_near(reflectance_of("<rgb name=\"reflectance\" value=\"#ff800A\"/>"), {1, 0.215861f, 0.0030353f}, 1e-6f);
  EXPECT_EQ(reflectance_of(""), grey(0.5f));
}

TEST(SceneValues, SpectraBecomeColors) {
  // What reflects everything is white in daylight.
  expect_near(reflectance_of("<spectrum name=\"reflectance\" value=\"360:1, 830:1\"/>"), grey(1), 1e-6f);
  // Half of it below a wavelength between red and green: red is what is left.
  const Rgb red = reflectance_of("<spectrum name=\"reflectance\" value=\"360:0 599:0 600:1 830:1\"/>");
  EXPECT_GT(red.r, 0.8f);
  EXPECT_LT(red.g, 0.1f);
  EXPECT_LT(red.b, 0.02f);
}

TEST(SceneValues, WhatIsNoNumberIsLocated) {
  const auto error = [](const std::string& value) {
    return error_of("<shape type=\"sphere\">\n<float name=\"radius\" value=\"" + value + "\"/></shape>");
  };
  EXPECT_EQ(error("one"), "/scenes/scene.xml: line 3: float: 'radius' is 'one', which is no finite number");
  for (const char* bad : {"nan", "inf", "-inf", "1e999", "", "1 2", "0x10", "1,5"})
    EXPECT_NE(error(bad).find("no finite number"), std::string::npos) << bad << error(bad);
  EXPECT_NE(error_of("<integrator type=\"path\"><integer name=\"max_depth\" value=\"2.5\"/></integrator>")
                .find("'max_depth' is 2.5: it has to be a whole number"),
            std::string::npos);
}

TEST(SceneValues, OldNamesAreUnderstood) {
  const SceneDescription scene = scene_of(
      "<integrator type=\"path\"><integer name=\"maxDepth\" value=\"7\"/><integer name=\"rrDepth\" "
      "value=\"3\"/></integrator>"
      "<sensor type=\"perspective\"><string name=\"fovAxis\" value=\"y\"/><float name=\"fov\" value=\"30\"/>"
      "<transform name=\"toWorld\"><lookAt origin=\"1,2,3\" target=\"0,0,0\" up=\"0,1,0\"/></transform>"
      "<sampler type=\"independent\"><integer name=\"sampleCount\" value=\"9\"/></sampler></sensor>"
      "<shape type=\"sphere\"><bsdf type=\"dielectric\"><float name=\"intIOR\" value=\"1.4\"/><float name=\"extIOR\" "
      "value=\"1\"/></bsdf></shape>");
  EXPECT_EQ(scene.integrator.max_depth, 6);
  EXPECT_EQ(scene.integrator.roulette_depth, 3);
  EXPECT_EQ(scene.integrator.samples, 9);
  EXPECT_EQ(scene.camera.vertical_fov, 30);
  EXPECT_EQ(scene.camera.eye, (Vec3d{1, 2, 3}));
  EXPECT_EQ(scene.balls[0].material.ior, 1.4);
}

// ---- transforms --------------------------------------------------------------------------------------------------

Placement placement_by(const std::string& steps) {
  return scene_of("<shape type=\"ply\"><string name=\"filename\" value=\"square.ply\"/><transform name=\"to_world\">" +
                  steps + "</transform></shape>")
      .meshes[0]
      .placement;
}

// The first step is applied first: (1, 2, 3) doubled is (2, 4, 6), turned by 90 degrees about z (-4, 2, 6), moved by
// (10, 0, 0) (6, 2, 6).
TEST(SceneTransforms, AreAppliedInTheirOrder) {
  const Placement m = placement_by("<scale value=\"2\"/><rotate z=\"1\" angle=\"90\"/><translate x=\"10\"/>");
  expect_near(place(m, {1, 2, 3}), {6, 2, 6});
  // The other way round: (11, 2, 3), (-2, 11, 3), (-4, 22, 6).
  expect_near(place(placement_by("<translate x=\"10\"/><rotate z=\"1\" angle=\"90\"/><scale value=\"2\"/>"), {1, 2, 3}),
              {-4, 22, 6});
}

TEST(SceneTransforms, EachKindOfStep) {
  expect_near(place(placement_by("<scale x=\"2\" z=\"-1\"/>"), {1, 2, 3}), {2, 2, -3});
  expect_near(place(placement_by("<scale value=\"1, 2, 3\"/>"), {1, 1, 1}), {1, 2, 3});
  expect_near(place(placement_by("<translate value=\"1 2 3\"/>"), {1, 1, 1}), {2, 3, 4});
  // A third of a turn about (1, 1, 1) takes x to y, y to z, z to x.
  expect_near(place(placement_by("<rotate value=\"1, 1, 1\" angle=\"120\"/>"), {1, 2, 3}), {3, 1, 2}, 1e-12);
  // Row by row.
  expect_near(place(placement_by("<matrix value=\"1 2 3 4  5 6 8 8  9 10 11 12  0 0 0 1\"/>"), {1, 10, 100}),
              {325, 873, 1221});
  expect_near(place(placement_by("<matrix value=\"1 2 3  5 6 8  9 10 11\"/>"), {1, 10, 100}), {321, 865, 1209});
  // A lookat takes +z to the direction of view, +y upwards, and +x to the left.
  const Placement view = placement_by("<lookat origin=\"1,2,3\" target=\"1,2,-7\" up=\"0,5,0\"/>");
  expect_near(place(view, {0, 0, 0}), {1, 2, 3});
  expect_near(place_vector(view, {0, 0, 1}), {0, 0, -1});
  expect_near(place_vector(view, {0, 1, 0}), {0, 1, 0});
  expect_near(place_vector(view, {1, 0, 0}), {-1, 0, 0});
}

// Quarter turns leave no dust: a box that is turned by one is still a box.
TEST(SceneTransforms, QuarterTurnsAreExact) {
  EXPECT_EQ(place(placement_by("<rotate x=\"1\" angle=\"-90\"/>"), {1, 2, 3}), (Vec3d{1, 3, -2}));
  EXPECT_EQ(place(placement_by("<rotate y=\"1\" angle=\"180\"/>"), {1, 2, 3}), (Vec3d{-1, 2, -3}));
}

TEST(SceneTransforms, BadOnesAreErrors) {
  const auto error = [](const std::string& step) {
    return error_of("<shape type=\"sphere\"><transform name=\"to_world\">" + step + "</transform></shape>");
  };
  EXPECT_NE(error("<rotate angle=\"3\"/>").find("rotate: the axis is 0,0,0"), std::string::npos);
  EXPECT_NE(error("<rotate x=\"1\"/>").find("the attribute 'angle' (degrees) is missing"), std::string::npos);
  EXPECT_NE(error("<matrix value=\"1 2 3\"/>").find("3 numbers: 16"), std::string::npos);
  EXPECT_NE(error("<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\"/>").find("projections are not supported"),
            std::string::npos);
  EXPECT_NE(error("<shear x=\"1\"/>").find("<shear> is not supported"), std::string::npos);
  EXPECT_NE(error("<lookat origin=\"0,0,0\" target=\"0,1,0\" up=\"0,2,0\"/>").find("up vector is along the view"),
            std::string::npos);
  EXPECT_NE(error("<scale value=\"1e200\"/><scale value=\"1e200\"/>").find("is not finite"), std::string::npos);
  EXPECT_NE(error("<scale x=\"2\"/>").find("scales it unevenly"), std::string::npos);
}

// ---- what is refused ---------------------------------------------------------------------------------------------

TEST(SceneErrors, NameWhatIsNotUnderstood) {
  EXPECT_EQ(error_of("<shape type=\"sphere\">\n  <float name=\"radus\" value=\"1\"/></shape>"),
            "/scenes/scene.xml: line 3: shape \"sphere\": <float> named 'radus' is not supported here; properties are "
            "center, exterior, flip_normals, interior, meridian, pole, radius, to_world");
  EXPECT_NE(error_of("<shape type=\"sphere\"><texture type=\"bitmap\"/></shape>")
                .find("<texture type=\"bitmap\"> is not supported here"),
            std::string::npos);
  EXPECT_NE(error_of("<shape type=\"sphere\"><string name=\"radius\" value=\"1\"/></shape>")
                .find("'radius' is a <string>; it has to be a <float> or <integer>"),
            std::string::npos);
  EXPECT_NE(
      error_of(
          "<shape type=\"sphere\"><float name=\"radius\" value=\"1\"/><float name=\"radius\" value=\"2\"/></shape>")
          .find("'radius' is given twice"),
      std::string::npos);
  EXPECT_NE(error_of("<mesh type=\"grid\"/>").find("<mesh type=\"grid\"> is not supported here"), std::string::npos);
  EXPECT_NE(error_of("<medium type=\"homogeneous\"/>").find("it belongs to nothing"), std::string::npos);
  EXPECT_NE(error_of("some text").find("the text 'some text' is outside of any attribute"), std::string::npos);
}

TEST(SceneErrors, UnusedAttributesWarn) {
  const SceneFile file =
      read_elements("<shape type=\"sphere\">\n<float name=\"radius\" value=\"1\" unit=\"m\"/></shape>");
  ASSERT_EQ(file.warnings.size(), 1u);
  EXPECT_EQ(file.warnings[0], "/scenes/scene.xml: line 3: float: the attribute 'unit' is not used");
}

TEST(SceneErrors, SettingsWithoutEffectWarn) {
  const SceneFile file = read_elements(
      "<sensor type=\"perspective\"><float name=\"near_clip\" value=\"0.1\"/><film type=\"hdrfilm\"><string "
      "name=\"pixel_format\" value=\"rgb\"/></film></sensor>");
  ASSERT_EQ(file.warnings.size(), 2u);
  EXPECT_NE(file.warnings[0].find("'pixel_format' has no effect"), std::string::npos);
  EXPECT_NE(file.warnings[1].find("'near_clip' has no effect"), std::string::npos);
}

// ---- hostile files -----------------------------------------------------------------------------------------------

std::string error_of_file(const std::string& file) {
  try {
    read_file({{"/scenes/scene.xml", file}});
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(SceneHostile, EndsInOneLocatedError) {
  const std::string broken[] = {
      "",
      " ",
      "<",
      "<scene",
      "<scene>",
      "<scene></scene",
      "<scene/><scene/>",
      "no xml",
      std::string(1000, '<'),
      "<scene><shape type='sphere'></scene>",
      "<bsdf type=\"diffuse\"/>",
      "<scene>&bomb;</scene>",
      "<!DOCTYPE scene [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]><scene><shape type=\"&b;\"/></scene>",
      std::string("<scene>\0</scene>", 16),
      "\xff\xfe<\0s\0c\0e\0n\0e\0/\0>\0",
      "<scene><default/></scene>",
      "<scene><default name=\"a b\" value=\"1\"/></scene>",
      "<scene><include/></scene>",
      "<scene><include filename=\"nothing.xml\"/></scene>",
      "<scene><shape/></scene>",
      "<scene><sensor/></scene>",
      "<scene><shape type=\"$\"/></scene>"};
  for (const std::string& file : broken) {
    const std::string error = error_of_file(file);
    EXPECT_NE(error, "no error") << file;
    EXPECT_EQ(error.find("/scenes/"), 0u) << file << "\n" << error;
    for (const char c : error) EXPECT_GE(c, ' ') << file;
  }
}

TEST(SceneHostile, DeepNestingIsRefused) {
  std::string file = "<scene>";
  for (int i = 0; i < 200000; ++i) file += "<bsdf type=\"twosided\">";
  for (int i = 0; i < 200000; ++i) file += "</bsdf>";
  EXPECT_NE(error_of_file(file + "</scene>").find("nested more than 64 deep"), std::string::npos);
}

TEST(SceneHostile, ManyInstancesOfManyShapesAreRefused) {
  std::string group = "<shape type=\"shapegroup\" id=\"g\">", instances;
  for (int i = 0; i < 2000; ++i) group += "<shape type=\"sphere\"/>";
  for (int i = 0; i < 2000; ++i) instances += "<shape type=\"instance\"><ref id=\"g\"/></shape>";
  EXPECT_NE(error_of(group + "</shape>" + instances).find("more than 1000000 shapes"), std::string::npos);
}

}  // namespace
}  // namespace embrun

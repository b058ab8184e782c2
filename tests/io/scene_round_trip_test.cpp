// What is written reads back the same.

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "io/scene_files.h"

namespace embrun {
namespace {

using namespace test;

/// Writes the scene, reads that, and expects the same; returns the text.
std::string expect_same_again(const SceneDescription& scene, Files files = {}) {
  files["/scenes/scene.xml"] = write_scene(scene);
  const SceneFile again = read_file(files);
  EXPECT_TRUE(again.warnings.empty()) << again.warnings[0];
  EXPECT_TRUE(again.scene == scene) << files["/scenes/scene.xml"] << "\nand again:\n" << write_scene(again.scene);
  EXPECT_EQ(write_scene(again.scene), files["/scenes/scene.xml"]);
  return files["/scenes/scene.xml"];
}

/// Numbers without a short decimal form.
const Vec3d odd{1.0 / 3, -2.0 / 7, 1e-17};

TEST(SceneRoundTrip, OfWhatAFileSays) {
  const Files files = {{"/scenes/square.ply", square_ply},
                       {"/scenes/p.csv", "x,y,z,density\n0,0,0,1\n1,0,0,2\n0,1,0,3\n"},
                       {"/scenes/sky.pfm", "PF\n4 2\n-1\n" + std::string(4 * 2 * 3 * sizeof(float), '\0')}};
  const std::string elements =
      "<integrator type=\"volpath\"><integer name=\"max_depth\" value=\"12\"/></integrator>"
      "<sensor type=\"thinlens\"><float name=\"fov\" value=\"37\"/><float name=\"aperture_radius\" value=\"0.01\"/>"
      "<transform name=\"to_world\"><scale x=\"-1\"/><lookat origin=\"0.1,0.2,0.3\" target=\"1,2,3\" up=\"0,0,1\"/>"
      "</transform><film type=\"hdrfilm\"><integer name=\"width\" value=\"123\"/><integer name=\"crop_width\" "
      "value=\"7\"/><rfilter type=\"gaussian\"><float name=\"stddev\" value=\"0.4\"/></rfilter></film><sampler "
      "type=\"independent\"><integer name=\"seed\" value=\"4294967295\"/></sampler></sensor>"
      "<emitter type=\"envmap\"><string name=\"filename\" value=\"sky.pfm\"/><float name=\"scale\" value=\"0.3\"/>"
      "<transform name=\"to_world\"><rotate y=\"1\" angle=\"33\"/><rotate x=\"1\" angle=\"90\"/></transform></emitter>"
      "<bsdf type=\"dielectric\" id=\"water\"><string name=\"int_ior\" value=\"water\"/></bsdf>"
      "<medium type=\"homogeneous\" id=\"milk\"><rgb name=\"sigma_t\" value=\"0.1 0.2 0.3\"/><phase "
      "type=\"hg\"/></medium>"
      "<shape type=\"particles\"><string name=\"filename\" value=\"p.csv\"/><float name=\"radius\" "
      "value=\"0.1\"/><string "
      "name=\"density\" value=\"density\"/><phase type=\"rayleigh\"/><transform name=\"to_world\"><scale "
      "value=\"0.7\"/><translate y=\"0.1\"/></transform></shape>"
      "<shape type=\"particles\"><string name=\"filename\" value=\"p.csv\"/><float name=\"radius\" "
      "value=\"0.1\"/><string "
      "name=\"kind\" value=\"foam\"/><string name=\"density\" value=\"density\"/></shape>"
      "<shape type=\"particles\"><string name=\"filename\" value=\"p.csv\"/><float name=\"radius\" "
      "value=\"0.1\"/><string "
      "name=\"kind\" value=\"bubble\"/></shape>"
      "<shape type=\"particles\"><string name=\"filename\" value=\"p.csv\"/><string name=\"kinds\" "
      "value=\"density:1=foam\"/><string name=\"kind\" value=\"foam\"/><float name=\"radius\" value=\"0.1\"/></shape>"
      "<shape type=\"particles\"><string name=\"filename\" value=\"p.csv\"/><string name=\"kinds\" "
      "value=\"density:1=foam\"/><float name=\"radius\" value=\"0.1\"/><float name=\"wall_overlap\" "
      "value=\"0.02\"/><string name=\"method\" value=\"mesh\"/><float name=\"mesh_cell\" value=\"0.03\"/>"
      "<float name=\"density_cell\" value=\"0.04\"/></shape>"
      "<shape type=\"particles\"><string name=\"filename\" value=\"p.csv\"/><float name=\"radius\" value=\"0.1\"/>"
      "<float name=\"detail\" value=\"1.5\"/></shape>"
      "<shape type=\"sphere\"><ref id=\"water\"/><ref name=\"interior\" id=\"milk\"/></shape>"
      "<shape type=\"sphere\"><ref id=\"water\"/><ref name=\"interior\" id=\"milk\"/><float name=\"radius\" "
      "value=\"0.3\"/></shape>"
      "<shape type=\"sphere\"><emitter type=\"area\"><rgb name=\"radiance\" value=\"0.1\"/></emitter></shape>"
      "<shape type=\"cube\"><bsdf type=\"null\"/><ref name=\"interior\" id=\"milk\"/></shape>"
      "<shape type=\"cube\"><transform name=\"to_world\"><rotate value=\"1 1 0\" angle=\"20\"/></transform></shape>"
      "<shape type=\"rectangle\"><transform name=\"to_world\"><rotate value=\"1 2 0\" "
      "angle=\"20\"/></transform></shape>"
      "<shape type=\"disk\"/><shape type=\"cylinder\"><float name=\"radius\" value=\"0.1\"/></shape>"
      "<shape type=\"shapegroup\" id=\"g\"><shape type=\"ply\"><string name=\"filename\" "
      "value=\"square.ply\"/><boolean "
      "name=\"face_normals\" value=\"true\"/><boolean name=\"flip_normals\" value=\"true\"/></shape></shape>"
      "<shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><rotate x=\"1\" "
      "angle=\"5\"/></transform></shape>"
      "<shape type=\"instance\"><ref id=\"g\"/></shape>";
  Files all = files;
  all["/scenes/scene.xml"] = whole(elements);
  expect_same_again(read_file(all).scene, files);
}

/// A grid of 5 x 5 points in the plane z = 0, with normals and colours.
std::string cloud_ply() {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 25\nproperty float x\nproperty float y\nproperty float z\nproperty float "
      "nx\n"
      "property float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\nproperty uchar "
      "blue\nend_header\n";
  for (int i = 0; i < 25; ++i) text += fmt::format("{} {} 0 0 0 1 255 {} 0\n", i % 5, i / 5, 10 * i);
  return text;
}

TEST(SceneRoundTrip, OfSplats) {
  Files files = {{"/scenes/cloud.ply", cloud_ply()}};
  files["/scenes/scene.xml"] = whole(
      "<shape type=\"splats\"><string name=\"filename\" value=\"cloud.ply\"/></shape>"
      "<shape type=\"splats\"><string name=\"filename\" value=\"cloud.ply\"/><string name=\"normals\" "
      "value=\"file\"/><float "
      "name=\"radius\" value=\"0.9\"/><boolean name=\"closed\" value=\"true\"/><boolean name=\"bent_normals\" "
      "value=\"true\"/><boolean name=\"flip_normals\" value=\"true\"/><point name=\"sensor\" value=\"0, 0, "
      "5\"/><transform "
      "name=\"to_world\"><scale value=\"2\"/></transform><bsdf type=\"dielectric\"/></shape>"
      "<shape type=\"splats\"><string name=\"filename\" value=\"cloud.ply\"/><bsdf type=\"diffuse\"><texture "
      "name=\"reflectance\" type=\"mesh_attribute\"/></bsdf></shape>"
      "<shape type=\"splats\"><string name=\"filename\" value=\"cloud.ply\"/><string name=\"surface\" "
      "value=\"mls\"/><float name=\"mls_support\" value=\"3.5\"/></shape>");
  const SceneDescription scene = read_file(files).scene;
  ASSERT_EQ(scene.splats.size(), 4u);
  const SplatsDescription& plain = scene.splats[0];
  EXPECT_EQ(plain.centers.size(), 25u);
  EXPECT_FALSE(plain.closed);
  EXPECT_EQ(plain.material.reflectance.kind, TextureKind::own);
  EXPECT_NEAR(plain.colors[0].r, 1, 1e-6);
  // Half the diagonal of a cell covers it.
  EXPECT_GE(plain.radii[12], 0.707f);
  const SplatsDescription& glass = scene.splats[1];
  EXPECT_TRUE(glass.closed && glass.bent_normals);
  EXPECT_FLOAT_EQ(glass.normals[12].z, -1);
  EXPECT_FLOAT_EQ(glass.radii[12], 0.9f);
  EXPECT_EQ(glass.placement.x_axis.x, 2);
  // What is seen of them is alike from both sides.
  EXPECT_TRUE(scene.splats[2].material.back.empty());
  EXPECT_EQ(scene.splats[2].material.reflectance.kind, TextureKind::own);
  EXPECT_EQ(plain.surface, CloudSurface::splats);
  EXPECT_EQ(scene.splats[3].surface, CloudSurface::mls);
  EXPECT_EQ(scene.splats[3].mls_support, 3.5);
  expect_same_again(scene, files);
}

TEST(SceneRoundTrip, SplatsThatCannotBeAreRefused) {
  const auto error = [](const std::string& properties) {
    Files files = {{"/scenes/cloud.ply", cloud_ply()}, {"/scenes/bad.ply", "ply\nformat ascii 1.0\nend_header\n"}};
    files["/scenes/scene.xml"] = whole("<shape type=\"splats\">" + properties + "</shape>");
    try {
      read_file(files);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  const std::string file = "<string name=\"filename\" value=\"cloud.ply\"/>";
  EXPECT_NE(error("").find("'filename' is missing"), std::string::npos);
  EXPECT_NE(error("<string name=\"filename\" value=\"none.ply\"/>").find("none.ply"), std::string::npos);
  EXPECT_NE(error("<string name=\"filename\" value=\"bad.ply\"/>").find("bad.ply"), std::string::npos);
  EXPECT_NE(error(file + "<string name=\"normals\" value=\"up\"/>").find("auto, file, estimate"), std::string::npos);
  EXPECT_NE(error(file + "<bsdf type=\"dielectric\"/>").find("the cloud is open"), std::string::npos);
  EXPECT_NE(error(file + "<float name=\"radius\" value=\"-1\"/>").find("scene.xml"), std::string::npos);
  EXPECT_NE(error(file + "<emitter type=\"area\"/>").find("cannot shine"), std::string::npos);
  const std::string mls = file + "<string name=\"surface\" value=\"mls\"/>";
  EXPECT_EQ(error(mls), "no error");
  EXPECT_NE(error(file + "<string name=\"surface\" value=\"mesh\"/>").find("splats, mls"), std::string::npos);
  EXPECT_NE(error(file + "<float name=\"mls_support\" value=\"3\"/>").find("for the surface mls"), std::string::npos);
  EXPECT_NE(error(mls + "<float name=\"mls_support\" value=\"0.5\"/>").find("[1, 16]"), std::string::npos);
  EXPECT_NE(error(mls + "<boolean name=\"ellipses\" value=\"true\"/>").find("for splats"), std::string::npos);
  EXPECT_NE(error(mls + "<boolean name=\"bent_normals\" value=\"true\"/>").find("for splats"), std::string::npos);
  EXPECT_NE(error(file + "<float name=\"size\" value=\"1\"/>").find("size"), std::string::npos);
}

TEST(SceneRoundTrip, OfWhatNoMitsubaFileSays) {
  SceneDescription scene;
  scene.up = UpAxis::z;
  scene.overlap = MediaOverlap::max;
  scene.camera.eye = odd;
  scene.camera.shutter_close = 0.1;
  scene.camera.filter = {FilterKind::blackman_harris, 1.7f};
  scene.environment.kind = EnvironmentDescription::Kind::sky;
  scene.environment.turn = 12.3;
  scene.environment.sky.turbidity = 3.3f;
  scene.environment.sky.ground = {0.1f, 0.2f, 0.3f};
  scene.integrator.guide = false;
  scene.integrator.hide_emitters = scene.integrator.straight_shadows = true;
  scene.integrator.clamp = 3.5;
  scene.integrator.max_refractions = 2;
  scene.integrator.max_depth = 65535;
  using Kind = LightDescription::Kind;
  for (const Kind kind : {Kind::rectangle, Kind::disk, Kind::sphere, Kind::distant}) {
    LightDescription light;
    light.kind = kind;
    light.radiance = {0.1f, 0.7f, 1e-9f};
    if (kind != Kind::distant) light.position = odd;
    if (kind == Kind::rectangle) light.edge_u = {0.1, 0, 0}, light.edge_v = {0, 0, 0.3};
    if (kind == Kind::disk || kind == Kind::distant) light.normal = odd;
    if (kind == Kind::disk || kind == Kind::sphere) light.radius = 0.3;
    if (kind == Kind::distant) light.half_angle = 0.3;
    light.two_sided = kind == Kind::disk;
    scene.lights.push_back(light);
  }
  PatchDescription floor;
  floor.center = odd;
  floor.half_u = static_cast<double>(infinity);
  floor.half_v = 3;
  floor.material.one_sided = true;
  floor.material.reflectance.kind = TextureKind::checker;
  floor.material.reflectance.cell = 0.1;
  floor.material.reflectance.origin = odd;
  floor.material.reflectance.axis_v = 1;
  scene.patches.push_back(floor);
  BoxDescription box;
  box.box = {odd, {1, 2, 3}};
  box.material = dielectric_material(1.47, {0.1f, 0.2f, 0.3f}, 5);
  scene.boxes.push_back(box);
  MeshDescription mesh;
  mesh.mesh.positions = {{0.1f, 0, 0}, {1, 1.0f / 3, 0}, {0, 1, 1e-20f}};
  mesh.mesh.normals.assign(3, normalize(Vec3{1, 2, 3}));
  mesh.mesh.triangles = {{{0, 1, 2}}, {{2, 1, 0}}};
  mesh.placement = {odd, {0, 1, 0}, {0, 0, 1}, odd};
  scene.meshes.push_back(mesh);
  expect_same_again(scene);
  scene.integrator.kind = IntegratorKind::whitted;
  scene.integrator.guide = true;
  expect_same_again(scene);
  scene.integrator.kind = IntegratorKind::ambient_occlusion;
  scene.integrator.straight_shadows = false;
  scene.integrator.clamp = static_cast<double>(infinity);
  scene.integrator.occlusion_distance = 0.1;
  expect_same_again(scene);
  scene.integrator.kind = IntegratorKind::gauss;
  scene.integrator.occlusion_distance = static_cast<double>(infinity);
  scene.integrator.equiangular = false;
  expect_same_again(scene);
  scene.integrator.gauss_nodes = 36;
  expect_same_again(scene);
}

TEST(SceneRoundTrip, OfMaterials) {
  const Files files = {{"/scenes/wood.pfm", "PF\n4 2\n-1\n" + std::string(4 * 2 * 3 * sizeof(float), '\0')}};
  const std::string wood =
      "<texture name=\"NAME\" type=\"bitmap\"><string name=\"filename\" value=\"wood.pfm\"/><string "
      "name=\"filter_type\" value=\"nearest\"/><transform name=\"to_uv\"><rotate z=\"1\" "
      "angle=\"20\"/></transform></texture>";
  const auto named = [&](const std::string& name) { return std::string(wood).replace(wood.find("NAME"), 4, name); };
  const std::string bsdfs[] = {
      "diffuse\">" + named("reflectance"),
      "diffuse\"><texture name=\"reflectance\" type=\"checkerboard\"/>",
      "dielectric\"><rgb name=\"specular_transmittance\" value=\"0.1 0.7 0.3\"/>",
      "roughdielectric\"><float name=\"int_ior\" value=\"1.37\"/><string name=\"distribution\" value=\"ggx\"/>",
      "thindielectric\"><float name=\"specular_reflectance\" value=\"0.9\"/>",
      "conductor\"><string name=\"material\" value=\"Au\"/>",
      "roughconductor\"><string name=\"material\" value=\"Cu\"/>" + named("alpha"),
      "roughconductor\"><float name=\"alpha_u\" value=\"0.1\"/><float name=\"alpha_v\" value=\"0.7\"/>",
      "plastic\"><boolean name=\"nonlinear\" value=\"true\"/>",
      "principled\"><float name=\"clearcoat\" value=\"0.3\"/><float name=\"spec_tint\" value=\"0.6\"/>",
      "principled\"><float name=\"spec_trans\" value=\"0.3\"/><float name=\"eta\" value=\"1.3\"/>",
      "twosided\"><bsdf type=\"diffuse\"/><bsdf type=\"plastic\"/>",
      "null\">"};
  std::string elements;
  for (const std::string& bsdf : bsdfs) elements += "<shape type=\"sphere\"><bsdf type=\"" + bsdf + "</bsdf></shape>";
  Files all = files;
  all["/scenes/scene.xml"] = whole(elements);
  const SceneDescription scene = read_file(all).scene;
  EXPECT_EQ(scene.balls.size(), std::size(bsdfs));
  expect_same_again(scene, files);
}

TEST(SceneRoundTrip, NamesAreEscaped) {
  SceneDescription scene;
  scene.meshes.emplace_back();
  scene.meshes[0].file = "/a \"b\" & <c>/square.ply";
  const Files files = {{"/a \"b\" & <c>/square.ply", square_ply}};
  SceneFile read;
  Files all = files;
  all["/scenes/scene.xml"] = write_scene(scene);
  ASSERT_NO_THROW(read = read_file(all));
  EXPECT_EQ(read.scene.meshes[0].file, scene.meshes[0].file);
}

TEST(SceneRoundTrip, WhatIsNotFromAFileCannotBeNamed) {
  SceneDescription scene;
  scene.fluids.emplace_back();
  EXPECT_THROW(write_scene(scene), Error);
}

}  // namespace
}  // namespace embrun

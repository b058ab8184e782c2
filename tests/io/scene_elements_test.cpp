// What each element of a scene file becomes, with Mitsuba's conventions.

#include <cmath>

#include "io/scene_files.h"

namespace embrun {
namespace {

using namespace test;

// ---- sensor ------------------------------------------------------------------------------------------------------

SceneDescription seen_by(const std::string& properties, const std::string& type = "perspective") {
  return scene_of("<sensor type=\"" + type + "\">" + properties + "</sensor>");
}

TEST(SceneSensor, LooksAlongZByDefault) {
  const CameraSettings camera = seen_by("").camera;
  expect_near(camera.eye, {0, 0, 0});
  expect_near(camera.target, {0, 0, 1});
  expect_near(camera.up, {0, 1, 0});
  EXPECT_FALSE(camera.mirrored);
}

TEST(SceneSensor, TakesALookatAsItStands) {
  const CameraSettings camera =
      seen_by(
          "<transform name=\"to_world\"><lookat origin=\"2.4,2.4,4.9\" target=\"0,0.38,0\" up=\"0,1,0\"/></transform>")
          .camera;
  EXPECT_EQ(camera.eye, (Vec3d{2.4, 2.4, 4.9}));
  EXPECT_EQ(camera.target, (Vec3d{0, 0.38, 0}));
  EXPECT_EQ(camera.up, (Vec3d{0, 1, 0}));
}

// The same camera by a matrix whose columns are left, up, forward, eye; and with left and right exchanged.
TEST(SceneSensor, TakesAnyTransform) {
  const CameraSettings camera =
      seen_by("<transform name=\"to_world\"><matrix value=\"-1 0 0 1  0 1 0 2  0 0 -1 3  0 0 0 1\"/></transform>")
          .camera;
  expect_near(camera.eye, {1, 2, 3});
  expect_near(camera.target - camera.eye, {0, 0, -1});
  expect_near(camera.up, {0, 1, 0});
  EXPECT_FALSE(camera.mirrored);
  const CameraSettings mirrored =
      seen_by("<transform name=\"to_world\"><matrix value=\"1 0 0 1  0 1 0 2  0 0 -1 3  0 0 0 1\"/></transform>")
          .camera;
  EXPECT_TRUE(mirrored.mirrored);
  const CameraSettings scaled =
      seen_by(
          "<transform name=\"to_world\"><scale x=\"-1\"/><lookat origin=\"1,2,3\" target=\"1,2,0\" "
          "up=\"0,1,0\"/></transform>")
          .camera;
  EXPECT_TRUE(scaled.mirrored);
  EXPECT_EQ(scaled.eye, (Vec3d{1, 2, 3}));
}

TEST(SceneSensor, FieldOfView) {
  const auto fov = [](const std::string& properties, int width, int height) {
    return seen_by(properties + "<film type=\"hdrfilm\"><integer name=\"width\" value=\"" + std::to_string(width) +
                   "\"/><integer name=\"height\" value=\"" + std::to_string(height) + "\"/></film>")
        .camera.vertical_fov;
  };
  const auto degrees = [](double half_height) { return 2 * std::atan(half_height) * 180 / M_PI; };
  const std::string ninety = "<float name=\"fov\" value=\"90\"/>";  // half an image plane of 1 at distance 1
  const auto axis = [](const char* a) { return "<string name=\"fov_axis\" value=\"" + std::string(a) + "\"/>"; };
  EXPECT_NEAR(fov(ninety, 200, 100), degrees(0.5), 1e-12);
  EXPECT_NEAR(fov(ninety + axis("x"), 200, 100), degrees(0.5), 1e-12);
  EXPECT_EQ(fov(ninety + axis("y"), 200, 100), 90);
  EXPECT_EQ(fov(ninety + axis("smaller"), 200, 100), 90);
  EXPECT_NEAR(fov(ninety + axis("larger"), 200, 100), degrees(0.5), 1e-12);
  EXPECT_NEAR(fov(ninety + axis("smaller"), 100, 200), degrees(2), 1e-12);
  EXPECT_EQ(fov(ninety + axis("larger"), 100, 200), 90);
  EXPECT_NEAR(fov(ninety + axis("diagonal"), 400, 300), degrees(0.6), 1e-12);  // 3 of the 5 of the diagonal
  // 50 mm before a film whose diagonal is sqrt(36^2 + 24^2) = 43.2666 mm: half a diagonal of 0.432666, of which 3/5.
  EXPECT_NEAR(fov("", 400, 300), degrees(0.6 * 0.43266615305567875), 1e-9);
  EXPECT_NEAR(fov("<string name=\"focal_length\" value=\"100mm\"/>", 400, 300), degrees(0.6 * 0.21633307652783938),
              1e-9);
}

TEST(SceneSensor, ThinLens) {
  const CameraSettings camera =
      seen_by("<float name=\"aperture_radius\" value=\"0.1\"/><float name=\"focus_distance\" value=\"3\"/>", "thinlens")
          .camera;
  EXPECT_EQ(camera.lens_radius, 0.1);
  EXPECT_EQ(camera.focus_distance, 3);
  EXPECT_NE(error_of("<sensor type=\"thinlens\"/>").find("'aperture_radius' is missing"), std::string::npos);
  EXPECT_NE(error_of("<sensor type=\"thinlens\"><float name=\"aperture_radius\" value=\"0.1\"/></sensor>")
                .find("'focus_distance' is missing"),
            std::string::npos);
  EXPECT_NE(error_of("<sensor type=\"orthographic\"/>").find("there are perspective, thinlens"), std::string::npos);
}

TEST(SceneSensor, Film) {
  const SceneDescription scene = seen_by(
      "<film type=\"hdrfilm\"><integer name=\"width\" value=\"100\"/><integer name=\"height\" value=\"50\"/>"
      "<integer name=\"crop_offset_x\" value=\"10\"/><integer name=\"crop_offset_y\" value=\"20\"/>"
      "<integer name=\"crop_width\" value=\"30\"/><integer name=\"crop_height\" value=\"5\"/>"
      "<rfilter type=\"tent\"><float name=\"radius\" value=\"1.25\"/></rfilter></film>");
  EXPECT_EQ(scene.film.width, 100);
  EXPECT_EQ(scene.film.height, 50);
  EXPECT_EQ(scene.film.crop, (PixelWindow{10, 20, 30, 5}));
  EXPECT_EQ(scene.camera.filter.kind, FilterKind::tent);
  EXPECT_EQ(scene.camera.filter.radius, 1.25f);
  // Mitsuba's own: 768 x 576 seen through a gaussian of deviation 0.5, which is cut at three deviations.
  const SceneDescription defaults = seen_by("");
  EXPECT_EQ(defaults.film.width, 768);
  EXPECT_EQ(defaults.film.height, 576);
  EXPECT_EQ(defaults.camera.filter.kind, FilterKind::gaussian);
  EXPECT_EQ(defaults.camera.filter.radius, 1.5f);
  EXPECT_EQ(seen_by("<film type=\"hdrfilm\"><rfilter type=\"box\"/></film>").camera.filter.kind, FilterKind::box);
  EXPECT_NE(error_of("<sensor type=\"perspective\"><film type=\"hdrfilm\"><rfilter type=\"mitchell\"/></film></sensor>")
                .find("must not be negative"),
            std::string::npos);
  EXPECT_NE(error_of("<sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"crop_offset_x\" "
                     "value=\"700\"/><integer name=\"crop_width\" value=\"100\"/></film></sensor>")
                .find("does not lie within"),
            std::string::npos);
}

TEST(SceneSensor, Sampler) {
  const IntegratorDescription independent =
      seen_by(
          "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"9\"/><integer name=\"seed\" "
          "value=\"4\"/></sampler>")
          .integrator;
  EXPECT_EQ(independent.sampler, SamplerKind::independent);
  EXPECT_EQ(independent.samples, 9);
  EXPECT_EQ(independent.seed, 4u);
  EXPECT_EQ(seen_by("<sampler type=\"multijitter\"/>").integrator.sampler, SamplerKind::sobol);
}

// ---- materials ---------------------------------------------------------------------------------------------------

MaterialDescription material_of(const std::string& bsdf) {
  return scene_of("<shape type=\"sphere\">" + bsdf + "</shape>").balls[0].material;
}

std::string dielectric(const std::string& inside, const std::string& outside) {
  const auto index = [](const char* name, const std::string& value) {
    if (value.empty()) return std::string();
    const bool is_number = value[0] >= '0' && value[0] <= '9';
    return "<" + std::string(is_number ? "float" : "string") + " name=\"" + name + "\" value=\"" + value + "\"/>";
  };
  return "<bsdf type=\"dielectric\">" + index("int_ior", inside) + index("ext_ior", outside) + "</bsdf>";
}

TEST(SceneMaterials, DielectricsOfDefaultAndNamedIndices) {
  const MaterialDescription glass = material_of(dielectric("", ""));
  EXPECT_EQ(glass.kind, BsdfKind::dielectric);
  EXPECT_DOUBLE_EQ(glass.ior, 1.5046 / 1.000277);
  EXPECT_EQ(glass.priority, 1);
  EXPECT_DOUBLE_EQ(material_of(dielectric("Water", "air")).ior, 1.333 / 1.000277);
  EXPECT_DOUBLE_EQ(material_of(dielectric("diamond", "vacuum")).ior, 2.419);
  EXPECT_EQ(material_of(dielectric("1.33", "1")).ior, 1.33);
  EXPECT_NE(error_of("<bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"watr\"/></bsdf>")
                .find("'int_ior' is 'watr', which is no known material"),
            std::string::npos);
  EXPECT_NE(error_of("<bsdf type=\"dielectric\"><float name=\"int_ior\" value=\"0.5\"/></bsdf>").find("in [1, 10]"),
            std::string::npos);
}

// Water holds a bubble of air and a piece of glass, the glass holds a drop of oil: each wins over what holds it.
TEST(SceneMaterials, WhatIsInsideOfWhatFollowsFromTheIndices) {
  const SceneDescription scene =
      scene_of("<shape type=\"sphere\">" + dielectric("1.47", "1.5") + "</shape>" +  // oil in glass
               "<shape type=\"sphere\">" + dielectric("1", "1.33") + "</shape>" +    // bubble in water
               "<shape type=\"sphere\">" + dielectric("1.5", "1.33") + "</shape>" +  // glass in water
               "<shape type=\"sphere\">" + dielectric("1.33", "1") + "</shape>");    // water in air
  ASSERT_EQ(scene.balls.size(), 4u);
  EXPECT_EQ(scene.balls[0].material.priority, 3);
  EXPECT_EQ(scene.balls[1].material.priority, 2);
  EXPECT_EQ(scene.balls[1].material.ior, 1);
  EXPECT_EQ(scene.balls[2].material.priority, 2);
  EXPECT_EQ(scene.balls[3].material.priority, 1);
  EXPECT_EQ(scene.balls[3].material.ior, 1.33);
  EXPECT_NE(error_of("<shape type=\"sphere\">" + dielectric("1.47", "1.5") + "</shape>")
                .find("what is round it cannot be told"),
            std::string::npos);
}

TEST(SceneMaterials, InteriorMedia) {
  const auto inside = [](const std::string& bsdf, const std::string& properties) {
    return material_of(bsdf + "<medium name=\"interior\" type=\"homogeneous\">" + properties + "</medium>");
  };
  // Mitsuba's defaults: extinction 1, albedo 0.75.
  const MaterialDescription fog = inside("<bsdf type=\"null\"/>", "");
  EXPECT_EQ(fog.kind, BsdfKind::null);
  EXPECT_EQ(fog.ior, 1);
  EXPECT_EQ(fog.scattering, grey(0.75f));
  EXPECT_EQ(fog.absorption, grey(0.25f));
  EXPECT_EQ(fog.phase.kind, PhaseKind::isotropic);
  const MaterialDescription milk =
      inside(dielectric("1.33", "1"),
             "<rgb name=\"sigma_t\" value=\"4, 8, 16\"/><float name=\"albedo\" value=\"0.5\"/><float name=\"scale\" "
             "value=\"2\"/><phase type=\"hg\"><float name=\"g\" value=\"-0.25\"/></phase>");
  EXPECT_EQ(milk.scattering, (Rgb{4, 8, 16}));
  EXPECT_EQ(milk.absorption, (Rgb{4, 8, 16}));
  EXPECT_EQ(milk.phase.kind, PhaseKind::henyey_greenstein);
  EXPECT_EQ(milk.phase.g, -0.25f);
  const MaterialDescription wine =
      inside(dielectric("1.33", "1"), "<rgb name=\"sigma_a\" value=\"1, 2, 3\"/><float name=\"sigma_s\" value=\"0\"/>");
  EXPECT_EQ(wine.absorption, (Rgb{1, 2, 3}));
  EXPECT_TRUE(is_black(wine.scattering));
  EXPECT_NE(error_of("<shape type=\"sphere\"><medium name=\"interior\" type=\"cloudy\"/></shape>")
                .find("medium \"cloudy\": this medium is not supported"),
            std::string::npos);
  EXPECT_NE(error_of("<shape type=\"sphere\"><medium name=\"interior\" type=\"homogeneous\"><phase type=\"hg\"><float "
                     "name=\"g\" value=\"1\"/></phase></medium></shape>")
                .find("'g' is 1"),
            std::string::npos);
  EXPECT_EQ(
      read_elements("<shape type=\"sphere\"><medium name=\"interior\" type=\"homogeneous\"/></shape>").warnings.size(),
      1u);
}

TEST(SceneMaterials, Rough) {
  const MaterialDescription glass = material_of(
      "<bsdf type=\"roughdielectric\"><float name=\"int_ior\" value=\"1.5\"/><float name=\"ext_ior\" "
      "value=\"1\"/><float name=\"alpha\" value=\"0.3\"/></bsdf>");
  EXPECT_EQ(glass.kind, BsdfKind::rough_dielectric);
  EXPECT_EQ(glass.ior, 1.5);
  EXPECT_EQ(glass.distribution, MicrofacetDistribution::beckmann);  // Mitsuba's default
  EXPECT_EQ(glass.roughness.first, grey(0.3f));
  const MaterialDescription metal = material_of(
      "<bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"ggx\"/><float "
      "name=\"alpha_u\" value=\"0.2\"/><float name=\"alpha_v\" value=\"0.4\"/></bsdf>");
  EXPECT_EQ(metal.kind, BsdfKind::rough_conductor);
  EXPECT_EQ(metal.distribution, MicrofacetDistribution::ggx);
  EXPECT_EQ(metal.roughness.first, grey(0.2f));
  EXPECT_EQ(metal.roughness_v, 0.4);
  EXPECT_EQ(material_of("<bsdf type=\"roughconductor\"/>").roughness.first, grey(0.1f));
}

// What a metal reflects at normal incidence, ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2), has its colour.
TEST(SceneMaterials, NamedMetals) {
  const auto reflectance = [](const char* name) {
    const MaterialDescription m =
        material_of("<bsdf type=\"conductor\"><string name=\"material\" value=\"" + std::string(name) + "\"/></bsdf>");
    Rgb r;
    for (int c = 0; c < 3; ++c)
      r[c] = (square(m.eta[c] - 1) + square(m.k[c])) / (square(m.eta[c] + 1) + square(m.k[c]));
    return r;
  };
  // Published reflectances in linear sRGB: the Metal Reflectance node of Unity's Shader Graph; brass by physicallybased.info.
  expect_near(reflectance("Ag"), {0.972f, 0.960f, 0.915f}, 0.01f);
  expect_near(reflectance("Al"), {0.913f, 0.921f, 0.925f}, 0.01f);
  expect_near(reflectance("Cu"), {0.955f, 0.637f, 0.538f}, 0.015f);
  expect_near(reflectance("CuZn"), {0.910f, 0.778f, 0.423f}, 0.02f);
  // Gold's index changes steeply within the green, and the index of the mean is not that of the mean reflectance.
  expect_near(reflectance("Au"), {1.000f, 0.766f, 0.336f}, 0.04f);
  EXPECT_EQ(reflectance("none"), grey(1));
  EXPECT_NE(error_of("<bsdf type=\"conductor\"><string name=\"material\" value=\"Unobtainium\"/></bsdf>")
                .find("there are none, Ag, Al, Au, Cu, CuZn"),
            std::string::npos);
}

TEST(SceneMaterials, PlasticThinGlassAndPrincipled) {
  const MaterialDescription plastic = material_of(
      "<bsdf type=\"plastic\"><rgb name=\"diffuse_reflectance\" value=\"0.1 0.2 0.3\"/><boolean "
      "name=\"nonlinear\" value=\"true\"/></bsdf>");
  EXPECT_EQ(plastic.kind, BsdfKind::plastic);
  EXPECT_DOUBLE_EQ(plastic.ior, 1.49 / 1.000277);
  EXPECT_EQ(plastic.reflectance.first, (Rgb{0.1f, 0.2f, 0.3f}));
  EXPECT_TRUE(plastic.nonlinear);
  const MaterialDescription sheet = material_of("<bsdf type=\"thindielectric\"/>");
  EXPECT_EQ(sheet.kind, BsdfKind::thin_dielectric);
  EXPECT_DOUBLE_EQ(sheet.ior, 1.5046 / 1.000277);
  // specular 0.5 is a reflectance of 0.04 at normal incidence, which an index of 1.5 has.
  const MaterialDescription principled =
      material_of("<bsdf type=\"principled\"><float name=\"metallic\" value=\"0.7\"/></bsdf>");
  EXPECT_EQ(principled.kind, BsdfKind::principled);
  EXPECT_DOUBLE_EQ(principled.ior, 1.5);
  EXPECT_EQ(principled.principled.metallic, 0.7);
  EXPECT_EQ(principled.roughness.first, grey(0.5f));
}

TEST(SceneMaterials, TwoSided) {
  EXPECT_EQ(material_of("<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf>"), diffuse_material(grey(0.5f)));
  const MaterialDescription both =
      material_of("<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/><bsdf type=\"plastic\"/></bsdf>");
  EXPECT_EQ(both.kind, BsdfKind::diffuse);
  ASSERT_EQ(both.back.size(), 1u);
  EXPECT_EQ(both.back[0].kind, BsdfKind::plastic);
  // By itself it is black from behind, as in Mitsuba.
  for (const char* one : {"", "<bsdf type=\"diffuse\"/>", "<bsdf type=\"conductor\"/>"}) {
    ASSERT_EQ(material_of(one).back.size(), 1u) << one;
    EXPECT_EQ(material_of(one).back[0], diffuse_material({0, 0, 0}));
  }
  EXPECT_TRUE(material_of("<bsdf type=\"dielectric\"/>").back.empty());
  EXPECT_NE(error_of("<bsdf type=\"twosided\"><bsdf type=\"dielectric\"/></bsdf>").find("lets no light through"),
            std::string::npos);
  EXPECT_NE(error_of("<bsdf type=\"twosided\"/>").find("there is no <bsdf> in it"), std::string::npos);
  EXPECT_NE(error_of("<bsdf type=\"twosided\" id=\"a\"><ref id=\"a\"/></bsdf>").find("it refers to itself"),
            std::string::npos);
}

TEST(SceneMaterials, Textures) {
  const Files files = {
      {"/scenes/scene.xml",
       whole(
           "<texture type=\"bitmap\" id=\"wood\"><string name=\"filename\" value=\"wood.pfm\"/><string "
           "name=\"wrap_mode\" value=\"mirror\"/><transform name=\"to_uv\"><scale x=\"2\" y=\"3\"/><translate "
           "x=\"0.5\"/></transform></texture>"
           "<shape type=\"sphere\"><bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"wood\"/></bsdf></shape>"
           "<shape type=\"cube\"><bsdf type=\"plastic\"><ref name=\"diffuse_reflectance\" id=\"wood\"/></bsdf></shape>"
           "<shape type=\"disk\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" "
           "type=\"checkerboard\"><rgb name=\"color1\" value=\"0.9\"/></texture></bsdf></shape>")},
      {"/scenes/wood.pfm", "PF\n4 2\n-1\n" + std::string(4 * 2 * 3 * sizeof(float), '\0')}};
  const SceneDescription scene = read_file(files).scene;
  ASSERT_EQ(scene.pictures.size(), 1u) << "shown twice, read once";
  EXPECT_EQ(scene.pictures[0].file, "/scenes/wood.pfm");
  EXPECT_EQ(scene.pictures[0].image.width, 4);
  const TextureDescription& wood = scene.balls[0].material.reflectance;
  EXPECT_EQ(wood.kind, TextureKind::bitmap);
  EXPECT_EQ(wood.wrap, TextureWrap::mirror);
  EXPECT_EQ(wood.to_uv, (std::array<double, 6>{2, 0, 0.5, 0, 3, 0}));
  EXPECT_EQ(scene.boxes[0].material.reflectance, wood);
  const TextureDescription& checker = scene.patches[0].material.reflectance;
  EXPECT_EQ(checker.kind, TextureKind::uv_checker);
  EXPECT_EQ(checker.first, grey(0.4f));  // Mitsuba's default
  EXPECT_EQ(checker.second, grey(0.9f));
}

TEST(SceneMaterials, RawPicturesKeepTheirNumbers) {
  // A PNG of one pixel, 128 128 128.
  const unsigned char png[] = {0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48,
                               0x44, 0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x02, 0x00, 0x00,
                               0x00, 0x90, 0x77, 0x53, 0xde, 0x00, 0x00, 0x00, 0x0c, 0x49, 0x44, 0x41, 0x54, 0x78,
                               0xda, 0x63, 0x68, 0x68, 0x68, 0x00, 0x00, 0x03, 0x04, 0x01, 0x81, 0x75, 0x2e, 0x01,
                               0xbc, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  const std::string bytes(reinterpret_cast<const char*>(png), sizeof png);
  const auto value = [&](const std::string& raw) {
    const Files files{
        {"/scenes/scene.xml",
         whole("<shape type=\"sphere\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\"><string "
               "name=\"filename\" value=\"grey.png\"/><boolean name=\"raw\" value=\"" +
               raw + "\"/></texture></bsdf></shape>")},
        {"/scenes/grey.png", bytes}};
    return read_file(files).scene.pictures.at(0).image.pixels.at(0);
  };
  EXPECT_NEAR(value("true"), 128.0 / 255.0, 1e-6);
  EXPECT_NEAR(value("false"), std::pow((128.0 / 255.0 + 0.055) / 1.055, 2.4), 1e-5);
}

TEST(SceneMaterials, OthersAreRefused) {
  EXPECT_NE(error_of("<bsdf type=\"hair\"/>").find("bsdf \"hair\": this bsdf is not supported"), std::string::npos);
}

// ---- shapes ------------------------------------------------------------------------------------------------------

TEST(SceneShapes, Spheres) {
  const SceneDescription scene = scene_of(
      "<shape type=\"sphere\"><point name=\"center\" x=\"1\" y=\"2\"/><float name=\"radius\" value=\"3\"/><transform "
      "name=\"to_world\"><scale value=\"2\"/><translate z=\"1\"/></transform></shape>"
      "<shape type=\"sphere\"/>"
      "<shape type=\"sphere\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.1\"/></bsdf></shape>");
  ASSERT_EQ(scene.balls.size(), 2u) << "spheres of one material are one set";
  ASSERT_EQ(scene.balls[0].balls.size(), 2u);
  EXPECT_EQ(scene.balls[0].balls[0].center, (Vec3d{2, 4, 1}));
  EXPECT_EQ(scene.balls[0].balls[0].radius, 6);
  EXPECT_EQ(scene.balls[0].balls[1].center, (Vec3d{0, 0, 0}));
  EXPECT_EQ(scene.balls[0].balls[1].radius, 1);
}

TEST(SceneShapes, RectanglesAndDisks) {
  const SceneDescription scene = scene_of(
      "<shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"4\" y=\"2\"/><rotate x=\"1\" angle=\"-90\"/>"
      "<translate y=\"-0.05\"/></transform></shape>"
      "<shape type=\"rectangle\"><boolean name=\"flip_normals\" value=\"true\"/></shape>"
      "<shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"-1\"/></transform></shape>"
      "<shape type=\"disk\"><transform name=\"to_world\"><scale value=\"3\"/></transform></shape>");
  ASSERT_EQ(scene.patches.size(), 4u);
  const auto normal = [](const PatchDescription& p) { return normalize(cross(p.axis_u, p.axis_v)); };
  // +y goes to -z and +z to +y: a floor of 8 x 4 that is seen from above.
  const PatchDescription& floor = scene.patches[0];
  EXPECT_EQ(floor.center, (Vec3d{0, -0.05, 0}));
  EXPECT_EQ(floor.half_u, 4);
  EXPECT_EQ(floor.half_v, 2);
  expect_near(normal(floor), {0, 1, 0});
  expect_near(normal(scene.patches[1]), {0, 0, -1});
  expect_near(normal(scene.patches[2]), {0, 0, 1});  // a mirror in the plane leaves its normal
  EXPECT_TRUE(scene.patches[3].round);
  EXPECT_EQ(scene.patches[3].half_u, 3);
  EXPECT_EQ(scene.patches[3].half_v, 3);
  EXPECT_NE(error_of("<shape type=\"rectangle\"><transform name=\"to_world\"><matrix value=\"1 1 0  0 1 0  0 0 "
                     "1\"/></transform></shape>")
                .find("shears it"),
            std::string::npos);
  EXPECT_NE(error_of("<shape type=\"rectangle\">" + dielectric("", "") + "</shape>").find("no inside"),
            std::string::npos);
}

TEST(SceneShapes, CubesAreBoxesWhileTheyAreUpright) {
  const SceneDescription scene = scene_of(
      "<shape type=\"cube\"><transform name=\"to_world\"><scale x=\"1\" y=\"2\" z=\"3\"/><rotate y=\"1\" "
      "angle=\"90\"/><translate x=\"10\"/></transform></shape>"
      "<shape type=\"cube\"><transform name=\"to_world\"><rotate y=\"1\" angle=\"45\"/></transform></shape>");
  ASSERT_EQ(scene.boxes.size(), 1u);
  EXPECT_EQ(scene.boxes[0].box.low, (Vec3d{7, -2, -1}));
  EXPECT_EQ(scene.boxes[0].box.high, (Vec3d{13, 2, 1}));
  ASSERT_EQ(scene.meshes.size(), 1u);
  // Outward triangles: the volume inside is 8, by the divergence theorem.
  double volume = 0;
  const TriangleMesh& mesh = scene.meshes[0].mesh;
  for (const auto& [a, b, c] : mesh.triangles)
    volume += dot(to_double(mesh.positions[a]), cross(to_double(mesh.positions[b]), to_double(mesh.positions[c]))) / 6;
  EXPECT_NEAR(volume, 8, 1e-6);
}

TEST(SceneShapes, Cylinders) {
  const SceneDescription scene = scene_of(
      "<shape type=\"cylinder\"><point name=\"p0\" value=\"0,0,1\"/><point name=\"p1\" value=\"0,0,3\"/><float "
      "name=\"radius\" value=\"0.5\"/><transform name=\"to_world\"><scale value=\"2\"/></transform></shape>");
  ASSERT_EQ(scene.cylinders.size(), 1u);
  EXPECT_EQ(scene.cylinders[0].start, (Vec3d{0, 0, 2}));
  EXPECT_EQ(scene.cylinders[0].end, (Vec3d{0, 0, 6}));
  EXPECT_EQ(scene.cylinders[0].radius, 1);
  EXPECT_NE(error_of("<shape type=\"cylinder\">" + dielectric("", "") + "</shape>").find("open at its ends"),
            std::string::npos);
}

const char* square_shape = "<shape type=\"ply\"><string name=\"filename\" value=\"square.ply\"/>";

TEST(SceneShapes, Meshes) {
  const SceneDescription scene =
      scene_of(std::string(square_shape) +
               "<boolean name=\"flip_normals\" value=\"true\"/><transform name=\"to_world\"><translate "
               "z=\"2\"/></transform><emitter type=\"area\"><rgb name=\"radiance\" "
               "value=\"17,12,4\"/></emitter></shape>" +
               square_shape + "</shape>");
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0].file, "/scenes/square.ply");
  EXPECT_EQ(scene.meshes[0].radiance, (Rgb{17, 12, 4}));
  EXPECT_EQ(scene.meshes[0].placement.origin, (Vec3d{0, 0, 2}));
  const auto normal = [](const TriangleMesh& m) {
    const Vec3 a = m.positions[m.triangles[0][0]];
    return normalize(cross(m.positions[m.triangles[0][1]] - a, m.positions[m.triangles[0][2]] - a));
  };
  EXPECT_EQ(normal(scene.meshes[0].mesh).z, -1);
  EXPECT_EQ(normal(scene.meshes[1].mesh).z, 1);
  EXPECT_EQ(error_of("<shape type=\"ply\"><string name=\"filename\" value=\"none.ply\"/></shape>"),
            "/scenes/none.ply: cannot open");
  EXPECT_NE(error_of("<shape type=\"obj\"/>").find("'filename' is missing"), std::string::npos);
}

// A group of a mesh and a sphere in two places; the mesh is one, with two placements: that of the instance after its own.
TEST(SceneShapes, Instances) {
  const SceneDescription scene = scene_of(
      "<shape type=\"shapegroup\" id=\"g\"><shape type=\"sphere\"/>" + std::string(square_shape) +
      "<transform name=\"to_world\"><translate z=\"1\"/></transform></shape></shape>"
      "<shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><translate x=\"5\"/></transform></shape>"
      "<shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><scale value=\"2\"/><translate "
      "x=\"9\"/></transform></shape>");
  ASSERT_EQ(scene.meshes.size(), 1u);
  ASSERT_EQ(scene.meshes[0].copies.size(), 2u);
  expect_near(place(scene.meshes[0].copies[0], {1, 1, 0}), {6, 1, 1});
  expect_near(place(scene.meshes[0].copies[1], {1, 1, 0}), {11, 2, 2});
  ASSERT_EQ(scene.balls.size(), 1u);
  ASSERT_EQ(scene.balls[0].balls.size(), 2u);
  EXPECT_EQ(scene.balls[0].balls[0].center, (Vec3d{5, 0, 0}));
  EXPECT_EQ(scene.balls[0].balls[1].center, (Vec3d{9, 0, 0}));
  EXPECT_EQ(scene.balls[0].balls[1].radius, 2);
  EXPECT_NE(error_of("<shape type=\"instance\"/>").find("it names no shapegroup"), std::string::npos);
  EXPECT_NE(
      error_of("<shape type=\"shapegroup\" id=\"g\"><shape type=\"instance\"><ref id=\"g\"/></shape></shape><shape "
               "type=\"instance\"><ref id=\"g\"/></shape>")
          .find("cannot hold a shape of type instance"),
      std::string::npos);
}

// ---- lights ------------------------------------------------------------------------------------------------------

TEST(SceneLights, AreNoneUnlessThereAreSome) {
  EXPECT_EQ(scene_of("").environment.kind, EnvironmentDescription::Kind::none);
  const SceneDescription scene =
      scene_of("<emitter type=\"constant\"><rgb name=\"radiance\" value=\"1, 2, 3\"/></emitter>");
  EXPECT_EQ(scene.environment.kind, EnvironmentDescription::Kind::constant);
  EXPECT_EQ(scene.environment.constant, (Rgb{1, 2, 3}));
  EXPECT_NE(error_of("<emitter type=\"constant\"/><emitter type=\"constant\"/>").find("light all round already"),
            std::string::npos);
  EXPECT_NE(error_of("<emitter type=\"area\"/>").find("stands inside of the <shape>"), std::string::npos);
  EXPECT_NE(error_of("<emitter type=\"spot\"/>").find("emitter \"spot\": this emitter is not supported"),
            std::string::npos);
}

// Mitsuba's picture has +z in its middle, as Embrun's; +x is a quarter to the left.
TEST(SceneLights, AnEnvironmentIsTurnedByItsTransform) {
  std::string pfm = "PF\n4 2\n-1\n" + std::string(4 * 2 * 3 * sizeof(float), '\0');
  const auto read = [&](const std::string& steps) {
    const Files files = {
        {"/scenes/scene.xml", whole("<emitter type=\"envmap\"><string name=\"filename\" value=\"sky.pfm\"/><float "
                                    "name=\"scale\" value=\"2\"/><transform name=\"to_world\">" +
                                    steps + "</transform></emitter>")},
        {"/scenes/sky.pfm", pfm}};
    return read_file(files).scene;
  };
  EXPECT_NEAR(read("").environment.turn, 0, 1e-12);
  EXPECT_EQ(read("").environment.scale, 2);
  EXPECT_NEAR(read("<rotate y=\"1\" angle=\"30\"/>").environment.turn, 30, 1e-9);
  const SceneDescription upright = read("<rotate y=\"1\" angle=\"30\"/><rotate x=\"1\" angle=\"90\"/>");
  EXPECT_EQ(upright.up, UpAxis::z);
  EXPECT_NEAR(upright.environment.turn, 30, 1e-9);
  EXPECT_THROW(read("<rotate x=\"1\" angle=\"45\"/>"), Error);
  EXPECT_THROW(read("<scale value=\"2\"/>"), Error);
}

TEST(SceneLights, ShapesShine) {
  const std::string area = "<emitter type=\"area\"><rgb name=\"radiance\" value=\"3\"/></emitter></shape>";
  const SceneDescription scene =
      scene_of("<shape type=\"sphere\">" + area + "<shape type=\"rectangle\">" + area + "<shape type=\"disk\">" + area +
               "<shape type=\"cylinder\">" + area + "<shape type=\"cube\">" + area);
  EXPECT_EQ(scene.balls[0].radiance, grey(3));
  EXPECT_EQ(scene.patches[0].radiance, grey(3));
  EXPECT_EQ(scene.patches[1].radiance, grey(3));
  EXPECT_EQ(scene.cylinders[0].radiance, grey(3));
  EXPECT_EQ(scene.meshes[0].radiance, grey(3));
  EXPECT_TRUE(scene.boxes.empty());
}

}  // namespace
}  // namespace embrun

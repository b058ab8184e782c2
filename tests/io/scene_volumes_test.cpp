// Media on grids, and lights without extent, as scene files have them.

#include <cmath>
#include <limits>

#include "io/particle_files.h"
#include "io/read_volume.h"
#include "io/scene_files.h"

namespace embrun {
namespace {

using namespace test;

/// A grid in Mitsuba's format with the numbers 0, 1, 2, ... (of bytes: 0, 1, 2, ...).
std::string volume_file(int nx, int ny, int nz, int channels, std::int32_t encoding = 1) {
  FileBytes bytes(false);
  bytes.text("VOL").number(std::uint8_t{3}).number(encoding);
  for (const int n : {nx, ny, nz, channels}) bytes.number(static_cast<std::int32_t>(n));
  for (const float b : {-1.0f, 0.0f, 2.0f, 3.0f, 1.0f, 4.0f}) bytes.number(b);
  for (int i = 0; i < nx * ny * nz * channels; ++i) {
    if (encoding == 1)
      bytes.number(static_cast<float>(i));
    else
      bytes.number(static_cast<std::uint8_t>(i));
  }
  return bytes.str();
}

std::string volume_error(const std::string& file) {
  try {
    read_volume_from_memory(as_bytes(file), "fog.vol");
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

// ---- the file ----------------------------------------------------------------------------------------------------

TEST(VolumeFiles, HoldNumbersAndABox) {
  const std::string file = volume_file(2, 3, 4, 3);
  for (const std::string& bytes : {file, gzipped(file)}) {
    const VolumeFile volume = read_volume_from_memory(as_bytes(bytes), "fog.vol");
    EXPECT_EQ(volume.nx, 2);
    EXPECT_EQ(volume.ny, 3);
    EXPECT_EQ(volume.nz, 4);
    EXPECT_EQ(volume.channels, 3);
    ASSERT_EQ(volume.values.size(), 72u);
    // Channel 2 of the cell (1, 2, 3).
    EXPECT_EQ(volume.values[((3 * 3 + 2) * 2 + 1) * 3 + 2], 71);
    EXPECT_EQ(volume.low[0], -1);
    EXPECT_EQ(volume.low[2], 2);
    EXPECT_EQ(volume.high[0], 3);
    EXPECT_EQ(volume.high[2], 4);
  }
  const VolumeFile shares = read_volume_from_memory(as_bytes(volume_file(4, 4, 16, 1, 3)), "fog.vol");
  ASSERT_EQ(shares.values.size(), 256u);
  EXPECT_EQ(shares.values[255], 1);
  EXPECT_NEAR(shares.values[51], 0.2, 1e-7);
}

TEST(VolumeFiles, ThatAreNotRightAreRefused) {
  const std::string file = volume_file(2, 3, 4, 1);
  EXPECT_EQ(volume_error(file), "no error");
  const auto with = [&](std::size_t place, std::int32_t number) {
    std::string wrong = file;
    wrong.replace(place, 4, reinterpret_cast<const char*>(&number), 4);
    return volume_error(wrong);
  };
  EXPECT_EQ(volume_error(""), "fog.vol: offset 0: header: the file ends here: 4 bytes are needed, 0 are left");
  EXPECT_NE(volume_error("PLY\x03" + file.substr(4)).find("header: this is not the start of a volume grid"),
            std::string::npos);
  EXPECT_NE(volume_error("VOL\x04" + file.substr(4)).find("version: 4 is not supported"), std::string::npos);
  EXPECT_NE(with(4, 2).find("encoding: 2 is not supported: there are 1 (float32) and 3 (uint8)"), std::string::npos);
  EXPECT_NE(with(8, 0).find("cells along x: 0 is not in"), std::string::npos);
  EXPECT_NE(with(12, -5).find("cells along y: -5 is not in"), std::string::npos);
  EXPECT_NE(with(16, 1 << 20).find("cells: 3145728 times 8 bytes are announced"), std::string::npos);
  EXPECT_NE(with(20, 6).find("channels: 6 are not supported: there are 1 and 3"), std::string::npos);
  EXPECT_NE(volume_error(file + "x").find("cells: the file goes on behind the last of them"), std::string::npos);
  EXPECT_NE(volume_error(file.substr(0, file.size() - 1)).find("cells: "), std::string::npos);
}

// ---- media -------------------------------------------------------------------------------------------------------

Files files_with(const std::string& elements, const std::string& volume) {
  return {{"/scenes/scene.xml", whole(elements)}, {"/scenes/fog.vol", volume}};
}

SceneFile fog_with(const std::string& properties, const std::string& volume = volume_file(2, 3, 4, 1)) {
  const Files files =
      files_with("<shape type=\"cube\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"heterogeneous\">" +
                     properties + "</medium></shape>",
                 volume);
  return read_file(files);
}

std::string grid(const std::string& name, const std::string& properties = "") {
  return "<volume name=\"" + name + "\" type=\"gridvolume\"><string name=\"filename\" value=\"fog.vol\"/>" +
         properties + "</volume>";
}

std::string fog_error(const std::string& properties, const std::string& volume = volume_file(2, 3, 4, 1)) {
  try {
    fog_with(properties, volume);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(SceneGridMedia, AreWhatTheirVolumesSay) {
  const SceneFile file = fog_with(grid("sigma_t",
                                       "<boolean name=\"raw\" value=\"true\"/><boolean name=\"use_grid_bbox\" "
                                       "value=\"false\"/><transform name=\"to_world\"><scale x=\"2\" y=\"3\" "
                                       "z=\"4\"/><translate x=\"1\"/></transform>") +
                                  "<rgb name=\"albedo\" value=\"0.9\"/><float name=\"scale\" value=\"7\"/><phase "
                                  "type=\"hg\"><float name=\"g\" value=\"0.5\"/></phase>");
  EXPECT_TRUE(file.warnings.empty()) << file.warnings[0];
  ASSERT_EQ(file.scene.grid_media.size(), 1u);
  const GridMediumDescription& medium = file.scene.grid_media[0];
  ASSERT_TRUE(medium.extinction_grid);
  EXPECT_EQ(medium.extinction_grid->file, "/scenes/fog.vol");
  EXPECT_EQ(medium.extinction_grid->nx, 2);
  EXPECT_EQ(medium.extinction_grid->values.size(), 24u);
  EXPECT_EQ(medium.extinction_grid->placement, (Placement{{2, 0, 0}, {0, 3, 0}, {0, 0, 4}, {1, 0, 0}}));
  EXPECT_FALSE(medium.extinction_grid->nearest);
  EXPECT_EQ(medium.albedo, grey(0.9f));
  EXPECT_FALSE(medium.albedo_grid);
  EXPECT_EQ(medium.scale, 7);
  EXPECT_EQ(medium.phase.g, 0.5f);
  ASSERT_EQ(file.scene.boxes.size(), 1u);
  EXPECT_EQ(file.scene.boxes[0].material.grid_medium, 0);
  EXPECT_TRUE(is_black(file.scene.boxes[0].material.scattering));
  EXPECT_TRUE(has_inside(file.scene.boxes[0].material));
}

TEST(SceneGridMedia, HaveMitsubasDefaults) {
  const GridMediumDescription medium = fog_with(grid("sigma_t")).scene.grid_media.at(0);
  EXPECT_EQ(medium.albedo, grey(0.75f));
  EXPECT_EQ(medium.scale, 1);
  EXPECT_EQ(medium.phase, PhaseFunction{});
  EXPECT_EQ(medium.extinction_grid->placement, Placement{});  // the unit cube
}

// The file's own box, -1..3, 0..1, 2..4, and then the transform.
TEST(SceneGridMedia, StandInTheirFilesBoxIfToldTo) {
  const std::string own = "<boolean name=\"use_grid_bbox\" value=\"true\"/>";
  EXPECT_EQ(fog_with(grid("sigma_t", own)).scene.grid_media.at(0).extinction_grid->placement,
            (Placement{{4, 0, 0}, {0, 1, 0}, {0, 0, 2}, {-1, 0, 2}}));
  EXPECT_EQ(fog_with(grid("sigma_t", own + "<transform name=\"to_world\"><translate y=\"5\"/></transform>"))
                .scene.grid_media.at(0)
                .extinction_grid->placement.origin,
            (Vec3d{-1, 5, 2}));
  std::string flat = volume_file(2, 3, 4, 1);
  flat.replace(24, 24, std::string(24, '\0'));
  EXPECT_EQ(fog_error(grid("sigma_t"), flat), "no error") << "nobody asks for the box";
  EXPECT_NE(fog_error(grid("sigma_t", own), flat).find("own box has no extent along axis 0"), std::string::npos);
}

TEST(SceneGridMedia, WithoutAGridAreHomogeneous) {
  const SceneFile file = fog_with(
      "<volume name=\"sigma_t\" type=\"constvolume\"><rgb name=\"value\" value=\"1 2 4\"/></volume><volume "
      "name=\"albedo\" type=\"constvolume\"><float name=\"value\" value=\"0.25\"/></volume><float name=\"scale\" "
      "value=\"2\"/>");
  EXPECT_TRUE(file.scene.grid_media.empty());
  const MaterialDescription& material = file.scene.boxes.at(0).material;
  EXPECT_EQ(material.grid_medium, -1);
  expect_near(material.scattering, {0.5f, 1, 2});
  expect_near(material.absorption, {1.5f, 3, 6});
  // A homogeneous one takes constant volumes as well.
  const SceneDescription other = scene_of(
      "<shape type=\"sphere\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"homogeneous\"><volume "
      "name=\"sigma_t\" type=\"constvolume\"><float name=\"value\" value=\"4\"/></volume><float name=\"albedo\" "
      "value=\"0.5\"/></medium></shape>");
  expect_near(other.balls[0].material.scattering, grey(2));
}

TEST(SceneGridMedia, TakeAlbedosFromGrids) {
  std::string shares = volume_file(4, 4, 16, 1, 3);
  const SceneFile file = fog_with(
      "<float name=\"sigma_t\" value=\"5\"/>" + grid("albedo", "<string name=\"filter_type\" value=\"nearest\"/>"),
      shares);
  EXPECT_TRUE(file.warnings.empty());
  const GridMediumDescription& medium = file.scene.grid_media.at(0);
  EXPECT_EQ(medium.extinction, grey(5));
  EXPECT_FALSE(medium.extinction_grid);
  ASSERT_TRUE(medium.albedo_grid);
  EXPECT_TRUE(medium.albedo_grid->nearest);
}

TEST(SceneGridMedia, SayWhatIsWrong) {
  EXPECT_NE(fog_error("<volume name=\"sigma_t\" type=\"sdfvolume\"/>")
                .find("volume \"sdfvolume\": this volume is not supported: there are constvolume, gridvolume"),
            std::string::npos);
  EXPECT_NE(fog_error("<volume name=\"sigma_t\" type=\"gridvolume\"/>").find("'filename' is missing"),
            std::string::npos);
  EXPECT_NE(fog_error(grid("sigma_t", "<string name=\"wrap_mode\" value=\"repeat\"/>")).find("has to be clamp"),
            std::string::npos);
  EXPECT_NE(fog_error(grid("sigma_t", "<string name=\"filter_type\" value=\"cubic\"/>")).find("trilinear, nearest"),
            std::string::npos);
  EXPECT_NE(fog_error(grid("sigma_t", "<float name=\"gamma\" value=\"2\"/>")).find("named 'gamma' is not supported"),
            std::string::npos);
  EXPECT_NE(fog_error(grid("sigma_t"), "VOL").find("/scenes/fog.vol: offset 0: header"), std::string::npos);
  EXPECT_NE(error_of("<shape type=\"cube\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"homogeneous\"><volume "
                     "name=\"sigma_t\" type=\"gridvolume\"/></medium></shape>")
                .find("'filename' is missing"),
            std::string::npos);
  EXPECT_NE(error_of("<medium id=\"m\" type=\"cloudy\"/>").find("there are homogeneous, heterogeneous"),
            std::string::npos);
}

TEST(SceneGridMedia, NumbersThatAreNoneCountAsNothing) {
  std::string odd = volume_file(2, 1, 1, 1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  odd.replace(48, 4, reinterpret_cast<const char*>(&nan), 4);
  const SceneFile file = fog_with(grid("sigma_t"), odd);
  ASSERT_EQ(file.warnings.size(), 1u);
  EXPECT_NE(file.warnings[0].find("1 numbers of its file are negative or not finite; they count as 0"),
            std::string::npos);
  EXPECT_EQ(file.scene.grid_media[0].extinction_grid->values, (std::vector<float>{0, 1}));
  const SceneFile albedo = fog_with(grid("albedo"), volume_file(3, 1, 1, 1));
  ASSERT_EQ(albedo.warnings.size(), 1u);
  EXPECT_EQ(albedo.scene.grid_media[0].albedo_grid->values, (std::vector<float>{0, 1, 1}));
}

// One <medium> of two shapes is one medium.
TEST(SceneGridMedia, AreReadOnce) {
  const Files files = files_with("<medium type=\"heterogeneous\" id=\"fog\">" + grid("sigma_t") +
                                     "</medium><shape type=\"sphere\"><bsdf type=\"null\"/><ref name=\"interior\" "
                                     "id=\"fog\"/></shape><shape type=\"cube\"><bsdf type=\"dielectric\"/><ref "
                                     "name=\"interior\" id=\"fog\"/></shape>",
                                 volume_file(2, 3, 4, 1));
  const SceneDescription scene = read_file(files).scene;
  ASSERT_EQ(scene.grid_media.size(), 1u);
  EXPECT_EQ(scene.balls[0].material.grid_medium, 0);
  EXPECT_EQ(scene.boxes[0].material.grid_medium, 0);
}

// ---- lights without extent ---------------------------------------------------------------------------------------

TEST(SceneDeltaLights, Points) {
  using Kind = LightDescription::Kind;
  const SceneDescription scene = scene_of(
      "<emitter type=\"point\"><point name=\"position\" value=\"1, 2, 3\"/><rgb name=\"intensity\" "
      "value=\"4 5 6\"/></emitter>"
      "<emitter type=\"point\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"30\"/><translate "
      "z=\"7\"/></transform></emitter>");
  ASSERT_EQ(scene.lights.size(), 2u);
  EXPECT_EQ(scene.lights[0].kind, Kind::point);
  EXPECT_EQ(scene.lights[0].position, (Vec3d{1, 2, 3}));
  EXPECT_EQ(scene.lights[0].radiance, (Rgb{4, 5, 6}));
  EXPECT_EQ(scene.lights[1].position, (Vec3d{0, 0, 7}));
  EXPECT_EQ(scene.lights[1].radiance, grey(1));
  EXPECT_NE(error_of("<emitter type=\"point\"><point name=\"position\" x=\"1\"/><transform "
                     "name=\"to_world\"/></emitter>")
                .find("give either 'position' or 'to_world'"),
            std::string::npos);
  EXPECT_NE(error_of("<emitter type=\"point\"><rgb name=\"radiance\" value=\"1\"/></emitter>")
                .find("named 'radiance' is not supported here; properties are intensity, position, to_world"),
            std::string::npos);
}

// The file says where the light goes: along +z if nothing else is said.
TEST(SceneDeltaLights, Directions) {
  using Kind = LightDescription::Kind;
  const SceneDescription scene = scene_of(
      "<emitter type=\"directional\"/><emitter type=\"directional\"><vector name=\"direction\" value=\"0,-2,1\"/><rgb "
      "name=\"irradiance\" value=\"3\"/></emitter><emitter type=\"directional\"><transform name=\"to_world\"><rotate "
      "x=\"1\" angle=\"90\"/></transform></emitter>");
  ASSERT_EQ(scene.lights.size(), 3u);
  EXPECT_EQ(scene.lights[0].kind, Kind::directional);
  expect_near(scene.lights[0].normal, {0, 0, -1});
  EXPECT_EQ(scene.lights[0].radiance, grey(1));
  expect_near(scene.lights[1].normal, {0, 2, -1});
  EXPECT_EQ(scene.lights[1].radiance, grey(3));
  expect_near(scene.lights[2].normal, {0, 1, 0});  // +z is turned to -y
  EXPECT_NE(error_of("<emitter type=\"directional\"><vector name=\"direction\" value=\"0,0,0\"/></emitter>")
                .find("its direction is zero"),
            std::string::npos);
}

// ---- round trip --------------------------------------------------------------------------------------------------

TEST(SceneRoundTrip, OfGridMediaLightsAndTextures) {
  Files files = {{"/scenes/fog.vol", volume_file(2, 3, 4, 1)},
                 {"/scenes/shares.vol", volume_file(4, 4, 16, 1, 3)},
                 {"/scenes/square.ply", square_ply},
                 {"/scenes/a.csv", "x,y,z,density\n0,0,0,1\n1,0,0,2\n"},
                 {"/scenes/b.csv", "x,y,z,density\n0,1,0,3\n"},
                 {"/scenes/wood.pfm", "PF\n4 2\n-1\n" + std::string(4 * 2 * 3 * sizeof(float), '\0')},
                 {"/scenes/tile.pfm", "PF\n4 2\n-1\n" + std::string(4 * 2 * 3 * sizeof(float), '\0')}};
  const auto picture = [](const std::string& name) {
    return "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"" +
           name + ".pfm\"/></texture></bsdf>";
  };
  // Meshes come before balls here, and after them in what is written.
  const std::string elements =
      "<emitter type=\"point\"><point name=\"position\" value=\"0.1, 1e-17, 3\"/><rgb name=\"intensity\" value=\"4 5 "
      "6\"/></emitter><emitter type=\"directional\"><vector name=\"direction\" value=\"0.1,-2,1\"/></emitter>"
      "<shape type=\"ply\"><string name=\"filename\" value=\"square.ply\"/><boolean name=\"flip_tex_coords\" "
      "value=\"true\"/>" +
      picture("wood") + "</shape><shape type=\"sphere\">" + picture("tile") +
      "</shape>"
      "<medium type=\"heterogeneous\" id=\"one\">" +
      grid("sigma_t",
           "<transform name=\"to_world\"><rotate value=\"1 1 0\" angle=\"20\"/></transform><boolean "
           "name=\"use_grid_bbox\" value=\"true\"/>") +
      "<phase type=\"rayleigh\"/><float name=\"scale\" value=\"0.3\"/></medium>"
      "<shape type=\"ply\"><string name=\"filename\" value=\"square.ply\"/><bsdf type=\"null\"/><ref name=\"interior\" "
      "id=\"one\"/></shape>"
      "<shape type=\"sphere\"><bsdf type=\"dielectric\"/><medium name=\"interior\" type=\"heterogeneous\"><rgb "
      "name=\"sigma_t\" value=\"1 2 3\"/><rgb name=\"sigma_a\" value=\"0.1 0.2 0.3\"/><volume name=\"albedo\" "
      "type=\"gridvolume\"><string name=\"filename\" value=\"shares.vol\"/><string name=\"filter_type\" "
      "value=\"nearest\"/></volume></medium></shape>"
      "<shape type=\"disk\"><transform name=\"to_world\"><scale x=\"-1\"/></transform>" +
      picture("wood") +
      "</shape><shape type=\"rectangle\"><boolean name=\"flip_normals\" value=\"true\"/></shape>"
      "<shape type=\"cylinder\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"20\"/><scale "
      "value=\"-2\"/></transform>" +
      picture("tile") +
      "</shape><shape type=\"cube\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"20\"/></transform>" +
      picture("tile") +
      "</shape>"
      "<shape type=\"particles\"><string name=\"filenames\" value=\"a.csv; b.csv\"/><float name=\"radius\" "
      "value=\"0.1\"/></shape>"
      "<shape type=\"particles\"><string name=\"kind\" value=\"foam\"/><string name=\"filenames\" "
      "value=\"b.csv;a.csv;\"/><float name=\"radius\" value=\"0.1\"/></shape>";
  files["/scenes/scene.xml"] = whole(elements);
  const SceneDescription scene = read_file(files).scene;
  ASSERT_EQ(scene.grid_media.size(), 2u);
  ASSERT_EQ(scene.pictures.size(), 2u);
  files["/scenes/scene.xml"] = write_scene(scene);
  const SceneFile again = read_file(files);
  EXPECT_TRUE(again.warnings.empty()) << again.warnings[0];
  EXPECT_TRUE(again.scene == scene) << files["/scenes/scene.xml"] << "\nand again:\n" << write_scene(again.scene);
  EXPECT_EQ(write_scene(again.scene), files["/scenes/scene.xml"]);
}

TEST(SceneRoundTrip, GridsThatAreNotFromAFileCannotBeNamed) {
  SceneDescription scene;
  scene.grid_media.emplace_back();
  scene.grid_media[0].extinction_grid.emplace();
  EXPECT_THROW(write_scene(scene), Error);
}

// ---- several files of particles ----------------------------------------------------------------------------------

TEST(SceneParticles, OfSeveralFilesAreOneFluid) {
  const auto read = [](const std::string& properties) {
    const Files files = {{"/scenes/scene.xml", whole("<shape type=\"particles\"><float name=\"radius\" "
                                                     "value=\"0.1\"/>" +
                                                     properties + "</shape>")},
                         {"/scenes/a.csv", "x,y,z,density,age\n0,0,0,1,5\n1,0,0,2,6\n"},
                         {"/scenes/b.csv", "x,y,z,density\n0,1,0,3\n"}};
    return read_file(files);
  };
  const SceneFile file =
      read("<string name=\"filenames\" value=\"a.csv; b.csv\"/><string name=\"density\" value=\"density\"/>");
  ASSERT_EQ(file.scene.fluids.size(), 1u);
  const FluidDescription& fluid = file.scene.fluids[0];
  EXPECT_EQ(fluid.file, "/scenes/a.csv");
  EXPECT_EQ(fluid.more_files, (std::vector<std::string>{"/scenes/b.csv"}));
  ASSERT_EQ(fluid.positions.size(), 3u);
  EXPECT_EQ(fluid.positions[2], (Vec3d{0, 1, 0}));
  EXPECT_EQ(fluid.medium->densities, (std::vector<float>{1, 2, 3}));
  ASSERT_EQ(file.warnings.size(), 1u);
  EXPECT_NE(file.warnings[0].find("the attribute \"age\" is not in all of the files; it is left out"),
            std::string::npos);
  EXPECT_THROW(read("<string name=\"filenames\" value=\" ; \"/>"), Error);
  EXPECT_THROW(read("<string name=\"filenames\" value=\"a.csv\"/><string name=\"filename\" value=\"a.csv\"/>"), Error);
}

// ---- references --------------------------------------------------------------------------------------------------

// Whatever an object can hold it can refer to.
TEST(SceneReferences, StandForAnyObject) {
  const SceneDescription scene = scene_of(
      "<film type=\"hdrfilm\" id=\"film\"><integer name=\"width\" value=\"33\"/><ref id=\"box\"/></film>"
      "<rfilter type=\"box\" id=\"box\"/><sampler type=\"independent\" id=\"samples\"><integer name=\"sample_count\" "
      "value=\"9\"/></sampler><phase type=\"rayleigh\" id=\"air\"/>"
      "<medium type=\"homogeneous\" id=\"haze\"><ref id=\"air\"/></medium>"
      "<sensor type=\"perspective\"><ref id=\"film\"/><ref id=\"samples\"/></sensor>"
      "<shape type=\"sphere\"><ref name=\"interior\" id=\"haze\"/><bsdf type=\"null\"/></shape>");
  EXPECT_EQ(scene.film.width, 33);
  EXPECT_EQ(scene.camera.filter.kind, FilterKind::box);
  EXPECT_EQ(scene.integrator.samples, 9);
  EXPECT_EQ(scene.balls[0].material.phase.kind, PhaseKind::rayleigh);
}

}  // namespace
}  // namespace embrun

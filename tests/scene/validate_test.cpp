#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "base/error.h"
#include "scene/compile.h"

namespace embrun {
namespace {

/// A scene with one of everything, all of it good.
SceneDescription good_scene() {
  SceneDescription scene;
  FluidDescription fluid;
  fluid.positions = {{0, 0, 0}, {0.1, 0, 0}};
  fluid.surface.radius = 0.05f;
  scene.fluids.push_back(fluid);
  scene.balls.push_back({{{{1, 0, 0}, 0.2}}, diffuse_material({0.5f, 0.5f, 0.5f})});
  scene.boxes.push_back({{{2, 0, 0}, {3, 1, 1}}, dielectric_material(1.5)});
  PatchDescription patch;
  scene.patches.push_back(patch);
  MeshDescription mesh;
  mesh.mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.mesh.triangles = {{{0, 1, 2}}};
  scene.meshes.push_back(mesh);
  LightDescription light;
  light.edge_u = {1, 0, 0};
  light.edge_v = {0, 0, 1};
  scene.lights.push_back(light);
  VolumeDescription foam;
  foam.positions = {{4, 0, 0}, {4.1, 0, 0}};
  scene.volumes.push_back(foam);
  scene.fluids[0].medium.emplace();
  GridMediumDescription fog;
  fog.extinction_grid.emplace();
  fog.extinction_grid->nx = fog.extinction_grid->ny = 1;
  fog.extinction_grid->nz = 2;
  fog.extinction_grid->values = {1, 2};
  scene.grid_media.push_back(fog);
  scene.boxes[0].material.grid_medium = 0;
  scene.camera.eye = {0, 0, 5};
  return scene;
}

struct Flaw {
  const char* name;
  std::function<void(SceneDescription&)> make;
  const char* message;  ///< part of it
};
void PrintTo(const Flaw& f, std::ostream* os) { *os << f.name; }

const double nan_value = std::nan("");

const Flaw flaws[] = {
    {"scattering", [](auto& s) { s.boxes[0].material.scattering.g = -1; }, "box 1: scattering 0,-1,0 has a channel"},
    {"fog_absorption",
     [](auto& s) {
       s.boxes[0].material = fog_material({infinity, 0, 0}, {});
     },
     "what is opaque is a surface"},
    {"phase", [](auto& s) { s.boxes[0].material.phase.g = 1; }, "box 1: phase function: g = 1 is not in"},
    {"patch_of_fog",
     [](auto& s) {
       s.patches[0].material = fog_material({1, 1, 1}, {});
     },
     "no inside"},
    {"extinction", [](auto& s) { s.volumes[0].medium.extinction.b = infinity; }, "volume 1: extinction 1,1,inf"},
    {"albedo", [](auto& s) { s.fluids[0].medium->albedo.r = 1.5f; }, "fluid 1: albedo: 1.5,1,1"},
    {"extinction_scale", [](auto& s) { s.volumes[0].medium.extinction_scale = nan_value; }, "extinction scale nan"},
    {"density_radius", [](auto& s) { s.volumes[0].medium.density_radius = -1; }, "density radius -1"},
    {"densities", [](auto& s) { s.volumes[0].medium.densities = {1}; }, "volume 1: 1 densities for 2 particles"},
    {"density",
     [](auto& s) {
       s.fluids[0].medium->densities = {1, -2};
     },
     "fluid 1: particle 1: density -2"},
    {"own_extinction",
     [](auto& s) {
       s.fluids[0].medium->extinctions = {{1, 1, 1}, {1, -1, 1}};
     },
     "fluid 1: particle 1: extinction 1,-1,1"},
    {"own_albedo",
     [](auto& s) {
       s.fluids[0].medium->albedos = {{1, 1, 1}, {1, 2, 1}};
     },
     "fluid 1: particle 1: albedo: 1,2,1"},
    {"two_glows",
     [](auto& s) {
       s.volumes[0].medium.emission = {{1, 1, 1}, {1, 1, 1}};
       s.volumes[0].medium.temperatures = {1000, 1000};
     },
     "both emission and temperatures"},
    {"temperature",
     [](auto& s) {
       s.volumes[0].medium.temperatures = {1000, -3};
     },
     "temperature -3 K"},
    {"volume_radius", [](auto& s) { s.volumes[0].radius = 0; }, "volume 1: particle radius 0"},
    {"volume_position", [](auto& s) { s.volumes[0].positions[1].y = nan_value; }, "position of particle 1"},
    {"opaque_fluid_that_scatters", [](auto& s) { s.fluids[0].material = diffuse_material(grey(0.5f)); },
     "no light gets through its surface"},
    {"distorted_balls",
     [](auto& s) {
       s.fluids[0].placement.x_axis = {2, 0, 0};
     },
     "as balls, which the placement"},
    {"no_particles", [](auto& s) { s.fluids[0].positions.clear(); }, "fluid 1: it has no particles"},
    {"mesh_cell", [](auto& s) { s.fluids[0].mesh_cell = -1; }, "mesh cell -1"},
    {"density_cell", [](auto& s) { s.fluids[0].density_cell = -1; }, "density cell -1"},
    {"wall_overlap", [](auto& s) { s.fluids[0].wall_overlap = -1; }, "overlap with walls of -1"},
    {"radius", [](auto& s) { s.fluids[0].surface.radius = -1; }, "particle radius -1 is not positive"},
    {"nan_radius", [](auto& s) { s.fluids[0].surface.radius = std::nanf(""); }, "particle radius nan"},
    {"order", [](auto& s) { s.fluids[0].surface.order = 0; }, "neighbourhood order 0"},
    {"threshold",
     [](auto& s) {
       s.fluids[0].surface.threshold_mode = ThresholdMode::number;
       s.fluids[0].surface.threshold = 0;
     },
     "threshold 0 is not positive"},
    {"radii", [](auto& s) { s.fluids[0].radii = {1}; }, "1 radii for 2 particles"},
    {"one_radius",
     [](auto& s) {
       s.fluids[0].radii = {1, -2};
     },
     "radius -2 of particle 1"},
    {"position", [](auto& s) { s.fluids[0].positions[1].y = nan_value; }, "position of particle 1 is not finite"},
    {"ior", [](auto& s) { s.fluids[0].material.ior = 0.5; }, "refractive index 0.5"},
    {"absorption", [](auto& s) { s.fluids[0].material.absorption.g = -1; }, "absorption 0,-1,0"},
    {"priority", [](auto& s) { s.fluids[0].material.priority = 0; }, "priority 0"},
    {"container",
     [](auto& s) {
       s.fluids[0].container = Box3d{{0, 0, 0}, {1, -1, 1}};
     },
     "container: the first corner"},
    {"placement",
     [](auto& s) {
       s.fluids[0].placement.x_axis = {0, 0, 0};
     },
     "the placement flattens it"},
    {"ball", [](auto& s) { s.balls[0].balls[0].radius = -1; }, "set of balls 1: a ball of radius -1"},
    {"picture",
     [](auto& s) {
       s.patches[0].material.reflectance.kind = TextureKind::bitmap;
       s.patches[0].material.reflectance.picture = 0;
     },
     "patch 1: reflectance: it shows picture 0 of 0"},
    {"picture_size",
     [](auto& s) {
       s.pictures.emplace_back().image = make_image(2, 2, 3);
       s.pictures[0].image.pixels.pop_back();
     },
     "picture 1: 11 values for 2 x 2 pixels"},
    {"picture_negative",
     [](auto& s) {
       s.pictures.emplace_back().image = make_image(2, 2, 3);
       s.pictures[0].image.pixels[3] = -1;
     },
     "picture 1: it has a pixel that is negative"},
    {"picture_channels", [](auto& s) { s.pictures.emplace_back().image = make_image(2, 2, 2); }, "of 2 channels"},
    {"texture_transform",
     [](auto& s) {
       s.patches[0].material.reflectance.kind = TextureKind::uv_checker;
       s.patches[0].material.reflectance.to_uv[2] = nan_value;
     },
     "patch 1: reflectance: its transform"},
    {"fluid_texture", [](auto& s) { s.fluids[0].material.reflectance.kind = TextureKind::uv_checker; },
     "has no coordinates (u, v)"},
    {"mesh_coordinates", [](auto& s) { s.meshes[0].mesh.coordinates.resize(2); },
     "mesh 1: 2 texture coordinates for 3 positions"},
    {"mesh_coordinate",
     [](auto& s) {
       s.meshes[0].mesh.coordinates = {{0, 0}, {0, infinity}, {1, 0}};
     },
     "mesh 1: a texture coordinate is not finite"},
    {"pole",
     [](auto& s) {
       s.balls[0].pole = {1, 0, 1};
     },
     "pole and meridian are not at right angles"},
    {"back_of_glass", [](auto& s) { s.boxes[0].material.back.push_back(diffuse_material({})); },
     "box 1: only what is opaque"},
    {"back_reflectance",
     [](auto& s) {
       s.patches[0].material.back.push_back(diffuse_material({2, 0, 0}));
     },
     "patch 1: its back: reflectance: 2,0,0"},
    {"two_backs", [](auto& s) { s.patches[0].material.back.resize(2); }, "patch 1: 2 materials for its back"},
    {"conductor_index",
     [](auto& s) {
       s.patches[0].material = conductor_material({0, 0, 0}, {0, 1, 1});
     },
     "patch 1: eta and k of a channel are both 0"},
    {"principled",
     [](auto& s) {
       s.patches[0].material.kind = BsdfKind::principled;
       s.patches[0].material.principled.sheen = 2;
     },
     "patch 1: sheen 2 is not in [0, 1]"},
    {"glass_patch",
     [](auto& s) {
       s.patches[0].material.kind = BsdfKind::principled;
       s.patches[0].material.principled.spec_trans = 0.1;
     },
     "patch 1: a patch has no inside"},
    {"thin_fluid", [](auto& s) { s.fluids[0].material.kind = BsdfKind::thin_dielectric; },
     "none that a surface can have"},
    {"roughness_v", [](auto& s) { s.balls[0].material.roughness_v = -0.1; }, "roughness_v -0.1 is not in"},
    {"reflectance", [](auto& s) { s.balls[0].material.reflectance.first.r = 1.5f; }, "not in [0, 1]"},
    {"box", [](auto& s) { s.boxes[0].box.high.x = 2; }, "box 1: the first corner"},
    {"patch_axes",
     [](auto& s) {
       s.patches[0].axis_v = {1, 0, 0};
     },
     "patch 1: its axes are not at right angles"},
    {"patch_size", [](auto& s) { s.patches[0].half_u = 0; }, "patch 1: its half sides"},
    {"patch_of_water", [](auto& s) { s.patches[0].material = dielectric_material(1.33); }, "a patch has no inside"},
    {"checker",
     [](auto& s) {
       s.patches[0].material.reflectance.kind = TextureKind::checker;
       s.patches[0].material.reflectance.cell = 0;
     },
     "checker cells of 0 m"},
    {"mesh_index", [](auto& s) { s.meshes[0].mesh.triangles[0][1] = 7; }, "a triangle names position 7 of 3"},
    {"mesh_normals",
     [](auto& s) {
       s.meshes[0].mesh.normals = {{0, 0, 1}};
     },
     "1 normals for 3 positions"},
    {"no_triangles", [](auto& s) { s.meshes[0].mesh.triangles.clear(); }, "mesh 1: it has no triangles"},
    {"light_edges",
     [](auto& s) {
       s.lights[0].edge_v = {1, 1, 0};
     },
     "light 1: its edges are not at right angles"},
    {"light_radius",
     [](auto& s) {
       s.lights[0].kind = LightDescription::Kind::sphere;
       s.lights[0].radius = -1;
     },
     "light 1: its radius -1"},
    {"light_direction",
     [](auto& s) {
       s.lights[0].kind = LightDescription::Kind::directional;
       s.lights[0].normal = {};
     },
     "light 1: its direction is zero"},
    {"light_intensity",
     [](auto& s) {
       s.lights[0].kind = LightDescription::Kind::point;
       s.lights[0].radiance.g = -1;
     },
     "radiance -1"},
    {"grid_cells", [](auto& s) { s.grid_media[0].extinction_grid->nx = 0; }, "grid medium 1: extinction: 0 x 1 x 2"},
    {"grid_values", [](auto& s) { s.grid_media[0].extinction_grid->values.pop_back(); },
     "grid medium 1: extinction: 1 values for 1 x 1 x 2 cells"},
    {"grid_negative", [](auto& s) { s.grid_media[0].extinction_grid->values[1] = -1; }, "value 1 is -1"},
    {"grid_nan", [](auto& s) { s.grid_media[0].extinction_grid->values[0] = std::nanf(""); }, "value 0 is nan"},
    {"grid_flat", [](auto& s) { s.grid_media[0].extinction_grid->placement.z_axis = {}; }, "the placement flattens it"},
    {"grid_albedo",
     [](auto& s) {
       s.grid_media[0].albedo_grid = s.grid_media[0].extinction_grid;  // which has a 2
     },
     "grid medium 1: albedo: value 1 is 2"},
    {"grid_scale", [](auto& s) { s.grid_media[0].scale = -2; }, "grid medium 1: scale -2"},
    {"grid_reference", [](auto& s) { s.meshes[0].material.grid_medium = 3; }, "mesh 1: it names grid medium 4 of 1"},
    {"meridian",
     [](auto& s) {
       s.cylinders.push_back({{0, 0, 0}, {0, 0, 1}, 1, {0, 1, 1}, false, {}, {}});
     },
     "cylinder 1: its meridian is not at right angles"},
    {"light_radiance", [](auto& s) { s.lights[0].radiance.g = -1; }, "radiance"},
    {"environment", [](auto& s) { s.environment.constant.b = -1; }, "environment: radiance"},
    {"no_pixels", [](auto& s) { s.film.width = 0; }, "picture of 0 x 720 pixels"},
    {"crop",
     [](auto& s) {
       s.film.crop = PixelWindow{1270, 0, 20, 20};
     },
     "crop 1270,0,20,20"},
    {"huge_crop",
     [](auto& s) {
       s.film.crop = PixelWindow{0, 0, 2147483647, 20};
     },
     "crop"},
    {"samples", [](auto& s) { s.integrator.samples = 0; }, "0 samples per pixel"},
    {"depth", [](auto& s) { s.integrator.max_depth = 70000; }, "greatest depth 70000"},
    {"refractions", [](auto& s) { s.integrator.max_refractions = -2; }, "-2 refractions"},
    {"occlusion", [](auto& s) { s.integrator.occlusion_distance = 0; }, "occlusion up to 0 m"},
    {"gauss_samples",
     [](auto& s) {
       s.integrator.kind = IntegratorKind::gauss;
       s.integrator.samples = 17;
     },
     "17 nodes of Gauss's rule (one for each sample of a pixel): their number has to be heights times azimuths, from 1 "
     "to 8 "
     "azimuths for each height, and at most 65536; the nearest are 16 (2 x 8) and 18 (2 x 9)"},
    {"gauss_nodes",
     [](auto& s) {
       s.integrator.kind = IntegratorKind::gauss;
       s.integrator.gauss_nodes = 70000;
     },
     "the nearest are 65536 (128 x 512)"},
    {"gauss_negative",
     [](auto& s) {
       s.integrator.kind = IntegratorKind::gauss;
       s.integrator.gauss_nodes = -16;
     },
     "-16 nodes"},
    {"fov", [](auto& s) { s.camera.vertical_fov = 180; }, "field of view"},
    {"camera", [](auto& s) { s.camera.target = s.camera.eye; }, "camera"},
};

class Validation : public ::testing::TestWithParam<Flaw> {};

TEST_P(Validation, NamesWhatIsWrong) {
  SceneDescription scene = good_scene();
  EXPECT_NO_THROW(compile(scene));
  GetParam().make(scene);
  try {
    compile(scene);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(GetParam().message), std::string::npos) << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(Flaws, Validation, ::testing::ValuesIn(flaws),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace embrun

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "camera/camera.h"
#include "geometry/mls_support.h"
#include "geometry/surface_settings.h"
#include "geometry/triangle_mesh.h"
#include "image/image.h"
#include "lights/integrator_kind.h"
#include "lights/sky.h"
#include "math/box3d.h"
#include "math/rgb.h"
#include "math/up_axis.h"
#include "particles/splat_options.h"
#include "sampling/sampler.h"
#include "scene/material_description.h"
#include "scene/medium_description.h"
#include "scene/placement.h"

// A scene as plain data: positions in metres and double precision, wherever the world's origin is. It can be printed,
// compared and changed at will; compile() checks it and makes what a ray touches. Defaults are usable.

namespace embrun {

struct SplatHierarchy;

/// What surface a point cloud has.
enum class CloudSurface {
  splats,  ///< the discs or ellipses themselves
  mls,     ///< a moving least squares surface, smooth and the same from everywhere: see geometry/mls_surface.h
};

/// The discs or ellipses that stand for the surface of a point cloud. Arrays have one entry a splat.
struct SplatsDescription {
  /// The splats are these (geometry/splat_hierarchy.h), and all arrays below empty; `closed` is what they say themselves.
  std::shared_ptr<const SplatHierarchy> hierarchy;
  std::vector<Vec3d> centers;
  std::vector<Vec3> normals;  ///< unit; out of the body where the cloud is closed
  std::vector<float> radii;   ///< of an ellipse the greater half axis
  /// The lesser half axes of ellipses, at right angles to the normals, metres; or empty: all are discs.
  std::vector<Vec3> lesser_axes;
  std::vector<Rgb> colors;  ///< linear, or empty: see TextureKind::own
  /// The splats bound a body, without holes: splats that reach over its silhouette are not seen, and it has an inside.
  bool closed = false;
  CloudSurface surface = CloudSurface::splats;
  /// Of a moving least squares surface: how far a point is felt, in radii of its splat, in [1, 16].
  double mls_support = mls_default_support;
  bool bent_normals = false;  ///< a splat's normal turns over it as those of its neighbours do
  /// Level of detail: where a ray's footprint (a pixel's, at first) times this is larger than a part of the cloud, one splat
  /// stands for the part. 0: off, every splat is met.
  double detail = 0;
  MaterialDescription material;
  Placement placement;
  std::string file;      ///< where the points are from, or empty
  SplatOptions options;  ///< how they became splats
  bool flipped = false;  ///< the normals were turned round then

  bool operator==(const SplatsDescription&) const = default;
};

/// Who finds a fluid's surface along a ray: Embrun's own way; the thesis's, kept as a baseline (very slow); or Embree, on
/// a triangle mesh of the surface, the pipeline that the others are judged against.
enum class SurfaceMethod { fast, thesis, mesh };

/// The continuous surface of a fluid's particles.
struct FluidDescription {
  std::vector<Vec3d> positions;
  std::vector<float> radii;  ///< one per particle, or empty: `surface.radius` for all
  SurfaceSettings surface;
  SurfaceMethod method = SurfaceMethod::fast;
  // Of SurfaceMethod::mesh, metres, 0: half the radius. Sides of the cells that the mesh is made from, and of those of the
  // grid that holds what is inside it.
  double mesh_cell = 0, density_cell = 0;
  /// Level of detail, of SurfaceMethod::fast and particles of one radius: where the footprint of a path's first ray at the
  /// fluids (a pixel's there) times this is no less than twice the particles' rest spacing (in the world, where the
  /// placement stretches it most), a coarse surface stands for theirs (see surface_levels.h). 0: off.
  double detail = 0;
  MaterialDescription material = dielectric_material(1.33);
  /// The fluid ends at this box, with a flat face wherever it reaches it.
  std::optional<Box3d> container;
  /// Fluid that lies at a face of the container wets it: solvers keep particles up to two radii from a wall, and the
  /// gap is closed by mirror images of the particles behind the face.
  bool wets_container = true;
  /// Metres by which the fluid's flat faces lie outside the container's: within walls of a higher priority, which end it.
  double wall_overlap = 0;
  Placement placement;
  /// What its particles do to light inside its surface, besides the material's absorption and scattering. The surface's
  /// material must be a dielectric; the placement must keep balls balls.
  std::optional<ParticleMediumDescription> medium;
  std::string file;                     ///< where the particles are from, or empty
  std::vector<std::string> more_files;  ///< whose particles follow those of `file`
  std::string kinds;  ///< how they were told from the file's others (see kind_mapping_from_text), or empty

  bool operator==(const FluidDescription&) const = default;
};

struct BallDescription {
  Vec3d center;
  double radius = 1;

  bool operator==(const BallDescription&) const = default;
};

/// Balls on their own; one of radius 0 is not there. Those of one material that has an inside are one solid where they
/// overlap. Sets of equal materials are one set.
struct BallsDescription {
  std::vector<BallDescription> balls;
  MaterialDescription material;
  /// At right angles, of any length: where v is 0 on each ball, and where u is 0 on its equator.
  Vec3d pole{0, 0, 1}, meridian{1, 0, 0};
  Rgb radiance{};  ///< emitted outwards by each; 0: none

  bool operator==(const BallsDescription&) const = default;
};

struct BoxDescription {
  Box3d box{{}, {}};
  MaterialDescription material;

  bool operator==(const BoxDescription&) const = default;
};

/// A flat rectangle, seen from both sides unless the material is one-sided. The normal is that of `axis_u` x `axis_v`.
struct PatchDescription {
  Vec3d center;
  Vec3d axis_u{1, 0, 0}, axis_v{0, 0, -1};  ///< at right angles; any length
  double half_u = 1, half_v = 1;            ///< metres; infinite for a whole plane
  MaterialDescription material;
  bool round = false;       ///< the ellipse in the rectangle
  bool v_reversed = false;  ///< its coordinate v grows against axis_v: a texture is mirrored
  Rgb radiance;  ///< emitted, on the side of the normal; 0: none. Needs finite sides, and equal ones if round

  bool operator==(const PatchDescription&) const = default;
};

/// The side of a cylinder, without ends, seen from both sides.
struct CylinderDescription {
  Vec3d start, end;  ///< of its axis
  double radius = 1;
  /// At right angles to the axis, of any length: where the coordinate u is 0; 0,0,0: anywhere.
  Vec3d meridian;
  bool u_reversed = false;  ///< u grows to the left about the axis: a texture is mirrored
  MaterialDescription material;
  Rgb radiance;  ///< emitted outwards; 0: none

  bool operator==(const CylinderDescription&) const = default;
};

struct MeshDescription {
  TriangleMesh mesh;
  Placement placement;
  MaterialDescription material;
  Rgb radiance;  ///< emitted, on the side of the triangles' normals; 0: none
  /// Where the mesh stands if in several places at once, in place of `placement`.
  std::vector<Placement> copies;
  bool face_normals = false;         ///< normals of the file were left out
  bool flipped = false;              ///< the file's triangles and normals were turned round
  bool coordinates_flipped = false;  ///< the file's texture coordinates v became 1 - v
  std::string file;                  ///< where the mesh is from, or empty

  bool operator==(const MeshDescription&) const = default;
};

/// A lamp without geometry of its own: opaque, and visible if it has any extent.
struct LightDescription {
  /// The last two have no extent and are not seen themselves: nor in mirrors, and through refracting surfaces they shine
  /// by straight shadow rays alone.
  enum class Kind { rectangle, disk, sphere, distant, point, directional };
  Kind kind = Kind::rectangle;
  Rgb radiance{1, 1, 1};    ///< of a point: its intensity (power per steradian); of a directional light: its irradiance
  Vec3d position;           ///< corner of a rectangle, centre of a disk or sphere, a point
  Vec3d edge_u, edge_v;     ///< of a rectangle, at right angles; it shines to the side of edge_u x edge_v
  Vec3d normal{0, -1, 0};   ///< of a disk: where it shines to; of light from infinity: the direction towards it
  double radius = 1;        ///< of a disk or sphere
  double half_angle = 2.5;  ///< of a distant light, degrees
  bool two_sided = false;

  bool operator==(const LightDescription&) const = default;
};

/// Light from infinitely far all round.
struct EnvironmentDescription {
  enum class Kind { none, constant, sky, studio, image };
  Kind kind = Kind::constant;
  Rgb constant{1, 1, 1};
  SkySettings sky;
  Image image;       ///< latitude-longitude, 3 channels, row 0 at the zenith
  double turn = 0;   ///< degrees about the up axis, anticlockwise from above
  double scale = 1;  ///< factor on the picture's radiance
  std::string file;  ///< where the picture is from, or empty

  bool operator==(const EnvironmentDescription&) const = default;
};

struct FilmDescription {
  int width = 1280, height = 720;
  std::optional<PixelWindow> crop;

  bool operator==(const FilmDescription&) const = default;
};

/// Whether an integrator's shadow rays go straight through interfaces where nothing else is said. Whitted's do: no other of
/// its ways leads light into water, which would be black.
constexpr bool straight_shadows_of(IntegratorKind kind) { return kind == IntegratorKind::whitted; }

/// How light is followed: see PathSettings.
struct IntegratorDescription {
  IntegratorKind kind = IntegratorKind::path;
  std::uint32_t seed = 0;
  SamplerKind sampler = SamplerKind::sobol;
  int samples = 64;          ///< per pixel
  int max_depth = 256;       ///< scattering events, 0 to 65535
  int max_refractions = -1;  ///< -1: any number
  int roulette_depth = 5;
  bool hide_emitters = false;  ///< the camera does not see lights; what they light it sees
  /// Learn first from where light comes at diffuse surfaces, where that is worth it: less noise under water.
  bool guide = true;
  /// Small lights find their way through water's surface only by chance. True: shadow rays go straight on through
  /// interfaces, with Fresnel's and the medium's transmittance, and the same light is not counted when it is met by
  /// refraction. Quiet, but biased: the light comes from where it would come without refraction. What files and options do
  /// not say is straight_shadows_of(kind).
  bool straight_shadows = false;
  /// Small lamps in media: points that they light are also drawn by where the lamp is. Unbiased either way.
  bool equiangular = true;
  /// Most that a light found after the first scattering event may bring to a sample, per channel (radiance); what is above
  /// is cut off. Infinite: none, as everything else is biased.
  double clamp = static_cast<double>(infinity);
  /// Of ambient occlusion: what is farther away occludes nothing, metres. Infinite: no limit.
  double occlusion_distance = static_cast<double>(infinity);
  /// Of Gauss's quadrature: nodes of its rule, which the samples of a pixel take in turn. 0: as many as `samples`.
  int gauss_nodes = 0;

  bool operator==(const IntegratorDescription&) const = default;
};

/// Nodes of Gauss's rule; the number is good if it has a hemisphere_rule_size().
constexpr int gauss_nodes_of(const IntegratorDescription& integrator) {
  return integrator.gauss_nodes == 0 ? integrator.samples : integrator.gauss_nodes;
}

struct SceneDescription {
  UpAxis up = UpAxis::y;
  std::vector<FluidDescription> fluids;
  std::vector<VolumeDescription> volumes;
  /// What fills bodies whose materials name it.
  std::vector<GridMediumDescription> grid_media;
  /// Where particles of several fluids and volumes overlap.
  MediaOverlap overlap = MediaOverlap::sum;
  std::vector<BallsDescription> balls;
  std::vector<BoxDescription> boxes;
  std::vector<PatchDescription> patches;
  std::vector<CylinderDescription> cylinders;
  std::vector<MeshDescription> meshes;
  std::vector<SplatsDescription> splats;
  /// What the textures of the materials show.
  std::vector<PictureDescription> pictures;
  std::vector<LightDescription> lights;
  EnvironmentDescription environment;
  CameraSettings camera;
  FilmDescription film;
  IntegratorDescription integrator;

  bool operator==(const SceneDescription&) const = default;
};

/// Throws Error, naming the element and the value, when the scene cannot be rendered as it stands.
void validate(const SceneDescription& scene);

}  // namespace embrun

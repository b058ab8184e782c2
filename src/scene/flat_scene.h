#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "camera/camera.h"
#include "geometry/ball.h"
#include "geometry/ball_set.h"
#include "geometry/box.h"
#include "geometry/coarse_surface.h"
#include "geometry/cylinder.h"
#include "geometry/detail_blocks.h"
#include "geometry/implicit_surface.h"
#include "geometry/patch.h"
#include "geometry/splat_hierarchy.h"
#include "geometry/splat_tree.h"
#include "geometry/surface_levels.h"
#include "geometry/thesis_tracer.h"
#include "lights/light_set_builder.h"
#include "materials/material.h"
#include "math/transform.h"
#include "media/grid_medium_build.h"
#include "media/media_state.h"
#include "media/particle_density_build.h"
#include "sampling/hemisphere_rule.h"
#include "scene/scene_description.h"

namespace embrun {

enum class GeometryKind : std::uint8_t { fluid, balls, box, patch, cylinder, mesh, splats };

/// A geometry in its place: everything that a ray meets is found through one of these.
struct Instance {
  /// Of balls they turn the texture's coordinates alone.
  Transform to_world, to_object;
  bool identity = true;            ///< the geometry is in the scene's space
  bool needs_coordinates = false;  ///< the material does
  GeometryKind kind = GeometryKind::patch;
  std::uint8_t media_class = 0;  ///< of the inside; 0: opaque or without inside
  std::int16_t fluid = -1;       ///< number of the instance among those of fluids, or -1
  std::int16_t splats = -1;      ///< number of the instance among those of splats, or -1
  std::int8_t solid = -1;        ///< its number in MediaState, or -1: its side is not followed
  std::uint32_t geometry = 0;    ///< index into the array of its kind
  std::uint32_t material = 0;
  std::int32_t light = -1;  ///< what it is as a light, or -1
  float offset = 0;         ///< least distance of a new ray's origin from the surface, world metres
};

/// Which levels of detail of a fluid there are: `finest` to `coarsest`, 0 the particles' own surface.
struct FluidLevels {
  /// Those of the description over the placement's largest scale: a level serves rays whose Ray::detail times this is at
  /// least its cell in the fluid's own space. 0: level 0 alone.
  float footprints = 0;
  float spacing = 0;  ///< rest spacing, metres of the fluid's own space
  std::int32_t finest = 0, coarsest = 0;
  std::uint32_t first = 0;  ///< where the coarse ones begin in SceneView::coarse_surfaces

  EMBRUN_FN int level(float detail) const {
    return footprints > 0.0f ? max_of(surface_level_for(footprints * detail, spacing, coarsest), finest) : 0;
  }
  /// Where level >= 1 is in SceneView::coarse_surfaces.
  EMBRUN_FN std::uint32_t index(int level) const {
    return first + static_cast<std::uint32_t>(level - max_of(finest, 1));
  }
};

/// A fluid's surface and the box that ends it (if any), in the fluid's own space.
struct FluidGeometry {
  ImplicitSurfaceView surface{};  ///< level 0, if it is there
  FluidLevels levels;
  // Where the description asks for it, one of these takes the surface's place.
  const ThesisSurface* thesis = nullptr;  ///< host only
  std::int32_t mesh = -1;                 ///< index into FlatScene::meshes, or -1
  bool clipped = false;
  Box3 clip;
};

/// A stretch of FlatScene::ball_blocks: the balls of one material.
struct BallRange {
  std::uint32_t first = 0, count = 0;
  float slack = 0;  ///< see BallSet
  float step = 0;   ///< a usual ball's diameter, metres
};

/// A cloud of splats in its own space.
struct SplatGeometry {
  SplatSet set;
  SplatTreeView tree;
  bool mls = false;  ///< the surface is that of mls_surface.h, and set and tree are as that wants them
};

/// What owns a SplatGeometry's arrays. Where there are levels of detail, stand-ins follow the tree's splats in all of them.
struct SplatArrays {
  SplatTree tree;
  std::vector<Rgb> colors;
  std::vector<SplatBend> bends;
  std::uint32_t first_stand_in = 0;  ///< block, where there are levels
  float detail = 0;                  ///< see SplatTreeView; 0: there are none
};

/// Stretches of the mesh arrays; triangles index into the whole position array.
struct MeshRange {
  std::uint32_t first_position = 0, position_count = 0;
  std::uint32_t first_triangle = 0, triangle_count = 0;
  bool smooth = false;           ///< has normals, one per position
  bool has_coordinates = false;  ///< the same of texture coordinates
};

struct MeshTriangle {
  std::uint32_t a = 0, b = 0, c = 0;
};

/// The arrays of a compiled scene, for per-ray code on any device. Coordinates are relative to
/// FlatScene::recentring.
struct SceneView {
  const Instance* instances = nullptr;
  int instance_count = 0;
  const FluidGeometry* fluids = nullptr;
  const CoarseSurfaceView* coarse_surfaces = nullptr;
  const BallRange* ball_ranges = nullptr;
  const BallBlock* ball_blocks = nullptr;
  const SplatGeometry* splats = nullptr;
  const Box3* boxes = nullptr;
  const Patch* patches = nullptr;
  const Cylinder* cylinders = nullptr;
  const MeshRange* meshes = nullptr;
  const Vec3* mesh_positions = nullptr;
  const Vec3* mesh_normals = nullptr;
  const Vec2* mesh_coordinates = nullptr;
  const MeshTriangle* mesh_triangles = nullptr;
  const Material* materials = nullptr;
};

/// A compiled scene: arrays and indices that never change while it is rendered.
struct FlatScene {
  Vec3d recentring;  ///< the point of the world that is the origin of all coordinates below
  Box3 bounds;       ///< of everything finite; never empty
  std::vector<Instance> instances;
  std::vector<ImplicitSurface> surfaces;  ///< owners of what `fluids` view
  std::vector<std::unique_ptr<ThesisSurface>> thesis_surfaces;
  std::vector<FluidGeometry> fluids;
  std::vector<CoarseSurface> coarse_owners;  ///< of what `coarse_surfaces` view
  std::vector<CoarseSurfaceView> coarse_surfaces;
  CellGrid detail_grid;                     ///< of fluids with levels of detail, or empty
  std::vector<std::uint8_t> detail_filled;  ///< see DetailBlocks
  std::vector<BallRange> ball_ranges;
  std::vector<BallBlock> ball_blocks;
  std::vector<SplatArrays> splat_arrays;                           ///< owners of what `splats` view
  std::vector<std::shared_ptr<const SplatHierarchy>> splat_files;  ///< likewise
  std::vector<SplatGeometry> splats;
  std::vector<Box3> boxes;
  std::vector<Patch> patches;
  std::vector<Cylinder> cylinders;
  std::vector<MeshRange> meshes;
  std::vector<Vec3> mesh_positions, mesh_normals;
  std::vector<Vec2> mesh_coordinates;
  std::vector<MeshTriangle> mesh_triangles;
  std::vector<Image> pictures;  ///< owners of what textures view
  std::vector<Material> materials;
  std::vector<Medium> media;               ///< by class; [0] is the air
  ParticleDensity density;                 ///< the particles of all media
  std::uint32_t volumes = 0;               ///< mask of its fluids that count everywhere
  std::vector<GridMediumData> grid_media;  ///< owners of what `grids` view
  std::vector<GridMedium> grids;           ///< by Medium::grid
  EnvironmentImage environment;            ///< owner of what the lights view
  LightSetBuilder lights;
  Camera camera;
  IntegratorDescription integrator;
  std::vector<HemisphereNode> hemisphere_nodes;  ///< of IntegratorKind::gauss: one turn of samples
  FilmDescription film;

  FlatScene() = default;
  FlatScene(FlatScene&&) = default;
  FlatScene& operator=(FlatScene&&) = default;
  FlatScene(const FlatScene&) = delete;
  FlatScene& operator=(const FlatScene&) = delete;

  /// Valid while this object lives.
  SceneView view() const;
};

}  // namespace embrun

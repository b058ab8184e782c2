// The way from particles to a mesh that users of OpenVDB take, beside Embrun's: spheres into a level set, which is dilated,
// smoothed and eroded, and meshed. It is another surface than the field's (lumpier, and thinner where particles are few),
// so times and sizes are what can be compared. See README.md.

#include <fmt/core.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "io/read_particles.h"
#include "io/write_mesh.h"
#include "meshing/isosurface.h"

namespace {

using namespace embrun;

struct Options {
  std::string file = EMBRUN_DATA_DIR "/dam_break.bgeo", output;
  double radius = 0.025, spacing = 0.0465, cell = 0;
  double sphere = 0.87;  ///< of the spacing: spheres of half its diagonal leave no gaps in a lattice
  int smoothing = 3, threads = 1, order = 3;
};

/// Particles as OpenVDB's rasterizer asks for them.
struct ParticleList {
  using PosType = openvdb::Vec3R;
  const std::vector<Vec3d>& positions;
  double radius;

  std::size_t size() const { return positions.size(); }
  void getPos(std::size_t i, openvdb::Vec3R& p) const { p = {positions[i].x, positions[i].y, positions[i].z}; }
  void getPosRad(std::size_t i, openvdb::Vec3R& p, openvdb::Real& r) const {
    getPos(i, p);
    r = radius;
  }
};

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double timed(const char* stage, const std::function<void()>& work) {
  const double start = cpu_seconds();
  work();
  const double seconds = cpu_seconds() - start;
  fmt::print("  {:<28}{:>8.2f} s of CPU\n", stage, seconds);
  return seconds;
}

/// Quadrilaterals and triangles, clockwise from outside, as triangles.
TriangleMesh take_mesh(const openvdb::FloatGrid& grid) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0.0, 0.0);
  TriangleMesh mesh;
  for (const openvdb::Vec3s& p : points) mesh.positions.push_back({p.x(), p.y(), p.z()});
  for (const openvdb::Vec3I& t : triangles) mesh.triangles.push_back({t[0], t[2], t[1]});
  for (const openvdb::Vec4I& q : quads) {
    mesh.triangles.push_back({q[0], q[2], q[1]});
    mesh.triangles.push_back({q[0], q[3], q[2]});
  }
  return mesh;
}

TriangleMesh mesh_by_openvdb(const std::vector<Vec3d>& positions, const Options& o) {
  const double cell = o.cell > 0 ? o.cell : 0.5 * o.radius, sphere = o.sphere * o.spacing;
  const auto grid = openvdb::createLevelSet<openvdb::FloatGrid>(cell);
  timed("spheres to level set", [&] {
    openvdb::tools::ParticlesToLevelSet<openvdb::FloatGrid> raster(*grid);
    raster.rasterizeSpheres(ParticleList{positions, sphere});
    raster.finalize(true);
  });
  timed("dilate, smooth, erode", [&] {
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
    // As interactive tools have it: the defaults (WENO5, third-order Runge-Kutta) take several times as long.
    filter.setSpatialScheme(openvdb::math::FIRST_BIAS);
    filter.setTemporalScheme(openvdb::math::TVD_RK1);
    const auto dilation = static_cast<float>(cell);
    filter.offset(-dilation);
    for (int i = 0; i < o.smoothing; ++i) filter.mean(1);
    // A flat surface lies half a spacing outside the outermost particles.
    filter.offset(dilation + static_cast<float>(sphere - 0.5 * o.spacing));
  });
  TriangleMesh mesh;
  timed("mesh", [&] { mesh = take_mesh(*grid); });
  return mesh;
}

TriangleMesh mesh_by_embrun(const std::vector<Vec3d>& positions, const Options& o) {
  std::vector<Vec3> places;
  for (const Vec3d& p : positions) places.push_back(to_float(p));
  SurfaceSettings surface;
  surface.radius = static_cast<float>(o.radius);
  surface.spacing = o.spacing;
  surface.order = o.order;
  TriangleMesh mesh;
  timed("field and marching cubes", [&] {
    IsosurfaceSettings settings;
    settings.cell = static_cast<float>(o.cell);
    mesh = extract_isosurface(places, {}, resolve_surface_model(places, {}, surface), settings);
  });
  return mesh;
}

void describe(const TriangleMesh& mesh) {
  fmt::print("  {} triangles, {} pieces, volume {:.4f} m3, area {:.3f} m2\n", mesh.triangles.size(),
             component_count(mesh), enclosed_volume(mesh), surface_area(mesh));
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app{"Particles to a mesh by OpenVDB's level sets and by Embrun"};
  app.add_option("--data", o.file, "particle file")->capture_default_str();
  app.add_option("--radius", o.radius)->capture_default_str();
  app.add_option("--spacing", o.spacing)->capture_default_str();
  app.add_option("--cell", o.cell, "metres; default: half the radius");
  app.add_option("--sphere", o.sphere, "radius of the level set's spheres over the spacing")->capture_default_str();
  app.add_option("--smoothing", o.smoothing, "passes of a mean filter")->capture_default_str();
  app.add_option("--order", o.order, "of Embrun's")->capture_default_str();
  app.add_option("--threads", o.threads)->capture_default_str();
  app.add_option("--output", o.output, "write OpenVDB's mesh, .ply or .obj");
  CLI11_PARSE(app, argc, argv);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(o.threads));
  openvdb::initialize();
  const std::vector<Vec3d> positions = read_particles(o.file).positions;

  fmt::print("OpenVDB, {} particles\n", positions.size());
  const double start = cpu_seconds();
  const TriangleMesh mesh = mesh_by_openvdb(positions, o);
  const double openvdb_seconds = cpu_seconds() - start;
  describe(mesh);
  if (!o.output.empty()) write_mesh(o.output, mesh);
  fmt::print("Embrun, n = {}\n", o.order);
  const double middle = cpu_seconds();
  describe(mesh_by_embrun(positions, o));
  const double embrun_seconds = cpu_seconds() - middle;
  fmt::print("OpenVDB takes {:.2f} times as long\n", openvdb_seconds / embrun_seconds);
  return 0;
}

#include "render/fluid_meshes.h"

#include <chrono>
#include <utility>

#include "meshing/isosurface.h"

namespace embrun {

FluidMesher fluid_mesher(FluidMeshCounts* counts, std::function<void(double)> progress) {
  return [counts, progress = std::move(progress)](std::span<const Vec3> positions, std::span<const float> radii,
                                                  const FluidDescription& fluid) {
    const auto start = std::chrono::steady_clock::now();
    const SurfaceModel model = resolve_surface_model(positions, radii, fluid.surface);
    IsosurfaceSettings settings;
    settings.cell = static_cast<float>(fluid.mesh_cell);
    settings.progress = progress;
    TriangleMesh mesh = extract_isosurface(positions, radii, model, settings);
    if (counts == nullptr) return mesh;
    if (counts->vertices == 0) {
      counts->threshold = model.threshold;
      counts->influence_radius = model.influence_radius;
      counts->recovered = model.recovered.size();
    }
    counts->vertices += mesh.positions.size();
    counts->triangles += mesh.triangles.size();
    counts->seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return mesh;
  };
}

}  // namespace embrun

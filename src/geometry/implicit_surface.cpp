#include "geometry/implicit_surface.h"

#include "geometry/implicit_surface_storage.h"

namespace embrun {

ImplicitSurface::ImplicitSurface() = default;
ImplicitSurface::~ImplicitSurface() = default;
ImplicitSurface::ImplicitSurface(ImplicitSurface&&) noexcept = default;
ImplicitSurface& ImplicitSurface::operator=(ImplicitSurface&&) noexcept = default;
ImplicitSurface::ImplicitSurface(std::unique_ptr<Storage> storage) : storage_(std::move(storage)) {}

const ImplicitSurfaceView& ImplicitSurface::view() const { return storage_->view; }
const ImplicitSurfaceStats& ImplicitSurface::stats() const { return storage_->stats; }

}  // namespace embrun

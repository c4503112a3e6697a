// The host side of kernels/cl/rasterise_tetrahedra.cl.
#include "kernels/rasterise_tetrahedra.h"

#include "kernels/launch.h"

namespace kvx {
namespace {

cl_float4 SpacingOf(const Grid& grid) {
  return {{float(grid.spacing_mm.x()), float(grid.spacing_mm.y()), float(grid.spacing_mm.z()), 0.0f}};
}

}  // namespace

PosedBricks::PosedBricks(Backend& backend, const DeviceBody& body)
    : smooth(backend, size_t(body.bricks.s[3])),
      folded(backend, size_t(body.bricks.s[3])),
      box(backend, 2 * size_t(body.bricks.s[3])) {}

RasteriseTetrahedra::RasteriseTetrahedra(Backend& backend)
    : program_(backend.programs().Build("rasterise_tetrahedra.cl")) {}

void RasteriseTetrahedra::Classify(cl::CommandQueue& queue, const DeviceBody& body, const PosedNodes& posed,
                                   float volume_ratio, PosedBricks& out) const {
  if (body.bricks.s[3] == 0) return;
  cl::Kernel kernel(program_, "classify_bricks");
  SetArgs(kernel, body.brick_at.buffer(), body.bricks, body.first_nodes.buffer(), posed.buffer(),
          body.body.buffer(), volume_ratio, out.smooth.buffer(), out.folded.buffer(), out.box.buffer());
  Enqueue(queue, kernel, size_t(body.bricks.s[3]));
}

void RasteriseTetrahedra::operator()(cl::CommandQueue& queue, const DeviceBody& body, const PosedNodes& posed,
                                     const PosedBricks& bricks, const Grid& template_grid,
                                     const Grid& posed_grid, OwnerVolume& owner) const {
  owner.Fill(queue, 0xFFFFFFFFu);
  if (body.bricks.s[3] == 0) return;
  const float ratio = float(posed_grid.MmFromVox().determinant() / template_grid.MmFromVox().determinant());
  cl::Kernel kernel(program_, "rasterise_tetrahedra");
  SetArgs(kernel, body.brick_at.buffer(), body.bricks, body.first_nodes.buffer(), posed.buffer(),
          body.body.buffer(), body.carried.buffer(), body.closed.buffer(), bricks.smooth.buffer(), ratio,
          SpacingOf(posed_grid), SpacingOf(template_grid), ToCl(posed_grid).size, owner.buffer());
  Enqueue(queue, kernel, size_t(body.bricks.s[3]) * BrickedBody::kNodes);
}

}  // namespace kvx

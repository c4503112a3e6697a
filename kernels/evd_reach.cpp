// The host side of kernels/cl/evd_reach.cl.
#include "kernels/evd_reach.h"

#include "kernels/launch.h"

namespace kvx {

ReachingBricks::ReachingBricks(const Backend& backend, BufferCounts& counts)
    : nodes(backend, counts), cells(backend, counts), boxes(backend, counts), reaches(backend, counts) {}

EvdReach::EvdReach(Backend& backend) : program_(backend.programs().Build("evd_reach.cl")) {}

// One template voxel, as seen in the posed grid, and one posed voxel.
float EvdReach::Margin(const Grid& from, const Grid& to) {
  return 1.0f + float(from.spacing_mm.norm() / to.spacing_mm.minCoeff());
}

void EvdReach::operator()(cl::CommandQueue& queue, const BrickedBody& on_host, const DeviceBody& body,
                          const ForwardPose& pose, const Grid& from, const Grid& to, PosedNodes& posed,
                          ReachingBricks& out) const {
  out.host_nodes.clear(), out.host_cells.clear();
  out.needed.assign(size_t(body.stored), 0);
  if (body.stored > 0) {
    posed.Upload(queue, pose);
    out.boxes.Require(2 * size_t(body.stored));
    out.reaches.Require(size_t(body.stored));
    cl::Kernel bound(program_, "bound_bricks"), reach(program_, "reach_grid");
    SetArgs(bound, body.stored, body.first_nodes.buffer(), body.palette_first.buffer(), body.palette.buffer(),
            body.weight_ranges.buffer(), body.example_first.buffer(), body.example_refs.buffer(),
            body.example_ranges.buffer(), posed.coefficients.buffer(), pose.examples, posed.bones.buffer(),
            out.boxes.buffer());
    Enqueue(queue, bound, size_t(body.stored));
    const cl_int4 size{{to.size.x(), to.size.y(), to.size.z(), 0}};
    SetArgs(reach, body.brick_at.buffer(), body.bricks, body.first_nodes.buffer(), out.boxes.buffer(),
            Margin(from, to), size, out.reaches.buffer());
    Enqueue(queue, reach, size_t(body.bricks.s[3]));
  }
  out.reaches.Read(queue, size_t(body.bricks.s[3]), [&](std::span<const uint8_t> reaches) {
    for (size_t brick = 0; brick < reaches.size(); ++brick) {
      if (!reaches[brick]) continue;
      out.host_cells.push_back(int32_t(brick));
      const Eigen::Vector3i first = on_host.FirstNode(int(brick));
      for (int n = 0; n < 8; ++n)
        out.needed[size_t(on_host.BrickOf(first + 4 * Eigen::Vector3i(n & 1, (n >> 1) & 1, n >> 2)))] = 1;
    }
  });
  for (size_t brick = 0; brick < out.needed.size(); ++brick)
    if (out.needed[brick]) out.host_nodes.push_back(int32_t(brick));
  out.nodes.Upload(queue, out.host_nodes);
  out.cells.Upload(queue, out.host_cells);
  out.node_count = int(out.host_nodes.size()), out.cell_count = int(out.host_cells.size());
}

}  // namespace kvx

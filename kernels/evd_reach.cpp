// The host side of kernels/cl/evd_reach.cl.
#include "kernels/evd_reach.h"

#include <algorithm>
#include <cmath>

#include "core/blend.h"
#include "core/voxels/to_corner.h"
#include "kernels/device/launch.h"

namespace kvx {

namespace {

constexpr float kRounding = 0.01f;  // posed voxels

// What bones other than the prevailing one may weigh in all, w, so that no blend fades: (1 - 2 w)^3 is the
// least determinant then.
float SafeOthers() { return float(0.5 * (1 - std::cbrt(kRegularDeterminant))); }

// No brick that ends the body along an axis ends before these: of every brick some node of body lies in its
// box.
struct Ends {
  float least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY};
};

Ends InnermostEnds(const BrickedBody& body, std::span<const cl_float4> boxes) {
  Ends ends;
  for (size_t brick = 0; brick < body.body.size(); ++brick) {
    for (int a = 0; body.body[brick] && a < 3; ++a) {
      ends.least[a] = std::min(ends.least[a], boxes[2 * brick + 1].s[a]);
      ends.most[a] = std::max(ends.most[a], boxes[2 * brick].s[a]);
    }
  }
  return ends;
}

bool IsOutermost(const cl_float4* box, const Ends& ends) {
  bool outermost = false;
  for (int a = 0; a < 3; ++a) {
    outermost =
        outermost || box[0].s[a] <= ends.least[a] + kRounding || box[1].s[a] >= ends.most[a] - kRounding;
  }
  return outermost;
}

// A template voxel as seen in the posed grid.
float VoxelIn(const Grid& from, const Grid& to) {
  return float(from.spacing_mm.norm() / to.spacing_mm.minCoeff());
}

// The box of nodes 0..3 along an axis, three voxels shorter, is that of node 0: what each bone makes of these
// voxels, and of which end of the posed box it takes them.
std::vector<cl_float4> Narrower(const ForwardPose& pose) {
  std::vector<cl_float4> out;
  for (size_t bone = 0; bone < pose.bones.size(); bone += ForwardPose::kBoneRows) {
    for (const float sign : {-3.0f, 3.0f}) {
      for (int column = 0; column < 3; ++column) {
        cl_float4 less{{0, 0, 0, 0}};
        for (int r = 0; r < 3; ++r) less.s[r] = std::max(0.0f, sign * pose.bones[bone + size_t(r)].s[column]);
        out.push_back(less);
      }
    }
  }
  return out;
}

}  // namespace

ReachingBricks::ReachingBricks(const Backend& backend, BufferCounts& counts)
    : nodes(backend, counts),
      cells(backend, counts),
      boxes(backend, counts),
      bones(backend, counts),
      narrower(backend, counts),
      coefficients(backend, counts),
      reaches(backend, counts) {}

EvdReach::EvdReach(Backend& backend) : program_(backend.programs().Build("evd_reach.cl")) {}

float EvdReach::CutMargin(const Grid& from, const Grid& to) { return 1.0f + VoxelIn(from, to); }
// A brick claims 0.1 template voxels beyond its nodes and may be off by 0.16; tissue stretches.
float EvdReach::Margin(const Grid& from, const Grid& to) { return 0.1f + 0.3f * VoxelIn(from, to); }

void EvdReach::Bound(cl::CommandQueue& queue, const DeviceBody& body, const ForwardPose& pose,
                     ReachingBricks& out, const AddedNodes* added) const {
  out.bones.Upload(queue, pose.bones);
  out.narrower.Upload(queue, Narrower(pose));
  out.coefficients.Upload(queue, pose.coefficients);
  out.boxes.Require(2 * size_t(body.stored));
  if (body.stored == 0) return;
  cl::Kernel bound(program_, "bound_bricks");
  SetArgs(bound, body.stored, body.first_nodes.buffer(), body.palette_first.buffer(), body.palette.buffer(),
          body.weight_ranges.buffer(), body.example_first.buffer(), body.example_refs.buffer(),
          body.example_ranges.buffer(), out.coefficients.buffer(), pose.examples,
          added ? added->ranges.buffer() : out.coefficients.buffer(), int(added != nullptr),
          out.bones.buffer(), SafeOthers(), out.boxes.buffer());
  Enqueue(queue, bound, size_t(body.stored));
}

void EvdReach::Outermost(cl::CommandQueue& queue, const BrickedBody& on_host, ReachingBricks& out) const {
  out.host_nodes.clear();
  out.boxes.Read(queue, 2 * on_host.body.size(), [&](std::span<const cl_float4> boxes) {
    const Ends ends = InnermostEnds(on_host, boxes);
    for (size_t brick = 0; brick < on_host.body.size(); ++brick) {
      if (on_host.body[brick] && IsOutermost(&boxes[2 * brick], ends))
        out.host_nodes.push_back(int32_t(brick));
    }
  });
  out.nodes.Upload(queue, out.host_nodes);
  out.node_count = int(out.host_nodes.size());
}

void EvdReach::operator()(cl::CommandQueue& queue, const BrickedBody& on_host, const DeviceBody& body,
                          const Grid& template_grid, const Grid& posed_grid, ReachingBricks& out) const {
  out.host_nodes.clear(), out.host_cells.clear();
  out.needed.assign(size_t(body.stored), 0);
  if (body.stored > 0) {
    out.reaches.Require(size_t(body.stored));
    cl::Kernel reach(program_, "reach_grid");
    const Eigen::Matrix3d posed_from_template = posed_grid.VoxFromMm() * template_grid.MmFromVox();
    const Eigen::Vector3d origin = posed_grid.ToVox(template_grid.origin).ijk;
    const auto row = [&](int r) {
      return cl_float4{{float(posed_from_template(r, 0)), float(posed_from_template(r, 1)),
                        float(posed_from_template(r, 2)), float(origin[r])}};
    };
    const Eigen::Vector3i& size = posed_grid.size;
    SetArgs(reach, body.brick_at.buffer(), body.bricks, body.first_nodes.buffer(), body.cuts.buffer(),
            out.boxes.buffer(), out.narrower.buffer(), row(0), row(1), row(2),
            Margin(template_grid, posed_grid), CutMargin(template_grid, posed_grid),
            cl_int4{{size.x(), size.y(), size.z(), 0}}, out.reaches.buffer());
    Enqueue(queue, reach, size_t(body.bricks.s[3]));
  }
  out.reaches.Read(queue, size_t(body.bricks.s[3]), [&](std::span<const uint8_t> reaches) {
    for (size_t brick = 0; brick < reaches.size(); ++brick) {
      if (!reaches[brick]) continue;
      out.host_cells.push_back(int32_t(brick));
      const Eigen::Vector3i first = on_host.FirstNode(int(brick));
      for (int n = 0; n < 8; ++n) out.needed[size_t(on_host.BrickOf(first + 4 * ToCorner(n)))] = 1;
    }
  });
  for (size_t brick = 0; brick < out.needed.size(); ++brick)
    if (out.needed[brick]) out.host_nodes.push_back(int32_t(brick));
  out.nodes.Upload(queue, out.host_nodes);
  out.cells.Upload(queue, out.host_cells);
  out.node_count = int(out.host_nodes.size()), out.cell_count = int(out.host_cells.size());
}

}  // namespace kvx

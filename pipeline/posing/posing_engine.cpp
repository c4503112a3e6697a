// Forward map on the device, scan conversion, inverse sampling: one queue, one caller at a time.
#include "pipeline/posing/posing_engine.h"

#include <mutex>
#include <numeric>

#include "kernels/evd_forward.h"
#include "kernels/evd_inverse_sample.h"
#include "kernels/fill_gaps.h"
#include "kernels/rasterise_tetrahedra.h"
#include "pipeline/posing/brick_body.h"
#include "pipeline/posing/map_points.h"

namespace kvx {
namespace {

constexpr double kMostVoxels = 1e9;  // of a posed grid: beyond it the pose is a mistake

// Median of a sample of the voxels outside the body; the least value where there is nothing outside.
float AirOf(const Volume& volume, const BrickedBody& body) {
  std::vector<float> outside;
  for (size_t v = 0; v < volume.values.size(); v += 7) {
    if (!body.Bit(body.carried, volume.grid.Ijk(v))) outside.push_back(volume.values[v]);
  }
  if (outside.empty()) return *std::min_element(volume.values.begin(), volume.values.end());
  std::nth_element(outside.begin(), outside.begin() + outside.size() / 2, outside.end());
  return outside[outside.size() / 2];
}

struct Box {
  Eigen::Vector3d lo = Eigen::Vector3d::Constant(INFINITY), hi = Eigen::Vector3d::Constant(-INFINITY);
};

Box BodyBox(const BrickedBody& body) {
  Box box;
  for (int brick = 0; brick < body.stored(); ++brick) {
    for (int n = 0; n < BrickedBody::kNodes; ++n) {
      if (!((body.body[brick] >> n) & 1)) continue;
      const Eigen::Vector3d node = (body.FirstNode(brick) + BrickedBody::Offset(n)).cast<double>();
      box.lo = box.lo.cwiseMin(node), box.hi = box.hi.cwiseMax(node);
    }
  }
  return box;
}

int64_t ClosedCells(const BrickedBody& body) {
  int64_t count = 0;
  for (int brick = 0; brick < body.cell_bricks; ++brick) {
    for (int n = 0; n < BrickedBody::kNodes; ++n) {
      bool closed = true;
      for (int corner = 0; closed && corner < 8; ++corner) {
        const Eigen::Vector3i offset(corner & 1, (corner >> 1) & 1, corner >> 2);
        closed = body.Bit(body.body, body.FirstNode(brick) + BrickedBody::Offset(n) + offset);
      }
      count += closed;
    }
  }
  return count;
}

}  // namespace

struct PosingEngine::State {
  State(Backend& b, const PosingInputs& in)
      : backend(b),
        queue(b.NewQueue()),
        grid(in.template_scan.volume.grid),
        bricked(BrickBody(in)),
        mapper(bricked, grid),
        body_box(BodyBox(bricked)),
        closed_cells(ClosedCells(bricked)),
        air(AirOf(in.template_scan.volume, bricked)),
        device(b, bricked),
        posed(b, size_t(bricked.stored()) * BrickedBody::kNodes),
        bricks(b, device),
        image(b, std::span(in.template_scan.volume.values)),
        forward(b),
        rasterise(b),
        sample(b),
        fill(b) {
    if (in.bones.labels.values.size() == grid.VoxelCount()) {
      labels = DeviceBuffer<uint16_t>(b, std::span(in.bones.labels.values));
    }
  }

  // Leaves the posed nodes, in voxels of `to`, and their classes on the device.
  void Forward(const ResolvedPose& pose, const Grid& to);
  Grid Fitted(const ResolvedPose& pose);
  // Forward, then owners; returns the grid that was used.
  Grid Prepare(const ResolvedPose& pose, const std::optional<Grid>& asked, int level);
  double FoldedFraction();

  Backend& backend;
  cl::CommandQueue queue;
  const Grid grid;
  const BrickedBody bricked;
  const PointMapper mapper;
  const Box body_box;  // voxels
  const int64_t closed_cells;
  const float air;
  std::mutex mutex;  // guards the queue and the buffers below
  DeviceBody device;
  PosedNodes posed;
  PosedBricks bricks;
  OwnerVolume owner;
  DeviceBuffer<float> image, posed_image;
  DeviceBuffer<uint16_t> labels;
  EvdForward forward;
  RasteriseTetrahedra rasterise;
  EvdInverseSample sample;
  FillGaps fill;
};

void PosingEngine::State::Forward(const ResolvedPose& pose, const Grid& to) {
  const ForwardPose prepared(grid, to, pose.scan_from_template, pose.coefficients, bricked.example_scales);
  if (device.stored == 0) return;
  forward(queue, device, prepared, posed);
  rasterise.Classify(queue, device, posed, prepared.volume_ratio, bricks);
}

// The template's margins around the posed body's box, on the template's lattice: the identity gives the
// template's grid.
Grid PosingEngine::State::Fitted(const ResolvedPose& pose) {
  Forward(pose, grid);
  Box box;
  for (const cl_float4& corner : device.stored ? bricks.box.Download(queue) : std::vector<cl_float4>{}) {
    const Eigen::Vector3d p(corner.s[0], corner.s[1], corner.s[2]);
    if (!p.allFinite()) continue;  // a brick without body
    box.lo = box.lo.cwiseMin(p), box.hi = box.hi.cwiseMax(p);
  }
  if (!(box.lo.array() <= box.hi.array()).all()) return grid;
  constexpr double kRounding = 1e-3;
  const Eigen::Vector3d lo = (box.lo - body_box.lo).array() + kRounding,
                        hi = (box.hi - body_box.hi).array() - kRounding;
  const Eigen::Vector3d first = lo.array().floor(),
                        last = hi.array().ceil() + (grid.size.array() - 1).cast<double>();
  const Eigen::Vector3d size = last - first + Eigen::Vector3d::Ones();
  if (!(size.prod() <= kMostVoxels))
    throw InputError("the pose spreads the body too far for one volume; check the bone transforms");
  Grid fitted = grid;
  fitted.origin = grid.ToMm(PointVox{first});
  fitted.size = size.cwiseMax(1.0).cast<int>();
  return fitted;
}

Grid PosingEngine::State::Prepare(const ResolvedPose& pose, const std::optional<Grid>& asked, int level) {
  const Grid full = asked ? *asked : Fitted(pose);
  Validate(full);
  if (!(double(full.size.x()) * full.size.y() * full.size.z() <= kMostVoxels)) {
    throw InputError("the grid asked for has too many voxels");
  }
  const Grid to = level > 0 ? Coarsened(full, 1 << level) : full;
  if (asked || level > 0)
    Forward(pose, to);
  else
    forward.Shift(queue, device, -grid.ToVox(to.origin).ijk.array().round().matrix(),
                  posed);  // Fitted has been forward
  if (owner.size() != to.VoxelCount()) owner = OwnerVolume(backend, to.VoxelCount());
  rasterise(queue, device, posed, bricks, grid, to, owner);
  return to;
}

double PosingEngine::State::FoldedFraction() {
  if (closed_cells == 0) return 0;
  const std::vector<int32_t> folded = bricks.folded.Download(queue);
  return double(std::accumulate(folded.begin(), folded.end(), int64_t(0))) / double(closed_cells);
}

PosingEngine::PosingEngine(Backend& backend, const PosingInputs& inputs)
    : state_(std::make_unique<State>(backend, inputs)) {}
PosingEngine::~PosingEngine() = default;

Grid PosingEngine::FittedGrid(const ResolvedPose& pose, int level) const {
  const std::lock_guard lock(state_->mutex);
  const Grid fitted = state_->Fitted(pose);
  return level > 0 ? Coarsened(fitted, 1 << level) : fitted;
}

PosedVolume PosingEngine::Pose(const ResolvedPose& pose, const std::optional<Grid>& grid, int level) const {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  PosedVolume out;
  out.volume = Volume(s.Prepare(pose, grid, level));
  const Grid& to = out.volume.grid;
  if (s.posed_image.size() != to.VoxelCount())
    s.posed_image = DeviceBuffer<float>(s.backend, to.VoxelCount());
  s.sample.Intensities(s.queue, s.device, s.posed, s.owner, to, s.image, s.grid, s.air, s.posed_image);
  s.fill(s.queue, s.owner, to, s.air, s.posed_image);
  s.posed_image.Download(s.queue, out.volume.values);
  out.folded_fraction = s.FoldedFraction();
  return out;
}

LabelMap PosingEngine::PoseLabels(const ResolvedPose& pose, const std::optional<Grid>& grid,
                                  int level) const {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  LabelMap out(s.Prepare(pose, grid, level));
  if (s.labels.size() == 0) return out;
  DeviceBuffer<uint16_t> posed(s.backend, out.values.size());
  s.sample.Labels(s.queue, s.device, s.posed, s.owner, out.grid, s.labels, s.grid, posed);
  posed.Download(s.queue, out.values);
  return out;
}

std::vector<PointMm> PosingEngine::MapPoints(const ResolvedPose& pose,
                                             const std::vector<PointMm>& in_template) const {
  std::vector<PointMm> posed;
  posed.reserve(in_template.size());
  for (const PointMm& x : in_template) posed.push_back(state_->mapper(pose, x));
  return posed;
}

}  // namespace kvx

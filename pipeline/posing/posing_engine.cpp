// Forward map on the device, cells, inverse sampling: one queue, one caller at a time.
#include "pipeline/posing/posing_engine.h"

#include <mutex>
#include <numeric>
#include <stdexcept>

#include "core/errors.h"
#include "core/host/fair_mutex.h"
#include "kernels/evd_pull.h"
#include "kernels/evd_reach.h"
#include "kernels/pyramid.h"
#include "pipeline/posing/body_facts.h"
#include "pipeline/posing/brick_body.h"
#include "pipeline/posing/label_levels.h"
#include "pipeline/posing/map_points.h"

namespace kvx {
namespace {

constexpr double kLargePart = 0.4;  // of the template's volume: below it, finding what a grid needs pays
constexpr size_t kGridsKept = 4;    // of the template's size: what larger poses needed is given back

double VolumeMm3(const Grid& grid) { return double(grid.VoxelCount()) * grid.spacing_mm.prod(); }

std::vector<int32_t> FirstNumbers(int count) {
  std::vector<int32_t> numbers(static_cast<size_t>(count));
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

}  // namespace

struct PosingEngine::State {
  State(Backend& b, const Volume& volume, const LabelMap& bone_labels,
        std::shared_ptr<const BrickedBody> body, ElasticAddition elastic, double voxels)
      : backend(b),
        most_voxels(voxels),
        elastic_addition(std::move(elastic)),
        queue(b.NewQueue()),
        grid(volume.grid),
        bricked_there(std::move(body)),
        bricked(*bricked_there),
        mapper(bricked, grid),
        body_box(BodyBox(bricked)),
        closed_cells(ClosedCells(bricked)),
        air(AirOf(volume, bricked)),
        device(b, bricked),
        every_brick(b, FirstNumbers(bricked.stored())),
        image(b, std::span(volume.values)),
        posed(b, counts),
        added_nodes(b, counts),
        cells(b, counts),
        reaching(b, counts),
        reach(b),
        forward(b),
        cut(b),
        pull(b),
        pyramid(b) {
    if (bone_labels.values.size() == grid.VoxelCount())
      labels = DeviceBuffer<uint16_t>(b, std::span(bone_labels.values));
    for (int n = 0; n < 2; ++n) scratch.emplace_back(b, counts);
  }

  struct Asked {
    const ResolvedPose& pose;
    std::shared_ptr<const AddedDisplacement> added;  // if it is elastic
  };
  // Before the lock is taken: it may take long, and others need not wait for it.
  Asked Ask(const ResolvedPose& pose) const { return {pose, AddedTo(pose)}; }
  std::shared_ptr<const AddedDisplacement> AddedTo(const ResolvedPose& pose) const;
  // At the nodes; nullptr: nothing.
  const AddedNodes* AddedNodesOf(const Asked& asked);
  void Bound(const Asked& asked);
  void Forward(const Asked& asked, const Grid& to);
  VoxelExtent PosedBox(size_t bricks);
  Grid GridAround(const VoxelExtent& box) const;
  Grid Fitted(const Asked& asked);
  Grid FittedAlone(const Asked& asked);
  // The same, remembered.
  Grid FittedAgain(const Asked& asked);
  // Forward, then the cells of every tile; returns the grid that was used.
  Grid Prepare(const Asked& asked, const std::optional<Grid>& grid_asked, int level);
  double FoldedFraction() const { return closed_cells ? double(cells.folded) / double(closed_cells) : 0; }
  void Intensities(const Grid& to, Sampling sampling, const cl::Buffer& out);
  void Halve(const Grid& full, int level, std::span<float> out);
  const DeviceBuffer<float>& Levels();  // of the labels

  Backend& backend;
  const double most_voxels;
  const ElasticAddition elastic_addition;
  cl::CommandQueue queue;
  const Grid grid;
  const std::shared_ptr<const BrickedBody> bricked_there;
  const BrickedBody& bricked;
  const PointMapper mapper;
  const VoxelExtent body_box;
  const int64_t closed_cells;
  const float air;
  const cl::Buffer* listed = nullptr;  // bricks whose cells are cut, and how many
  int listed_cells = 0;
  FairMutex mutex;  // guards the queue and the buffers below
  BufferCounts counts;
  DeviceBody device;
  DeviceBuffer<int32_t> every_brick;  // those with cells come first
  DeviceBuffer<float> image;
  DeviceBuffer<uint16_t> labels;
  DeviceBuffer<float> levels;  // of `labels`, once they are asked for
  PosedNodes posed;
  AddedNodes added_nodes;
  std::shared_ptr<const AddedDisplacement> added;  // whose nodes they are
  PosedCells cells;
  ReachingBricks reaching;
  EvdReach reach;
  std::optional<EvdAdded> add;  // made for the first elastic pose
  std::vector<PooledBuffer<float>> scratch;
  // A viewer looks at one pose from many sides: what was bounded last, and its fitted grid.
  std::optional<ResolvedPose> bounded;
  std::optional<Grid> bounded_fitted;
  EvdForward forward;
  EvdCells cut;
  EvdPull pull;
  Pyramid pyramid;
};

// Found when labels are first posed: it takes as long as several poses.
const DeviceBuffer<float>& PosingEngine::State::Levels() {
  if (levels.size() == 0) {
    LabelMap in_template(grid);
    labels.Download(queue, in_template.values);
    levels = DeviceBuffer<float>(backend, std::span<const float>(LabelLevels(in_template)));
  }
  return levels;
}

std::shared_ptr<const AddedDisplacement> PosingEngine::State::AddedTo(const ResolvedPose& pose) const {
  if (!pose.elastic) return nullptr;
  if (!elastic_addition) throw std::logic_error("a posing engine does not know how tissue comes to rest");
  return elastic_addition(pose);
}

const AddedNodes* PosingEngine::State::AddedNodesOf(const Asked& asked) {
  if (!asked.added) return nullptr;
  if (asked.added != added) {
    added.reset();
    if (!add) add.emplace(backend);
    (*add)(queue, device, *asked.added, labels, grid.size, added_nodes);
    added = asked.added;
  }
  return &added_nodes;
}

// The boxes of all bricks on the template's grid, unless they are there.
void PosingEngine::State::Bound(const Asked& asked) {
  const ResolvedPose& pose = asked.pose;
  if (bounded && IsSame(*bounded, pose)) return;
  bounded.reset(), bounded_fitted.reset();
  reach.Bound(queue, device, ForwardPose(grid, grid, pose.scan_from_template, pose.coefficients), reaching,
              AddedNodesOf(asked));
  bounded = pose;
}

// Poses what `to` needs; sets which bricks' cells to cut.
void PosingEngine::State::Forward(const Asked& asked, const Grid& to) {
  const ResolvedPose& pose = asked.pose;
  const ForwardPose prepared(grid, to, pose.scan_from_template, pose.coefficients);
  const AddedNodes* to_add = AddedNodesOf(asked);
  if (VolumeMm3(to) > kLargePart * VolumeMm3(grid)) {
    forward(queue, device, every_brick.buffer(), device.stored, prepared, posed, to_add);
    listed = &every_brick.buffer(), listed_cells = device.bricks.s[3];
  } else {
    Bound(asked);
    reach(queue, bricked, device, grid, to, reaching);
    forward(queue, device, reaching.nodes.buffer(), reaching.node_count, prepared, posed, to_add);
    listed = &reaching.cells.buffer(), listed_cells = reaching.cell_count;
  }
}

// Around the body nodes of the first `bricks` that were posed last.
VoxelExtent PosingEngine::State::PosedBox(size_t bricks) {
  VoxelExtent box;
  posed.body_boxes.Read(queue, 2 * bricks, [&](std::span<const cl_float4> corners) {
    for (const cl_float4& corner : corners) {
      const Eigen::Vector3d p(corner.s[0], corner.s[1], corner.s[2]);
      if (!p.allFinite()) continue;  // a brick without body
      box.lo = box.lo.cwiseMin(p), box.hi = box.hi.cwiseMax(p);
    }
  });
  return box;
}

// The template's margins around the posed body's box, on the template's lattice: the identity gives the
// template's grid.
Grid PosingEngine::State::GridAround(const VoxelExtent& box) const {
  if (!(box.lo.array() <= box.hi.array()).all()) return grid;
  constexpr double kRounding = 1e-3;
  const Eigen::Vector3d lo = (box.lo - body_box.lo).array() + kRounding,
                        hi = (box.hi - body_box.hi).array() - kRounding;
  const Eigen::Vector3d first = lo.array().floor(),
                        last = hi.array().ceil() + (grid.size.array() - 1).cast<double>();
  const Eigen::Vector3d size = last - first + Eigen::Vector3d::Ones();
  if (!(size.prod() <= most_voxels))
    throw InputError("the pose spreads the body too far for one volume; check the bone transforms");
  Grid fitted = grid;
  fitted.origin = grid.ToMm(PointVox{first});
  fitted.size = size.cwiseMax(1.0).cast<int>();
  return fitted;
}

// Poses everything on the template's grid.
Grid PosingEngine::State::Fitted(const Asked& asked) {
  Forward(asked, grid);
  return GridAround(PosedBox(size_t(device.stored)));
}

// The same grid, and only what ends the body is posed.
Grid PosingEngine::State::FittedAlone(const Asked& asked) {
  const ResolvedPose& pose = asked.pose;
  const ForwardPose prepared(grid, grid, pose.scan_from_template, pose.coefficients);
  const AddedNodes* to_add = AddedNodesOf(asked);
  Bound(asked);
  reach.Outermost(queue, bricked, reaching);
  forward(queue, device, reaching.nodes.buffer(), reaching.node_count, prepared, posed, to_add);
  return GridAround(PosedBox(size_t(reaching.node_count)));
}

Grid PosingEngine::State::FittedAgain(const Asked& asked) {
  Bound(asked);
  if (!bounded_fitted) bounded_fitted = FittedAlone(asked);
  return *bounded_fitted;
}

Grid PosingEngine::State::Prepare(const Asked& asked, const std::optional<Grid>& grid_asked, int level) {
  const Grid full = grid_asked ? *grid_asked : Fitted(asked);
  Validate(full);
  if (!(full.size.cast<double>().prod() <= most_voxels))
    throw InputError("the grid asked for has too many voxels; make it smaller or its voxels larger");
  const Grid to = level > 0 ? Coarsened(full, 1 << level) : full;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  if (grid_asked || level > 0)
    Forward(asked, to);
  else
    shift = -grid.ToVox(to.origin).ijk.array().round();  // Fitted has been forward, on the template's grid
  cut(queue, device, *listed, listed_cells, posed, asked.pose.scan_from_template, shift, grid, to, cells);
  return to;
}

void PosingEngine::State::Intensities(const Grid& to, Sampling sampling, const cl::Buffer& out) {
  pull.Intensities(queue, device, *listed, cells, to, image, grid, sampling, air, out);
}

// From scratch[0], a volume on `full`, by means of 2 x 2 x 2 voxels.
void PosingEngine::State::Halve(const Grid& full, int level, std::span<float> out) {
  Grid at = full;
  for (int l = 0; l < level; ++l) {  // there and back: what is wide stays wide for the next pose
    const Grid half = Coarsened(at, 2);
    auto &from = scratch[l % 2], &to = scratch[(l + 1) % 2];
    to.Require(half.VoxelCount());
    pyramid.Halve(queue, from.buffer(), at, to.buffer());
    at = half;
  }
  queue.enqueueReadBuffer(scratch[level % 2].buffer(), CL_TRUE, 0, out.size_bytes(), out.data());
}

PosingEngine::PosingEngine(Backend& backend, const PosingInputs& inputs, double most_voxels)
    : PosingEngine(backend, inputs.template_scan, inputs.bones.labels,
                   std::make_shared<const BrickedBody>(BrickBody(inputs)), {}, most_voxels) {}
PosingEngine::PosingEngine(Backend& backend, const Scan& template_scan, const LabelMap& labels,
                           std::shared_ptr<const BrickedBody> body, ElasticAddition elastic_addition,
                           double most_voxels)
    : state_(std::make_unique<State>(backend, template_scan.volume, labels, std::move(body),
                                     std::move(elastic_addition), most_voxels)) {}
PosingEngine::~PosingEngine() = default;

float PosingEngine::air() const { return state_->air; }
double PosingEngine::most_voxels() const { return state_->most_voxels; }
int64_t PosingEngine::allocations() const { return state_->counts.allocations; }

Grid PosingEngine::FittedGrid(const ResolvedPose& pose, int level) const {
  const State::Asked asked = state_->Ask(pose);
  const std::lock_guard lock(state_->mutex);
  const Grid fitted = state_->FittedAgain(asked);
  return level > 0 ? Coarsened(fitted, 1 << level) : fitted;
}

PosedVolume PosingEngine::Pose(const ResolvedPose& pose, const std::optional<Grid>& grid, int level,
                               Sampling sampling) const {
  PosedVolume out;
  PoseInto(out, pose, grid, level, sampling);
  return out;
}

void PosingEngine::PoseInto(PosedVolume& out, const ResolvedPose& pose, const std::optional<Grid>& grid,
                            int level, Sampling sampling) const {
  State& s = *state_;
  const State::Asked asked = s.Ask(pose);
  const std::lock_guard lock(s.mutex);
  const Grid full = s.Prepare(asked, grid, 0);
  out.volume.grid = level > 0 ? Coarsened(full, 1 << level) : full;
  out.volume.values.resize(out.volume.grid.VoxelCount());
  out.folded_fraction = s.FoldedFraction();
  if (level == 0 && s.backend.is_cpu()) {  // straight into the caller's memory
    const size_t bytes = out.volume.values.size() * sizeof(float);
    const cl::Buffer there(s.backend.context(), CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, bytes,
                           out.volume.values.data());
    const FinishedQueue finished(s.queue);
    s.Intensities(full, sampling, there);
    MappedMemory(s.queue, there, CL_MAP_READ, bytes).Unmap();
    return;
  }
  s.scratch[0].Require(full.VoxelCount());
  s.Intensities(full, sampling, s.scratch[0].buffer());
  s.Halve(full, level, out.volume.values);
  for (PooledBuffer<float>& buffer : s.scratch) buffer.GiveBackBeyond(kGridsKept * s.grid.VoxelCount());
}

LabelMap PosingEngine::PoseLabels(const ResolvedPose& pose, const std::optional<Grid>& grid,
                                  int level) const {
  State& s = *state_;
  const State::Asked asked = s.Ask(pose);
  const std::lock_guard lock(s.mutex);
  LabelMap out(s.Prepare(asked, grid, level));
  if (s.labels.size() == 0) return out;
  const DeviceBuffer<uint16_t> posed(s.backend, out.values.size());
  s.pull.Labels(s.queue, s.device, *s.listed, s.cells, out.grid, s.labels, s.Levels(), s.grid,
                posed.buffer());
  posed.Download(s.queue, out.values);
  return out;
}

PlaceField PosingEngine::InversePlaces(const ResolvedPose& pose, const Grid& grid) const {
  State& s = *state_;
  const State::Asked asked = s.Ask(pose);
  const std::lock_guard lock(s.mutex);
  PlaceField out(s.Prepare(asked, grid, 0), Eigen::Vector3f::Constant(NAN));
  s.scratch[0].Require(4 * out.values.size());
  s.pull.Places(s.queue, s.device, *s.listed, s.cells, out.grid, s.scratch[0].buffer());
  const Eigen::Matrix3d mm_from_vox = s.grid.MmFromVox();
  s.scratch[0].Read(s.queue, 4 * out.values.size(), [&](std::span<const float> found) {
    for (size_t v = 0; v < out.values.size(); ++v) {
      const Eigen::Vector3d place(found[4 * v], found[4 * v + 1], found[4 * v + 2]);
      out.values[v] = (s.grid.origin.lps + mm_from_vox * place).cast<float>();
    }
  });
  return out;
}

std::vector<PointMm> PosingEngine::MapPoints(const ResolvedPose& pose,
                                             const std::vector<PointMm>& in_template) const {
  std::vector<PointMm> posed;
  posed.reserve(in_template.size());
  const auto added = state_->AddedTo(pose);
  for (const PointMm& x : in_template) posed.push_back(state_->mapper(pose, x, added.get()));
  return posed;
}

}  // namespace kvx

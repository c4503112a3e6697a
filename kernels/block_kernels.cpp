// The host side of block_moments.cl, block_equations.cl, block_steps.cl, wide_cells.cl and level_state.cl.
#include "kernels/block_kernels.h"

#include <utility>

#include "core/host/parallel.h"
#include "core/voxels/cubic_spline.h"
#include "kernels/device/launch.h"

namespace kvx {
namespace {

constexpr size_t kEquationParts = 3;  // as in block_equations.cl
constexpr size_t kLanes = 32;         // where work-items run in step
constexpr size_t kPairs = 40;         // phi_a phi_b, a <= b, and zeros

cl_int4 ToCl(const Eigen::Vector3i& v) { return {{v.x(), v.y(), v.z(), 0}}; }
cl_float4 ToCl(const Eigen::Vector3d& v) { return {{float(v.x()), float(v.y()), float(v.z()), 0}}; }

// Gone from the host on return.
DeviceBuffer<FieldVector> HandedOver(Backend& backend, std::vector<FieldVector> field) {
  return {backend, std::span<const FieldVector>(field)};
}

// Of the spline through an image, with one voxel more on every side: then all taps are there.
std::vector<float> SplineWithMargin(const Volume& image) {
  const Volume inner = SplineCoefficients(image);
  const Eigen::Vector3i& size = inner.grid.size;
  const Eigen::Vector3i wide = size.array() + 2;
  std::vector<float> out(size_t(wide.x()) * wide.y() * wide.z());
  ParallelEach(size_t(wide.y()) * wide.z(), [&](size_t line) {
    const int j = MirroredVoxel(int(line % wide.y()) - 1, size.y());
    const int k = MirroredVoxel(int(line / wide.y()) - 1, size.z());
    for (int i = 0; i < wide.x(); ++i) out[line * wide.x() + i] = inner(MirroredVoxel(i - 1, size.x()), j, k);
  });
  return out;
}

// As block_equations.cl takes them.
std::vector<float> PairsOf(const BallBasis& ball) {
  std::vector<float> out(kPairs * ball.cell_basis.size(), 0.0f);
  for (size_t c = 0; c < ball.cell_basis.size(); ++c) {
    float* to = &out[kPairs * c];
    for (int a = 0; a < kControlPoints; ++a) {
      for (int b = a; b < kControlPoints; ++b) *to++ = ball.cell_basis[c][a] * ball.cell_basis[c][b];
    }
  }
  return out;
}

// Of cells that lie `spacing_mm` apart.
Eigen::Vector3d InverseSquared(const Eigen::Vector3d& spacing_mm) {
  return spacing_mm.cwiseAbs2().cwiseInverse();
}

// Those that hold an active cell, increasing.
std::vector<cl_int> ActiveWide(const Grid& cells, std::span<const cl_int> active) {
  const Grid wide = Coarsened(cells, 2);
  std::vector<uint8_t> holds(wide.VoxelCount());
  for (const cl_int c : active) {
    const Eigen::Vector3i p = cells.Ijk(size_t(c)) / 2;
    holds[wide.Index(p.x(), p.y(), p.z())] = 1;
  }
  std::vector<cl_int> out;
  for (size_t n = 0; n < holds.size(); ++n)
    if (holds[n]) out.push_back(cl_int(n));
  return out;
}

// Halves the lanes until the device can have the work-items of a block in one group.
cl::Program EquationsProgram(Backend& backend, size_t& lanes) {
  while (true) {
    const cl::Program program =
        backend.programs().Build("block_equations.cl", {{"LANES", std::to_string(lanes)}});
    const size_t most = MostItems(cl::Kernel(program, "block_equations"), backend.device());
    if (lanes == 1 || kEquationParts * lanes <= most) return program;
    lanes /= 2;
  }
}

}  // namespace

BlockKernels::Cells BlockKernels::MakeCells(Backend& backend, const Grid& grid, DeviceBuffer<cl_int> active,
                                            DeviceBuffer<float> mobility, DeviceBuffer<float> stiffness) {
  const size_t count = grid.VoxelCount();
  Cells out{grid.size,           grid.spacing_mm,      std::move(active),
            {backend, count},    {backend, count},     {backend, count},
            std::move(mobility), std::move(stiffness), {backend, kMomentChannels * count},
            {backend, count},    {backend, count}};
  auto& queue = backend.queue();
  out.moments.Fill(queue, 0.0f);
  for (auto* buffer : {&out.field, &out.steps, &out.curvature}) buffer->Fill(queue, FieldVector::Zero());
  out.sums.Fill(queue, Sums8{});
  return out;
}

BlockKernels::Cells BlockKernels::MakeWide() const {
  const Grid cells = Coarsened(grid_, 2);
  const auto means = [&](const DeviceBuffer<float>& values) {
    return DeviceBuffer<float>(backend_,
                               std::span<const float>(CellMeans(cells, values.Download(backend_.queue()))));
  };
  const std::vector<cl_int> active = ActiveWide(cells, cells_.active.Download(backend_.queue()));
  return MakeCells(backend_, Coarsened(cells, 2), {backend_, std::span<const cl_int>(active)},
                   means(cells_.mobility), means(cells_.stiffness));
}

BlockKernels::Cells& BlockKernels::Wide() {
  if (!wide_) wide_ = MakeWide();
  return *wide_;
}

BlockKernels::BlockKernels(Backend& backend, const BlockLevel& level, const BallBasis& ball,
                           std::vector<FieldVector> field, int lanes)
    : backend_(backend),
      lanes_(lanes > 0          ? size_t(lanes)
             : backend.is_cpu() ? 1
                                : kLanes),
      moments_program_(backend.programs().Build("block_moments.cl")),
      equations_program_(EquationsProgram(backend, lanes_)),
      steps_program_(backend.programs().Build("block_steps.cl")),
      state_program_(backend.programs().Build("level_state.cl")),
      wide_program_(backend.programs().Build("wide_cells.cl")),
      grid_(level.grid),
      scan_size_(level.scan.grid.size),
      bending_(float(level.bending)),
      visible_(DeviceBuffer<cl_int>::Shared(backend, level.visible)),
      start_(DeviceBuffer<FieldVector>::Shared(backend, level.start)),
      field_(HandedOver(backend, std::move(field))),
      trial_(backend, level.grid.VoxelCount()),
      intensity_(DeviceBuffer<float>::Shared(backend, level.intensity)),
      weight_(DeviceBuffer<float>::Shared(backend, level.weight)),
      mobility_(DeviceBuffer<float>::Shared(backend, level.mobility)),
      scan_(backend, std::span<const float>(SplineWithMargin(level.scan))),
      seen_(backend, level.grid.VoxelCount()),
      seen_trial_(backend, level.grid.VoxelCount()),
      cells_(MakeCells(backend, Coarsened(level.grid, 2), DeviceBuffer<cl_int>::Shared(backend, level.active),
                       {backend, std::span<const float>(CellMeans(level.grid, level.mobility))},
                       DeviceBuffer<float>::Shared(backend, level.stiffness))),
      sums_trial_(backend, level.stiffness.size()),
      ball_cells_(backend, std::span(ball.cells)),
      voxels_(backend, std::span(ball.voxels)),
      cell_basis_(backend, std::span(ball.cell_basis)),
      basis_pairs_(backend, std::span<const float>(PairsOf(ball))),
      changed_(backend, level.stiffness.size()) {
  auto& queue = backend_.queue();
  seen_.Fill(queue, kUnseen);
  seen_trial_.Fill(queue, kUnseen);
  trial_.Copy(queue, field_);  // what is not active is never written
  sums_trial_.Fill(queue, Sums8{});
}

std::vector<FieldVector> BlockKernels::Field() const { return field_.Download(backend_.queue()); }

std::vector<FieldVector> BlockKernels::TakeField() {
  cells_ = {};
  wide_.reset();
  trial_ = {};
  for (auto* buffer : {&seen_, &seen_trial_}) *buffer = {};
  sums_trial_ = {};
  return Field();
}

void BlockKernels::See(const DeviceBuffer<FieldVector>& field, const DeviceBuffer<float>& seen) {
  cl::Kernel kernel(state_program_, "see");
  SetArgs(kernel, visible_.buffer(), cl_int(visible_.size()), ToCl(cells_.size), kvx::ToCl(grid_),
          start_.buffer(), field.buffer(), scan_.buffer(), ToCl(scan_size_), changed_.buffer(),
          cl_int(has_trial_), seen_.buffer(), seen.buffer());
  Enqueue(backend_.queue(), kernel, visible_.size());
}

void BlockKernels::SeeField() {
  if (std::exchange(seen_fresh_, true)) return;
  changed_.Fill(backend_.queue(), 1);
  See(field_, seen_);
}

std::vector<float> BlockKernels::Seen() {
  SeeField();
  return seen_.Download(backend_.queue());
}

void BlockKernels::SetTargets(std::span<const float> targets, std::span<const float> weights) {
  targets_ = {backend_, targets};
  weight_ = {backend_, weights};
}

void BlockKernels::Linearise() {
  auto& queue = backend_.queue();
  SeeField();
  has_trial_ = tried_ = cells_.curvature_fresh = false;
  cells_.touched.Fill(queue, 0);
  cl::Kernel moments(moments_program_, "cell_moments");
  SetArgs(moments, visible_.buffer(), cl_int(visible_.size()), ToCl(cells_.size), kvx::ToCl(grid_),
          seen_.buffer(), intensity_.buffer(), Targets().buffer(), weight_.buffer(), mobility_.buffer(),
          cells_.moments.buffer(), cells_.sums.buffer());
  Enqueue(queue, moments, visible_.size());
  cells_.field.Fill(queue, FieldVector::Zero());  // steps went beyond the active cells, too
  cl::Kernel cell_field(state_program_, "cell_field");
  SetArgs(cell_field, cells_.active.buffer(), cl_int(cells_.active.size()), ToCl(cells_.size),
          ToCl(grid_.size), field_.buffer(), cells_.field.buffer());
  Enqueue(queue, cell_field, cells_.active.size());
  cells_.steps.Fill(queue, FieldVector::Zero());
}

void BlockKernels::Restrict() {
  Cells& wide = Wide();
  const size_t count = size_t(wide.size.prod());
  cl::Kernel kernel(wide_program_, "restrict_cells");
  SetArgs(kernel, cl_int(count), ToCl(wide.size), ToCl(cells_.size), cells_.moments.buffer(),
          cells_.field.buffer(), wide.moments.buffer(), wide.field.buffer());
  Enqueue(backend_.queue(), kernel, count);
  wide.steps.Fill(backend_.queue(), FieldVector::Zero());
  wide.curvature_fresh = false;
}

void BlockKernels::Prolong() {
  const Cells& wide = Wide();
  tried_ = cells_.curvature_fresh = false;
  const size_t count = size_t(cells_.size.prod());
  cl::Kernel kernel(wide_program_, "prolong_steps");
  SetArgs(kernel, cl_int(count), ToCl(wide.size), ToCl(cells_.size), wide.steps.buffer(),
          cells_.mobility.buffer(), cells_.moments.buffer(), cells_.steps.buffer(), cells_.field.buffer(),
          cells_.touched.buffer());
  Enqueue(backend_.queue(), kernel, count);
}

void BlockKernels::RefreshCurvature(Cells& cells) {
  if (std::exchange(cells.curvature_fresh, true)) return;
  cl::Kernel kernel(state_program_, "cell_curvature");
  SetArgs(kernel, cells.active.buffer(), cl_int(cells.active.size()), ToCl(cells.size), cells.field.buffer(),
          cells.stiffness.buffer(), ToCl(InverseSquared(cells.spacing_mm)), cells.curvature.buffer());
  Enqueue(backend_.queue(), kernel, cells.active.size());
}

std::vector<float> BlockKernels::Equations(std::span<const cl_int4> blocks, BlockWidth width) {
  Cells& cells = Of(width);
  RefreshCurvature(cells);
  const Eigen::Vector3d bend = bending_ * cells.spacing_mm.prod() * InverseSquared(cells.spacing_mm);
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<float> result(backend_, blocks.size() * kEquationValues);
  cl::Kernel kernel(equations_program_, "block_equations");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), ball_cells_.buffer(), cl_int(ball_cells_.size()),
          ToCl(cells.size), cells.moments.buffer(), cells.curvature.buffer(), ToCl(bend),
          cells.mobility.buffer(), cell_basis_.buffer(), basis_pairs_.buffer(), result.buffer());
  const size_t items = blocks.size() * kEquationParts * lanes_;
  if (lanes_ > 1)
    EnqueueGroups(backend_.queue(), kernel, items, kEquationParts * lanes_);
  else
    Enqueue(backend_.queue(), kernel, items, 4 * kEquationParts);
  return result.Download(backend_.queue());
}

void BlockKernels::AddSteps(std::span<const cl_int4> blocks, std::span<const float> steps, BlockWidth width) {
  if (blocks.empty()) return;
  Cells& cells = Of(width);
  tried_ = cells.curvature_fresh = false;
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<float> f(backend_, steps);
  cl::Kernel kernel(steps_program_, "add_steps");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), ball_cells_.buffer(), cell_basis_.buffer(),
          cl_int(ball_cells_.size()), ToCl(cells.size), f.buffer(), cells.mobility.buffer(),
          cells.moments.buffer(), cells.steps.buffer(), cells.field.buffer(), cells.touched.buffer());
  EnqueueRows(backend_.queue(), kernel, ball_cells_.size(), blocks.size());
  backend_.queue().finish();  // the lists are freed on return
}

// The trial, and what it shows. Cells without new steps keep theirs, or take the field's.
void BlockKernels::Compose() {
  cl::Kernel compose(state_program_, "compose");
  SetArgs(compose, cells_.active.buffer(), cl_int(cells_.active.size()), ToCl(cells_.size), kvx::ToCl(grid_),
          cells_.steps.buffer(), mobility_.buffer(), field_.buffer(), cells_.touched.buffer(),
          cl_int(has_trial_), changed_.buffer(), trial_.buffer());
  Enqueue(backend_.queue(), compose, cells_.active.size());
  See(trial_, seen_trial_);
  cells_.touched.Fill(backend_.queue(), 0);
}

void BlockKernels::Try() {
  Compose();
  cl::Kernel sums(moments_program_, "cell_sums");
  SetArgs(sums, visible_.buffer(), cl_int(visible_.size()), ToCl(cells_.size), ToCl(grid_.size),
          seen_trial_.buffer(), Targets().buffer(), weight_.buffer(), changed_.buffer(), cl_int(has_trial_),
          cells_.sums.buffer(), sums_trial_.buffer());
  Enqueue(backend_.queue(), sums, visible_.size());
  has_trial_ = tried_ = true;
}

void BlockKernels::Accept() {
  if (!tried_) Compose();
  std::swap(field_, trial_);
  std::swap(seen_, seen_trial_);
  has_trial_ = tried_ = false;
}

// Into the wide cells' own.
void BlockKernels::RestrictSums(const DeviceBuffer<Sums8>& sums) {
  const Cells& wide = Wide();
  const size_t count = size_t(wide.size.prod());
  cl::Kernel kernel(wide_program_, "restrict_sums");
  SetArgs(kernel, cl_int(count), ToCl(wide.size), ToCl(cells_.size), sums.buffer(), wide.sums.buffer());
  Enqueue(backend_.queue(), kernel, count);
}

std::vector<float> BlockKernels::Sums(std::span<const cl_int4> blocks, State state, BlockWidth width) {
  if (blocks.empty()) return {};
  const DeviceBuffer<Sums8>& own = state == State::kTrial ? sums_trial_ : cells_.sums;
  if (width == BlockWidth::kWide) RestrictSums(own);
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<float> result(backend_, blocks.size() * kSumChannels);
  cl::Kernel kernel(equations_program_, "block_sums");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), ball_cells_.buffer(), cl_int(ball_cells_.size()),
          ToCl(Of(width).size), (width == BlockWidth::kWide ? Wide().sums : own).buffer(), result.buffer());
  Enqueue(backend_.queue(), kernel, blocks.size(), 16);
  return result.Download(backend_.queue());
}

std::vector<float> BlockKernels::Samples(std::span<const cl_int4> blocks, State state) {
  if (blocks.empty()) return {};
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<float> result(backend_, blocks.size() * 3 * voxels_.size());
  cl::Kernel kernel(moments_program_, "ball_samples");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), voxels_.buffer(), cl_int(voxels_.size()),
          ToCl(grid_.size), (state == State::kTrial ? seen_trial_ : seen_).buffer(), intensity_.buffer(),
          weight_.buffer(), result.buffer());
  EnqueueRows(backend_.queue(), kernel, voxels_.size(), blocks.size());
  return result.Download(backend_.queue());
}

}  // namespace kvx

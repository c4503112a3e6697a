// The host side of block_moments.cl, block_equations.cl, block_steps.cl and level_state.cl.
#include "kernels/block_kernels.h"

#include <utility>

#include "core/cubic_spline.h"
#include "core/parallel.h"
#include "kernels/launch.h"

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

// 1 / (2 spacing)^2: the cells' lattice has twice the voxels' spacing.
Eigen::Vector3d InverseCellSquared(const Grid& grid) {
  return (2.0 * grid.spacing_mm).cwiseAbs2().cwiseInverse();
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
      grid_(level.grid),
      cells_size_(level.grid.size / 2),
      scan_size_(level.scan.grid.size),
      bending_(float(level.bending)),
      active_(DeviceBuffer<cl_int>::Shared(backend, level.active)),
      visible_(DeviceBuffer<cl_int>::Shared(backend, level.visible)),
      start_(DeviceBuffer<FieldVector>::Shared(backend, level.start)),
      field_(HandedOver(backend, std::move(field))),
      trial_(backend, level.grid.VoxelCount()),
      cell_field_(backend, level.stiffness.size()),
      cell_steps_(backend, level.stiffness.size()),
      curvature_(backend, level.stiffness.size()),
      intensity_(DeviceBuffer<float>::Shared(backend, level.intensity)),
      weight_(DeviceBuffer<float>::Shared(backend, level.weight)),
      mobility_(DeviceBuffer<float>::Shared(backend, level.mobility)),
      cell_mobility_(backend, std::span<const float>(CellMeans(level.grid, level.mobility))),
      stiffness_(DeviceBuffer<float>::Shared(backend, level.stiffness)),
      scan_(backend, std::span<const float>(SplineWithMargin(level.scan))),
      seen_(backend, level.grid.VoxelCount()),
      seen_trial_(backend, level.grid.VoxelCount()),
      moments_(backend, kMomentChannels * level.stiffness.size()),
      sums_(backend, level.stiffness.size()),
      sums_trial_(backend, level.stiffness.size()),
      cells_(backend, std::span(ball.cells)),
      voxels_(backend, std::span(ball.voxels)),
      cell_basis_(backend, std::span(ball.cell_basis)),
      basis_pairs_(backend, std::span<const float>(PairsOf(ball))),
      touched_(backend, level.stiffness.size()),
      changed_(backend, level.stiffness.size()) {
  constexpr float kUnseen = -1e30f;  // as in block.cl.h
  auto& queue = backend_.queue();
  seen_.Fill(queue, kUnseen);
  seen_trial_.Fill(queue, kUnseen);
  moments_.Fill(queue, 0.0f);
  // What is not active is never written.
  trial_.Copy(queue, field_);
  for (auto* buffer : {&cell_field_, &cell_steps_, &curvature_}) buffer->Fill(queue, FieldVector::Zero());
  sums_.Fill(queue, Sums8{});
  sums_trial_.Fill(queue, Sums8{});
}

std::vector<FieldVector> BlockKernels::Field() const { return field_.Download(backend_.queue()); }

std::vector<FieldVector> BlockKernels::TakeField() {
  for (auto* buffer : {&trial_, &cell_field_, &cell_steps_, &curvature_}) *buffer = {};
  for (auto* buffer : {&seen_, &seen_trial_, &moments_}) *buffer = {};
  for (auto* buffer : {&sums_, &sums_trial_}) *buffer = {};
  return Field();
}

void BlockKernels::See(const DeviceBuffer<FieldVector>& field, const DeviceBuffer<float>& seen) {
  cl::Kernel kernel(state_program_, "see");
  SetArgs(kernel, visible_.buffer(), cl_int(visible_.size()), ToCl(cells_size_), kvx::ToCl(grid_),
          start_.buffer(), field.buffer(), scan_.buffer(), ToCl(scan_size_), changed_.buffer(),
          cl_int(has_trial_), seen_.buffer(), seen.buffer());
  Enqueue(backend_.queue(), kernel, visible_.size());
}

void BlockKernels::Linearise() {
  if (!seen_fresh_) {
    changed_.Fill(backend_.queue(), 1);
    See(field_, seen_);
  }
  seen_fresh_ = true;
  has_trial_ = tried_ = curvature_fresh_ = false;
  touched_.Fill(backend_.queue(), 0);
  cl::Kernel moments(moments_program_, "cell_moments");
  SetArgs(moments, visible_.buffer(), cl_int(visible_.size()), ToCl(cells_size_), kvx::ToCl(grid_),
          seen_.buffer(), intensity_.buffer(), weight_.buffer(), mobility_.buffer(), moments_.buffer(),
          sums_.buffer());
  Enqueue(backend_.queue(), moments, visible_.size());
  cell_field_.Fill(backend_.queue(), FieldVector::Zero());  // steps went beyond the active cells, too
  cl::Kernel cell_field(state_program_, "cell_field");
  SetArgs(cell_field, active_.buffer(), cl_int(active_.size()), ToCl(cells_size_), ToCl(grid_.size),
          field_.buffer(), cell_field_.buffer());
  Enqueue(backend_.queue(), cell_field, active_.size());
  cell_steps_.Fill(backend_.queue(), FieldVector::Zero());
}

void BlockKernels::RefreshCurvature() {
  if (std::exchange(curvature_fresh_, true)) return;
  cl::Kernel kernel(state_program_, "cell_curvature");
  SetArgs(kernel, active_.buffer(), cl_int(active_.size()), ToCl(cells_size_), cell_field_.buffer(),
          stiffness_.buffer(), ToCl(InverseCellSquared(grid_)), curvature_.buffer());
  Enqueue(backend_.queue(), kernel, active_.size());
}

std::vector<float> BlockKernels::Equations(std::span<const cl_int4> blocks) {
  RefreshCurvature();
  const Eigen::Vector3d bend = bending_ * 8 * grid_.spacing_mm.prod() * InverseCellSquared(grid_);
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<float> result(backend_, blocks.size() * kEquationValues);
  cl::Kernel kernel(equations_program_, "block_equations");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), cells_.buffer(), cl_int(cells_.size()),
          ToCl(cells_size_), moments_.buffer(), curvature_.buffer(), ToCl(bend), cell_mobility_.buffer(),
          cell_basis_.buffer(), basis_pairs_.buffer(), result.buffer());
  const size_t items = blocks.size() * kEquationParts * lanes_;
  if (lanes_ > 1)
    EnqueueGroups(backend_.queue(), kernel, items, kEquationParts * lanes_);
  else
    Enqueue(backend_.queue(), kernel, items, 4 * kEquationParts);
  return result.Download(backend_.queue());
}

void BlockKernels::AddSteps(std::span<const cl_int4> blocks, std::span<const float> steps) {
  if (blocks.empty()) return;
  tried_ = curvature_fresh_ = false;
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<float> f(backend_, steps);
  cl::Kernel kernel(steps_program_, "add_steps");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), cells_.buffer(), cell_basis_.buffer(),
          cl_int(cells_.size()), ToCl(cells_size_), f.buffer(), cell_mobility_.buffer(), moments_.buffer(),
          cell_steps_.buffer(), cell_field_.buffer(), touched_.buffer());
  EnqueueRows(backend_.queue(), kernel, cells_.size(), blocks.size());
  backend_.queue().finish();  // the lists are freed on return
}

// The trial, and what it shows. Cells without new steps keep theirs, or take the field's.
void BlockKernels::Compose() {
  cl::Kernel compose(state_program_, "compose");
  SetArgs(compose, active_.buffer(), cl_int(active_.size()), ToCl(cells_size_), kvx::ToCl(grid_),
          cell_steps_.buffer(), mobility_.buffer(), field_.buffer(), touched_.buffer(), cl_int(has_trial_),
          changed_.buffer(), trial_.buffer());
  Enqueue(backend_.queue(), compose, active_.size());
  See(trial_, seen_trial_);
  touched_.Fill(backend_.queue(), 0);
}

void BlockKernels::Try() {
  Compose();
  cl::Kernel sums(moments_program_, "cell_sums");
  SetArgs(sums, visible_.buffer(), cl_int(visible_.size()), ToCl(cells_size_), ToCl(grid_.size),
          seen_trial_.buffer(), intensity_.buffer(), weight_.buffer(), changed_.buffer(), cl_int(has_trial_),
          sums_.buffer(), sums_trial_.buffer());
  Enqueue(backend_.queue(), sums, visible_.size());
  has_trial_ = tried_ = true;
}

void BlockKernels::Accept() {
  if (!tried_) Compose();
  std::swap(field_, trial_);
  std::swap(seen_, seen_trial_);
  has_trial_ = tried_ = false;
}

std::vector<float> BlockKernels::Sums(std::span<const cl_int4> blocks, State state) {
  if (blocks.empty()) return {};
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<float> result(backend_, blocks.size() * kSumChannels);
  cl::Kernel kernel(equations_program_, "block_sums");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), cells_.buffer(), cl_int(cells_.size()),
          ToCl(cells_size_), (state == State::kTrial ? sums_trial_ : sums_).buffer(), result.buffer());
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

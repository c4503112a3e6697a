// The host side of block_moments.cl, block_equations.cl, block_steps.cl and level_state.cl.
#include "kernels/block_kernels.h"

#include "kernels/launch.h"
#include "kernels/pyramid.h"

namespace kvx {
namespace {

constexpr size_t kBatch = 256;  // blocks whose cell moments are held at once: 21 MiB

cl_int4 ToCl(const Eigen::Vector3i& v) { return {{v.x(), v.y(), v.z(), 0}}; }
cl_float4 ToCl(const Eigen::Vector3d& v) { return {{float(v.x()), float(v.y()), float(v.z()), 0}}; }

// One work-item per (ball element, block).
void EnqueueBall(cl::CommandQueue& queue, const cl::Kernel& kernel, size_t elements, size_t blocks) {
  constexpr size_t kGroup = 64;
  queue.enqueueNDRangeKernel(kernel, cl::NullRange,
                             cl::NDRange((elements + kGroup - 1) / kGroup * kGroup, blocks),
                             cl::NDRange(kGroup, 1));
}

// 1 / (2 spacing)^2: the cells' lattice has twice the voxels' spacing.
Eigen::Vector3d InverseCellSquared(const Grid& grid) {
  return (2.0 * grid.spacing_mm).cwiseAbs2().cwiseInverse();
}

}  // namespace

BlockKernels::BlockKernels(Backend& backend, const BlockLevel& level, const BallBasis& ball)
    : backend_(backend),
      moments_program_(backend.programs().Build("block_moments.cl")),
      equations_program_(backend.programs().Build("block_equations.cl")),
      steps_program_(backend.programs().Build("block_steps.cl")),
      state_program_(backend.programs().Build("level_state.cl")),
      grid_(level.grid),
      scan_size_(level.scan.grid.size),
      bending_(float(level.bending)),
      base_(backend, std::span(level.base)),
      linear_(backend, std::span(level.linear)),
      intensity_(backend, std::span(level.intensity)),
      weight_(backend, std::span(level.weight)),
      mobility_(backend, std::span(level.mobility)),
      stiffness_(backend, std::span(level.stiffness)),
      scan_(Pyramid(backend).ValueAndSlope(level.scan)),
      field_(backend, level.grid.VoxelCount()),
      trial_(backend, level.grid.VoxelCount()),
      slope_(backend, level.grid.VoxelCount()),
      curvature_(backend, level.stiffness.size()),
      cells_(backend, std::span(ball.cells)),
      voxels_(backend, std::span(ball.voxels)),
      cell_basis_(backend, std::span(ball.cell_basis)),
      voxel_basis_(backend, std::span(ball.voxel_basis)),
      scratch_(backend, kBatch * kMomentChannels * ball.cells.size()) {
  SetField(std::vector<FieldVector>(level.grid.VoxelCount(), FieldVector::Zero()));
}

void BlockKernels::SetField(std::span<const FieldVector> field) { field_.Upload(backend_.queue(), field); }

std::vector<FieldVector> BlockKernels::Field() const { return field_.Download(backend_.queue()); }

void BlockKernels::RefreshTemplateSlope() {
  cl::Kernel kernel(state_program_, "template_slope");
  const Eigen::Matrix3d mm = grid_.VoxFromMm().transpose();
  SetArgs(kernel, ToCl(grid_.size), base_.buffer(), linear_.buffer(), field_.buffer(), intensity_.buffer(),
          weight_.buffer(), ToCl(Eigen::Vector3d(mm.row(0))), ToCl(Eigen::Vector3d(mm.row(1))),
          ToCl(Eigen::Vector3d(mm.row(2))), slope_.buffer());
  Enqueue(backend_.queue(), kernel, grid_.size);
}

void BlockKernels::RefreshCurvature() {
  cl::Kernel kernel(state_program_, "cell_curvature");
  SetArgs(kernel, ToCl(grid_.size), field_.buffer(), stiffness_.buffer(), ToCl(InverseCellSquared(grid_)),
          curvature_.buffer());
  Enqueue(backend_.queue(), kernel, Eigen::Vector3i(grid_.size / 2));
}

std::vector<float> BlockKernels::Equations(std::span<const cl_int4> blocks) {
  std::vector<float> out(blocks.size() * kEquationValues);
  const Eigen::Vector3d bend = bending_ * 8 * grid_.spacing_mm.prod() * InverseCellSquared(grid_);
  for (size_t first = 0; first < blocks.size(); first += kBatch) {
    const auto batch = blocks.subspan(first, std::min(kBatch, blocks.size() - first));
    const DeviceBuffer<cl_int4> list(backend_, batch);
    const DeviceBuffer<float> result(backend_, batch.size() * kEquationValues);
    cl::Kernel moments(moments_program_, "cell_moments");
    SetArgs(moments, list.buffer(), cl_int(batch.size()), cells_.buffer(), cl_int(cells_.size()),
            ToCl(grid_.size), base_.buffer(), linear_.buffer(), field_.buffer(), scan_.buffer(),
            ToCl(scan_size_), intensity_.buffer(), slope_.buffer(), weight_.buffer(), mobility_.buffer(),
            curvature_.buffer(), ToCl(bend), scratch_.buffer());
    EnqueueBall(backend_.queue(), moments, cells_.size(), batch.size());
    cl::Kernel equations(equations_program_, "block_equations");
    SetArgs(equations, scratch_.buffer(), cl_int(batch.size()), cell_basis_.buffer(), cl_int(cells_.size()),
            result.buffer());
    Enqueue(backend_.queue(), equations, batch.size() * kMomentChannels, kMomentChannels);
    result.Download(backend_.queue(), std::span(out).subspan(first * kEquationValues, result.size()));
  }
  return out;
}

std::vector<float> BlockKernels::SumsOf(std::span<const cl_int4> blocks,
                                        const DeviceBuffer<FieldVector>& field) {
  std::vector<float> out(blocks.size() * kSumChannels);
  for (size_t first = 0; first < blocks.size(); first += kBatch) {
    const auto batch = blocks.subspan(first, std::min(kBatch, blocks.size() - first));
    const DeviceBuffer<cl_int4> list(backend_, batch);
    const DeviceBuffer<float> result(backend_, batch.size() * kSumChannels);
    cl::Kernel cells(moments_program_, "cell_sums");
    SetArgs(cells, list.buffer(), cl_int(batch.size()), cells_.buffer(), cl_int(cells_.size()),
            ToCl(grid_.size), base_.buffer(), linear_.buffer(), field.buffer(), scan_.buffer(),
            ToCl(scan_size_), intensity_.buffer(), weight_.buffer(), scratch_.buffer());
    EnqueueBall(backend_.queue(), cells, cells_.size(), batch.size());
    cl::Kernel sums(equations_program_, "block_sums");
    SetArgs(sums, scratch_.buffer(), cl_int(batch.size()), cl_int(cells_.size()), result.buffer());
    Enqueue(backend_.queue(), sums, batch.size() * kSumChannels, kSumChannels);
    result.Download(backend_.queue(), std::span(out).subspan(first * kSumChannels, result.size()));
  }
  return out;
}

std::vector<float> BlockKernels::Sums(std::span<const cl_int4> blocks) { return SumsOf(blocks, field_); }

std::vector<float> BlockKernels::TrialSums(std::span<const cl_int4> blocks, std::span<const float> steps) {
  if (blocks.empty()) return {};
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<float> f(backend_, steps);
  cl::Kernel kernel(steps_program_, "apply_steps");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), voxels_.buffer(), voxel_basis_.buffer(),
          cl_int(voxels_.size()), kvx::ToCl(grid_), f.buffer(), mobility_.buffer(), field_.buffer(),
          trial_.buffer());
  EnqueueBall(backend_.queue(), kernel, voxels_.size(), blocks.size());
  return SumsOf(blocks, trial_);
}

std::vector<float> BlockKernels::Samples(std::span<const cl_int4> blocks, State state) {
  if (blocks.empty()) return {};
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<float> result(backend_, blocks.size() * 3 * voxels_.size());
  cl::Kernel kernel(moments_program_, "ball_samples");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), voxels_.buffer(), cl_int(voxels_.size()),
          ToCl(grid_.size), base_.buffer(), linear_.buffer(),
          (state == State::kTrial ? trial_ : field_).buffer(), scan_.buffer(), ToCl(scan_size_),
          intensity_.buffer(), weight_.buffer(), result.buffer());
  EnqueueBall(backend_.queue(), kernel, voxels_.size(), blocks.size());
  return result.Download(backend_.queue());
}

void BlockKernels::Accept(std::span<const cl_int4> blocks, std::span<const cl_int> accepted) {
  if (blocks.empty()) return;
  const DeviceBuffer<cl_int4> list(backend_, blocks);
  const DeviceBuffer<cl_int> flags(backend_, accepted);
  cl::Kernel kernel(steps_program_, "accept_steps");
  SetArgs(kernel, list.buffer(), cl_int(blocks.size()), voxels_.buffer(), cl_int(voxels_.size()),
          ToCl(grid_.size), flags.buffer(), trial_.buffer(), field_.buffer());
  EnqueueBall(backend_.queue(), kernel, voxels_.size(), blocks.size());
  backend_.queue().finish();  // the lists are freed on return
}

}  // namespace kvx

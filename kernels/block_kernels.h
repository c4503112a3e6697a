// The device side of one registration level: what the scan shows under the field, normal equations of blocks,
// their steps, and the field.
#pragma once
#include "kernels/block_level.h"
#include "kernels/device_buffer.h"

namespace kvx {

// A sweep: Linearise, then Equations and AddSteps for one set of blocks after the other, then Try, and Accept
// if the trial is better. Within a sweep images are taken as linear, so no voxel is looked at twice. Blocks
// are given by the first voxel of their support (even; may lie outside the grid).
// Blocks of one AddSteps must have disjoint supports.
class BlockKernels {
 public:
  // `level` must outlive the kernels. The field goes to the device: it need not be in memory twice.
  // `lanes`: work-items that add up a part of a block's equations together, a power of 2 (0: as the device
  // likes them). The sums' rounding depends on it.
  BlockKernels(Backend& backend, const BlockLevel& level, const BallBasis& ball,
               std::vector<FieldVector> field, int lanes = 0);

  std::vector<FieldVector> Field() const;
  // And gives back what else is on the device: nothing works afterwards.
  std::vector<FieldVector> TakeField();

  void Linearise();
  // kEquationValues per block (layout: kernels/cl/block_equations.cl), as the steps so far have left them.
  std::vector<float> Equations(std::span<const cl_int4> blocks);
  // 24 floats per block: x of the 8 control points, y, z; mm.
  void AddSteps(std::span<const cl_int4> blocks, std::span<const float> steps);
  void Try();     // composes the steps of the sweep with the field, and looks
  void Accept();  // the steps as they are now become part of the field, tried or not

  // Of the field as Linearise saw it, or as Try left it.
  enum class State { kField, kTrial };
  // Sums for a fit of gain and bias over each ball: w, w t, w s, w t t, w t s, w s s.
  std::vector<float> Sums(std::span<const cl_int4> blocks, State state);
  // Three runs of VoxelsPerBall() floats per block:
  // template, scan, and 1 where the voxel counts (else all 0).
  std::vector<float> Samples(std::span<const cl_int4> blocks, State state);
  size_t VoxelsPerBall() const { return voxels_.size(); }

 private:
  using Sums8 = std::array<float, 8>;
  void See(const DeviceBuffer<FieldVector>& field, const DeviceBuffer<float>& seen);
  void RefreshCurvature();
  void Compose();

  Backend& backend_;
  size_t lanes_;
  cl::Program moments_program_, equations_program_, steps_program_, state_program_;
  Grid grid_;
  Eigen::Vector3i cells_size_, scan_size_;
  float bending_;
  DeviceBuffer<cl_int> active_, visible_;
  DeviceBuffer<FieldVector> start_, field_, trial_, cell_field_, cell_steps_, curvature_;
  DeviceBuffer<float> intensity_, weight_, mobility_, cell_mobility_, stiffness_, scan_, seen_, seen_trial_,
      moments_;
  DeviceBuffer<Sums8> sums_, sums_trial_;
  DeviceBuffer<cl_int4> cells_, voxels_;
  DeviceBuffer<std::array<float, kControlPoints>> cell_basis_;
  DeviceBuffer<float> basis_pairs_;
  // Cells whose steps are newer than the trial, and those whose trial was composed the last time
  DeviceBuffer<cl_uchar> touched_, changed_;
  bool seen_fresh_ = false;       // seen_ is of the field
  bool curvature_fresh_ = false;  // of the cells' field
  bool has_trial_ = false;        // of this sweep's steps, perhaps not the newest
  bool tried_ = false;            // of the newest
};

}  // namespace kvx

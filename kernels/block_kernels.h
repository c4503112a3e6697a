// The device side of one registration level: normal equations of blocks, composition of their steps, and the
// field.
#pragma once
#include "kernels/block_level.h"
#include "kernels/device_buffer.h"

namespace kvx {

// Blocks are given by the first voxel of their support (even; may lie outside the grid). Blocks of one
// TrialSums call must have disjoint supports.
class BlockKernels {
 public:
  BlockKernels(Backend& backend, const BlockLevel& level, const BallBasis& ball);

  void SetField(std::span<const FieldVector> field);
  std::vector<FieldVector> Field() const;
  void RefreshTemplateSlope();  // after the field has moved by a good part of a voxel
  void RefreshCurvature();      // before Equations, whenever the field has changed

  // kEquationValues per block (layout: kernels/cl/block_equations.cl).
  std::vector<float> Equations(std::span<const cl_int4> blocks);
  // Sums for a fit of gain and bias over each ball: w, w t, w s, w t t, w t s, w s s. Of the field as it is
  // ...
  std::vector<float> Sums(std::span<const cl_int4> blocks);
  // ... and as it would be after the given steps (24 floats per block: x of the 8 control points, y, z; mm).
  std::vector<float> TrialSums(std::span<const cl_int4> blocks, std::span<const float> steps);
  // Three runs of VoxelsPerBall() floats per block: template, scan, and 1 where the voxel counts (else all
  // 0), of the field as it is or as the last TrialSums of the same blocks left the trial.
  enum class State { kField, kTrial };
  std::vector<float> Samples(std::span<const cl_int4> blocks, State state);
  size_t VoxelsPerBall() const { return voxels_.size(); }
  // Keeps the trial field of the blocks whose flag is not 0.
  void Accept(std::span<const cl_int4> blocks, std::span<const cl_int> accepted);

 private:
  std::vector<float> SumsOf(std::span<const cl_int4> blocks, const DeviceBuffer<FieldVector>& field);

  Backend& backend_;
  cl::Program moments_program_, equations_program_, steps_program_, state_program_;
  Grid grid_;
  Eigen::Vector3i scan_size_;
  float bending_;
  DeviceBuffer<float> base_, linear_, intensity_, weight_, mobility_, stiffness_;
  DeviceBuffer<FieldVector> scan_, field_, trial_, slope_, curvature_;
  DeviceBuffer<cl_int4> cells_, voxels_;
  DeviceBuffer<std::array<float, kControlPoints>> cell_basis_, voxel_basis_;
  DeviceBuffer<float> scratch_;
};

}  // namespace kvx

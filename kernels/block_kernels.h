// The device side of one registration level: what the scan shows under the field, normal equations of blocks,
// their steps, and the field.
#pragma once
#include <optional>

#include "kernels/block_level.h"
#include "kernels/device/device_buffer.h"

namespace kvx {

// Blocks are as wide as kBlockVoxels says, or twice that. Wide ones are solved on the same images, from sums
// over cells twice as wide: what is left of long waves takes few of them.
enum class BlockWidth { kOwn, kWide };

// A sweep: Linearise, then Equations and AddSteps for one set of blocks after the other, then Try, and Accept
// if the trial is better. Within a sweep images are taken as linear, so no voxel is looked at twice. Wide
// blocks take their turn between Restrict and Prolong. Blocks are given by the first voxel of their support
// (even; may lie outside the grid), wide ones in voxels twice as wide. Blocks of one AddSteps must have
// disjoint supports.
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

  // What the scan shows under the field; kUnseen where it shows nothing.
  std::vector<float> Seen();
  // What it should show instead of the template's intensities, and the voxels' weights, from the next
  // Linearise on. Slopes stay those of the intensities.
  void SetTargets(std::span<const float> targets, std::span<const float> weights);

  void Linearise();
  // kEquationValues per block (layout: kernels/cl/block_equations.cl), as the steps so far have left them.
  std::vector<float> Equations(std::span<const cl_int4> blocks, BlockWidth width = BlockWidth::kOwn);
  // 24 floats per block: x of the 8 control points, y, z; mm.
  void AddSteps(std::span<const cl_int4> blocks, std::span<const float> steps,
                BlockWidth width = BlockWidth::kOwn);
  void Restrict();  // wide cells hold what the cells do, and no steps
  void Prolong();   // wide cells' steps since Restrict become the cells'
  void Try();       // composes the steps of the sweep with the field, and looks
  void Accept();    // the steps as they are now become part of the field, tried or not

  // Of the field as Linearise saw it, or as Try left it.
  enum class State { kField, kTrial };
  // Sums for a fit of gain and bias over each ball: w, w t, w s, w t t, w t s, w s s.
  std::vector<float> Sums(std::span<const cl_int4> blocks, State state, BlockWidth width = BlockWidth::kOwn);
  // Three runs of VoxelsPerBall() floats per block:
  // template, scan, and 1 where the voxel counts (else all 0).
  std::vector<float> Samples(std::span<const cl_int4> blocks, State state);
  size_t VoxelsPerBall() const { return voxels_.size(); }

 private:
  using Sums8 = std::array<float, 8>;
  struct Cells {
    Eigen::Vector3i size;
    Eigen::Vector3d spacing_mm;
    DeviceBuffer<cl_int> active;
    DeviceBuffer<FieldVector> field, steps, curvature;
    DeviceBuffer<float> mobility, stiffness, moments;
    DeviceBuffer<Sums8> sums;
    DeviceBuffer<cl_uchar> touched;  // steps are newer than the trial
    bool curvature_fresh = false;    // of the field
  };
  static Cells MakeCells(Backend& backend, const Grid& grid, DeviceBuffer<cl_int> active,
                         DeviceBuffer<float> mobility, DeviceBuffer<float> stiffness);
  Cells MakeWide() const;

  Cells& Wide();  // made when first asked for: not every level needs them
  Cells& Of(BlockWidth width) { return width == BlockWidth::kWide ? Wide() : cells_; }
  const DeviceBuffer<float>& Targets() const { return targets_.size() > 0 ? targets_ : intensity_; }
  void SeeField();
  void See(const DeviceBuffer<FieldVector>& field, const DeviceBuffer<float>& seen);
  void RefreshCurvature(Cells& cells);
  void RestrictSums(const DeviceBuffer<Sums8>& sums);
  void Compose();

  Backend& backend_;
  size_t lanes_;
  cl::Program moments_program_, equations_program_, steps_program_, state_program_, wide_program_;
  Grid grid_;
  Eigen::Vector3i scan_size_;
  float bending_;
  DeviceBuffer<cl_int> visible_;
  DeviceBuffer<FieldVector> start_, field_, trial_;
  DeviceBuffer<float> intensity_, targets_, weight_, mobility_, scan_, seen_, seen_trial_;
  Cells cells_;
  std::optional<Cells> wide_;
  DeviceBuffer<Sums8> sums_trial_;
  DeviceBuffer<cl_int4> ball_cells_, voxels_;
  DeviceBuffer<std::array<float, kControlPoints>> cell_basis_;
  DeviceBuffer<float> basis_pairs_;
  DeviceBuffer<cl_uchar> changed_;  // cells whose trial was composed the last time
  bool seen_fresh_ = false;         // seen_ is of the field
  bool has_trial_ = false;          // of this sweep's steps, perhaps not the newest
  bool tried_ = false;              // of the newest
};

}  // namespace kvx

// What one resolution level of the block registration works on, and the ball of voxels around one block.
// The map under way is scan voxel = start(v + d(v)): the start's map of the displaced template point (eq. 6),
// d in template mm. Where neither folds, what they make together does not.
#pragma once
#include <span>
#include <vector>

#include "core/clamped_plate_spline.h"
#include "core/image.h"
#include "kernels/device/opencl.h"

namespace kvx {

constexpr int kBlockVoxels = 8;                   // block width at every level
constexpr int kSupportVoxels = 3 * kBlockVoxels;  // the ball is inscribed in 3 x 3 x 3 blocks

constexpr float kUnseen = -1e30f;  // as in block.cl.h: what the scan shows where it shows nothing

using FieldVector = Eigen::Vector4f;  // x, y, z in mm, 0

struct BlockLevel {
  Grid grid;                // of the template's level; sizes even
  int template_voxels = 1;  // per axis, in one voxel of the level
  // Of the finest level's: so many say together what one that was measured says
  double voxels_a_measurement = 1;
  std::vector<FieldVector> start;  // scan voxels
  std::vector<float> intensity;    // of the template, as the scan would show it
  std::vector<float> own_greys;    // of the template, where the scan's contrast is another; else empty
  std::vector<float> weight;       // inverse variance of the intensity difference; 0 where it does not count
  std::vector<float> mobility;     // 0 in bone .. 1
  std::vector<float> stiffness;    // per cell of 2 x 2 x 2 voxels: weight of the bending energy
  std::vector<float> firmness;     // per cell: of the prior beside what is usual; part of the stiffness
  double bending = 0;              // energy per squared laplacian (1/mm^2) and mm^3
  Volume scan;  // the scan's level, read on a cubic spline; at least two voxels along every axis
  std::vector<cl_int> active;   // cells that are worked on: the body and enough around it; increasing
  std::vector<cl_int> visible;  // those of them whose voxels, or their neighbours, count
};

// Offsets from the support's first voxel, and the spline's basis there: cells of 2 x 2 x 2 voxels (offsets in
// cells) whose centre lies in the ball, and all their voxels.
struct BallBasis {
  std::vector<cl_int4> cells, voxels;
  std::vector<std::array<float, kControlPoints>> cell_basis;
};
BallBasis MakeBallBasis(const BlockSpline& spline);

// Means over the cells of 2 x 2 x 2 voxels, fewer where a size is odd: what a cell has at its centre, where
// its steps are.
std::vector<float> CellMeans(const Grid& grid, std::span<const float> image);

constexpr int kMomentChannels = 24, kSumChannels = 6, kEquationValues = 6 * 64 + 12 * 8 + 6;

}  // namespace kvx

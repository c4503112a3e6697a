// One Gauss-Newton step of a block: 24 displacements, gain and bias,
// with the exact bending energy (paper, eq. 3).
#pragma once
#include <span>
#include <vector>

#include "kernels/block_level.h"

namespace kvx {

// Energies are negative log posteriors: half the weighted squares,
// so differences compare with numbers of parameters.
struct BlockStep {
  std::array<float, 24> displacement_mm{};  // x of the 8 control points, y, z
  double data_gain = 0;                     // predicted fall of the data's energy
  double bending_change = 0;                // predicted, of the whole field's bending energy
  double largest_mm = 0;                    // over control points
};

class BlockSolver {
 public:
  BlockSolver(const BlockSpline& spline, const BlockLevel& level);

  // `equations`: kEquationValues, as BlockKernels::Equations gives them.
  // `firmness`: of the prior where the block is.
  BlockStep Solve(std::span<const float> equations, double firmness) const;
  // Of the displacement, as images and prior together leave it, summed over the axes; at places given by
  // their rows of the spline's basis. What the images disagree in, beyond what well registered tissue does,
  // counts as uncertainty. The prior is that of cubes of the voxels' volume.
  std::vector<float> VariancesMm2(std::span<const float> equations, double firmness,
                                  std::span<const std::array<float, kControlPoints>> basis) const;
  // Energy of the intensities of a window after the best gain and bias; per unit of weight, so that points
  // that leave the field of view neither gain nor lose.
  double DataEnergyPerWeight(std::span<const float> sums) const;

 private:
  ControlMatrix bending_;   // energy of F^T bending F, per component
  ControlMatrix of_cubes_;  // the same, were the voxels cubes: by these stated errors are scaled
  double gain_precision_, bias_precision_;
  double step_cap_mm_;
};

}  // namespace kvx

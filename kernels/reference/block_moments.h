// CPU twins of block_moments.cl, block_equations.cl, block_steps.cl and level_state.cl: one block at a time, double precision.
#pragma once
#include <array>

#include "kernels/block_level.h"

namespace kvx::reference {

using Slopes = std::vector<Eigen::Vector3d>;      // template slope per mm at every voxel
using Curvature = std::vector<Eigen::Vector3d>;   // stiffness * laplacian at every cell

Slopes TemplateSlope(const BlockLevel& level, const std::vector<FieldVector>& field);
Curvature CellCurvature(const BlockLevel& level, const std::vector<FieldVector>& field);

// kEquationValues numbers of one block; layout as in kernels/cl/block_equations.cl.
std::vector<double> Equations(const BlockLevel& level, const BallBasis& ball, const std::vector<FieldVector>& field,
                              const Slopes& slopes, const Curvature& curvature, const Eigen::Vector3i& support);
std::array<double, kSumChannels> Sums(const BlockLevel& level, const BallBasis& ball, const std::vector<FieldVector>& field,
                                      const Eigen::Vector3i& support);
// The field after the step of one block (24 numbers as in BlockKernels::TrialSums).
std::vector<FieldVector> Stepped(const BlockLevel& level, const BallBasis& ball, const std::vector<FieldVector>& field,
                                 const Eigen::Vector3i& support, const std::vector<float>& step);

}  // namespace kvx::reference

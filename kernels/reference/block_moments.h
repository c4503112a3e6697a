// CPU twins of block_moments.cl, block_equations.cl, block_steps.cl and level_state.cl:
// plain loops, double precision.
#pragma once
#include <array>
#include <optional>

#include "kernels/block_level.h"

namespace kvx::reference {

using Seen = std::vector<std::optional<double>>;  // what the scan shows, per voxel
using CellSteps = std::vector<Eigen::Vector3d>;   // mm, per cell; without the mobility of its voxels

Seen SeenThrough(const BlockLevel& level, const std::vector<FieldVector>& field);

// Adds the step of one block (24 numbers as in BlockKernels::AddSteps) to the cells of its ball.
void AddStep(const BlockLevel& level, const BallBasis& ball, const Eigen::Vector3i& support,
             const std::vector<float>& step_mm, CellSteps& steps);

// kEquationValues numbers of one block; layout as in kernels/cl/block_equations.cl.
// Images are linear in the steps. `targets`: as BlockKernels::SetTargets takes them.
std::vector<double> Equations(const BlockLevel& level, const BallBasis& ball,
                              const std::vector<FieldVector>& field, const Seen& seen, const CellSteps& steps,
                              const Eigen::Vector3i& support, std::span<const float> targets = {});
std::array<double, kSumChannels> Sums(const BlockLevel& level, const BallBasis& ball, const Seen& seen,
                                      const Eigen::Vector3i& support);
// The field after the steps, on the active cells.
std::vector<FieldVector> Composed(const BlockLevel& level, const std::vector<FieldVector>& field,
                                  const CellSteps& steps);

}  // namespace kvx::reference

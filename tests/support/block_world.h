// A level of the registration with bone, air and a field of view that ends, oblique and anisotropic, and the
// blocks' twins beside it.
#pragma once
#include <gtest/gtest.h>

#include <random>

#include "kernels/block_kernels.h"
#include "kernels/reference/block_moments.h"
#include "tests/support/fixtures.h"

namespace kvx::testing_support {

struct BlockWorld {
  BlockLevel level;
  std::vector<FieldVector> field;
  BallBasis ball = MakeBallBasis(BlockSpline());
};

// Smooth intensities and a smooth field; the scan is smaller than where the template lands,
// so some points leave it.
inline BlockWorld MakeBlockWorld(const Eigen::Vector3i& size = {40, 36, 32}) {
  BlockWorld world;
  BlockLevel& level = world.level;
  level.grid = ObliqueGrid(size);
  level.scan = LinearRamp{}.On(ObliqueGrid({34, 40, 30}));
  for (size_t v = 0; v < level.scan.values.size(); ++v) {
    level.scan.values[v] =
        0.2f * level.scan.values[v] + 2.0f * float(std::sin(0.5 * double(level.scan.grid.Ijk(v).sum())));
  }
  level.bending = 0.7;
  std::mt19937 random(5);
  const auto uniform = [&] { return float(random() % 1000) / 1000; };
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v) {
    const Eigen::Vector3d p = level.grid.Ijk(v).cast<double>();
    const Eigen::Vector3d at =
        0.95 * p + Eigen::Vector3d(-1, 1.5, 0.25) + 0.1 * Eigen::Vector3d(p.y(), 0, p.x());
    level.start.push_back({float(at[0]), float(at[1]), float(at[2]), 0});
    level.intensity.push_back(float(std::cos(0.4 * p.x() + 0.3 * p.y() - 0.2 * p.z())));
    level.weight.push_back(uniform() < 0.1f ? 0.0f : uniform());
    level.mobility.push_back(uniform());
    world.field.push_back(
        {float(std::sin(0.2 * p.x())), float(std::cos(0.3 * p.y())), float(std::sin(0.25 * p.z())), 0});
  }
  for (size_t c = 0; c < level.grid.VoxelCount() / 8; ++c) level.stiffness.push_back(uniform());
  // Not all cells are worked on, and of those not all count.
  const Grid cells = Coarsened(level.grid, 2);
  for (size_t c = 0; c < cells.VoxelCount(); ++c) {
    const Eigen::Vector3i p = cells.Ijk(c);
    if (p.z() == 0) continue;
    level.active.push_back(cl_int(c));
    if (p.x() > 0) level.visible.push_back(cl_int(c));
  }
  for (size_t v = 0; v < level.weight.size(); ++v) {
    if (level.grid.Ijk(v).x() < 3 || level.grid.Ijk(v).z() < 3) level.weight[v] = 0;
  }
  return world;
}

inline const std::vector<cl_int4> kSomeBlocks = {{{8, 4, 4, 0}}, {{-8, -8, -8, 0}}, {{20, 16, 12, 0}}};

inline Eigen::Vector3i ToVector(const cl_int4& v) { return {v.s[0], v.s[1], v.s[2]}; }

inline void ExpectClose(double value, double twin, double scale, const char* what, size_t n) {
  ASSERT_NEAR(value, twin, 2e-4 * scale) << what << " " << n;
}

inline void ExpectEquations(BlockKernels& kernels, const BlockWorld& world, const reference::CellSteps& steps,
                            std::span<const float> targets = {}) {
  const std::vector<float> equations = kernels.Equations(kSomeBlocks);
  const auto seen = reference::SeenThrough(world.level, world.field);
  for (size_t b = 0; b < kSomeBlocks.size(); ++b) {
    const auto twin = reference::Equations(world.level, world.ball, world.field, seen, steps,
                                           ToVector(kSomeBlocks[b]), targets);
    double scale = 0;
    for (const double value : twin) scale = std::max(scale, std::abs(value));
    EXPECT_GT(scale, 1.0);
    for (int n = 0; n < kEquationValues; ++n) {
      const double own = n < 480 ? scale : std::abs(twin[485]);
      ExpectClose(equations[b * kEquationValues + n], twin[n], own, "value", n);
    }
  }
}

inline reference::CellSteps NoSteps(const BlockWorld& world) {
  return reference::CellSteps(world.level.stiffness.size(), Eigen::Vector3d::Zero());
}

}  // namespace kvx::testing_support

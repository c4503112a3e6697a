// What a level counts as registered.
#include "pipeline/registration/blocks/adaptive_sweeps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// Waves along x in the template; of the scan so many times as much, moved by half a voxel.
BlockLevel Waves(float of_scan) {
  BlockLevel level;
  level.grid.size = {24, 24, 24};
  level.scan = Volume(level.grid);
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v) {
    const Eigen::Vector3i p = level.grid.Ijk(v);
    level.start.push_back({float(p.x()), float(p.y()), float(p.z()), 0});
    level.intensity.push_back(float(std::sin(0.5 * p.x())));
    level.scan.values[v] = of_scan * float(std::sin(0.5 * (p.x() - 0.5)));
  }
  level.weight.assign(level.grid.VoxelCount(), 1), level.mobility = level.weight;
  const size_t cells = level.grid.VoxelCount() / 8;
  level.stiffness.assign(cells, 1), level.firmness.assign(cells, 1);
  for (size_t c = 0; c < cells; ++c) level.active.push_back(cl_int(c)), level.visible.push_back(cl_int(c));
  level.bending = 1e-3;
  return level;
}

struct Registered {
  int64_t blocks;
  float moved_mm;
};

Registered Register(const BlockLevel& level) {
  std::vector<FieldVector> field(level.grid.VoxelCount(), FieldVector::Zero());
  const int64_t blocks = RegisterLevel(level, SharedBackend(), {}, {5, 0}, false, field).blocks;
  float moved_mm = 0;
  for (const FieldVector& d : field) moved_mm = std::max(moved_mm, d.norm());
  return {blocks, moved_mm};
}

// In a scan of one grey no step keeps what the template's slopes promise: all are taken back.
TEST(RegisterLevel, BlocksWhoseStepsAreTakenBackAreNotCounted) {
  const Registered waves = Register(Waves(1));
  EXPECT_GT(waves.moved_mm, 0.3);
  EXPECT_GT(waves.blocks, 0);
  const Registered one_grey = Register(Waves(0));
  EXPECT_LT(one_grey.moved_mm, 1e-4);
  EXPECT_EQ(one_grey.blocks, 0);
}

TEST(RegisterLevel, NoSweepIsMadeBeyondTheLast) {
  const BlockLevel level = Waves(1);
  const auto moved_mm = [&](int most_sweeps) {
    std::vector<FieldVector> field(level.grid.VoxelCount(), FieldVector::Zero());
    RegisterLevel(level, SharedBackend(), {}, {most_sweeps, 0}, false, field);
    float sum = 0;
    for (const FieldVector& d : field) sum += d.norm();
    return sum;
  };
  EXPECT_EQ(moved_mm(0), 0);
  EXPECT_GT(moved_mm(1), 0);
  EXPECT_NE(moved_mm(2), moved_mm(1));
}

// Greys with detail in all directions, in a scan that is moved along x by one wave of a voxel over the level.
BlockLevel MovedByALongWave(int size) {
  BlockLevel level = Waves(1);
  level.grid.size = {size, size, size};
  level.scan = Volume(level.grid);
  level.start.clear(), level.intensity.clear();
  const auto grey = [](double x, double y, double z) {
    return float(std::sin(0.6 * x) + std::sin(0.5 * y) + std::cos(0.55 * z));
  };
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v) {
    const Eigen::Vector3i p = level.grid.Ijk(v);
    level.start.push_back({float(p.x()), float(p.y()), float(p.z()), 0});
    level.intensity.push_back(grey(p.x(), p.y(), p.z()));
    level.scan.values[v] = grey(p.x() - std::sin(kPi * p.y() / size), p.y(), p.z());
  }
  const size_t voxels = level.grid.VoxelCount();
  level.weight.assign(voxels, 1), level.mobility.assign(voxels, 1);
  level.stiffness.assign(voxels / 8, 1), level.firmness.assign(voxels / 8, 1);
  level.active.clear();
  for (size_t c = 0; c < voxels / 8; ++c) level.active.push_back(cl_int(c));
  level.visible = level.active;
  level.bending = 3;
  return level;
}

// Stiff tissue carries a step no farther than its block reaches.
TEST(RegisterLevel, WideBlocksTakeUpLongWavesSooner) {
  const BlockLevel level = MovedByALongWave(64);
  const auto left_mm = [&](const SweepCounts& sweeps) {
    std::vector<FieldVector> field(level.grid.VoxelCount(), FieldVector::Zero());
    RegisterLevel(level, SharedBackend(), {}, sweeps, false, field);
    double sum = 0, count = 0;
    for (size_t v = 0; v < field.size(); ++v) {
      const Eigen::Vector3i p = level.grid.Ijk(v);
      if (p.minCoeff() < 8 || p.maxCoeff() >= 56) continue;
      const Eigen::Vector3f moved(float(std::sin(kPi * p.y() / 64)), 0, 0);
      sum += (field[v].head<3>() - moved).norm(), count += 1;
    }
    return sum / count;
  };
  const double narrow = left_mm({2, 0}), wide = left_mm({2, 2});
  EXPECT_LT(wide, 0.8 * narrow) << narrow;
}

// Waves of eight voxels along every axis show each block of either lattice the same, so that every cell of
// the middle is known as well as the others, wherever in its blocks it lies.
TEST(RegisterLevel, VariancesDoNotShowTheLattice) {
  BlockLevel level = MovedByALongWave(48);
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v) {
    const Eigen::Array3d phase = level.grid.Ijk(v).cast<double>().array() * (kPi / 4);
    level.intensity[v] = level.scan.values[v] = float(phase.sin().sum());
  }
  level.bending = 30;
  std::vector<FieldVector> field(level.grid.VoxelCount(), FieldVector::Zero());
  const std::vector<float> variances_mm2 =
      RegisterLevel(level, SharedBackend(), {}, {1, 0}, true, field).variances_mm2;
  const Grid cells = Coarsened(level.grid, 2);
  float least = kNotKnown, most = 0;
  for (size_t c = 0; c < cells.VoxelCount(); ++c) {
    const Eigen::Vector3i p = cells.Ijk(c);
    if (p.minCoeff() < 10 || p.maxCoeff() >= 14) continue;
    least = std::min(least, variances_mm2[c]), most = std::max(most, variances_mm2[c]);
  }
  EXPECT_GT(least, 0);
  EXPECT_LT(most, 1.03f * least);
}

}  // namespace
}  // namespace kvx

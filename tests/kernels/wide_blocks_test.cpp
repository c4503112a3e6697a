// Blocks twice as wide against the blocks' twins: of their images, on balls whose cells are the eight of
// every wide cell; of the bending energy, on a level twice as coarse.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/block_world.h"

namespace kvx {
namespace {
using namespace testing_support;

const std::vector<cl_int4> kWideBlocks = {{{-6, -4, -8, 0}}, {{0, -2, -4, 0}}};

constexpr int kForce = 6 * 64 + 9 * 8, kForceEnd = kForce + 3 * 8;

BallBasis CellsOfWide(const BallBasis& ball) {
  BallBasis out;
  for (size_t c = 0; c < ball.cells.size(); ++c) {
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i p =
          2 * ToVector(ball.cells[c]) + Eigen::Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2);
      out.cells.push_back({{p.x(), p.y(), p.z(), 0}});
      out.cell_basis.push_back(ball.cell_basis[c]);
    }
  }
  return out;
}

// Whose voxels are the cells: what the bending energy knows of a level.
BlockWorld Coarse(const BlockWorld& world) {
  BlockWorld out;
  const Grid cells = Coarsened(world.level.grid, 2);
  out.level.grid = cells;
  out.level.bending = world.level.bending;
  out.level.mobility = CellMeans(world.level.grid, world.level.mobility);
  out.level.weight.assign(cells.VoxelCount(), 0);
  out.level.stiffness = CellMeans(cells, world.level.stiffness);
  out.field.assign(cells.VoxelCount(), FieldVector::Zero());
  std::vector<cl_int>& active = out.level.active;
  const Grid wide = Coarsened(cells, 2);
  for (const cl_int c : world.level.active) {
    const Eigen::Vector3i p = cells.Ijk(size_t(c));
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i v = 2 * p + Eigen::Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2);
      out.field[size_t(c)] += world.field[world.level.grid.Index(v.x(), v.y(), v.z())] / 8;
    }
    active.push_back(cl_int(wide.Index(p.x() / 2, p.y() / 2, p.z() / 2)));
  }
  std::sort(active.begin(), active.end());
  active.erase(std::unique(active.begin(), active.end()), active.end());
  return out;
}

std::vector<float> SomeWideSteps() {
  std::vector<float> steps(24);
  for (size_t n = 0; n < steps.size(); ++n) steps[n] = 0.6f * float(std::sin(2.0 + double(n)));
  return steps;
}

// Linear between the wide cells' centres, beyond the last as there.
reference::CellSteps AtCells(const BlockWorld& world, const reference::CellSteps& wide_steps) {
  const Grid cells = Coarsened(world.level.grid, 2), wide = Coarsened(cells, 2);
  reference::CellSteps out(cells.VoxelCount(), Eigen::Vector3d::Zero());
  for (size_t c = 0; c < out.size(); ++c) {
    const Eigen::Vector3d p = wide.Nearest(wide.ToVox(cells.ToMm(PointVox{cells.Ijk(c).cast<double>()}))).ijk;
    const Eigen::Vector3i lo = p.cast<int>().cwiseMin((wide.size.array() - 2).matrix());
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i at = lo + Eigen::Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2);
      const Eigen::Vector3d near = Eigen::Vector3d::Ones() - (p - at.cast<double>()).cwiseAbs();
      out[c] += near.prod() * wide_steps[wide.Index(at.x(), at.y(), at.z())];
    }
  }
  return out;
}

reference::CellSteps WideSteps(const BlockWorld& world) {
  const BlockWorld coarse = Coarse(world);
  reference::CellSteps out = NoSteps(coarse);
  reference::AddStep(coarse.level, world.ball, ToVector(kWideBlocks[1]), SomeWideSteps(), out);
  return out;
}

// `steps`: of the wide cells.
void ExpectWideEquations(BlockKernels& kernels, const BlockWorld& world, const reference::CellSteps& steps) {
  const BallBasis of_cells = CellsOfWide(world.ball);
  const BlockWorld coarse = Coarse(world);
  const auto seen = reference::SeenThrough(world.level, world.field);
  const Grid cells = Coarsened(world.level.grid, 2), wide = Coarsened(cells, 2);
  reference::CellSteps own(cells.VoxelCount());
  for (size_t c = 0; c < own.size(); ++c) {
    const Eigen::Vector3i p = cells.Ijk(c) / 2;
    own[c] = steps[wide.Index(p.x(), p.y(), p.z())];
  }
  const std::vector<float> equations = kernels.Equations(kWideBlocks, BlockWidth::kWide);
  for (size_t b = 0; b < kWideBlocks.size(); ++b) {
    const Eigen::Vector3i support = ToVector(kWideBlocks[b]);
    std::vector<double> twin =
        reference::Equations(world.level, of_cells, world.field, seen, own, 2 * support);
    const reference::Seen nothing(coarse.level.grid.VoxelCount());
    const std::vector<double> bent =
        reference::Equations(coarse.level, world.ball, coarse.field, nothing, steps, support);
    std::copy(bent.begin() + kForce, bent.begin() + kForceEnd, twin.begin() + kForce);
    double scale = 0, force = 0;
    for (const double value : twin) scale = std::max(scale, std::abs(value));
    for (int n = kForce; n < kForceEnd; ++n) force = std::max(force, std::abs(twin[n]));
    EXPECT_GT(force, 1e-3);
    for (int n = 0; n < kEquationValues; ++n) {
      const double own_scale = n >= 480 ? std::abs(twin[485]) : n >= kForce && n < kForceEnd ? force : scale;
      ASSERT_NEAR(equations[b * kEquationValues + n], twin[n], 3e-4 * own_scale) << "value " << n;
    }
  }
}

void ExpectWideSums(BlockKernels& kernels, const BlockWorld& world) {
  const std::vector<float> sums = kernels.Sums(kWideBlocks, BlockKernels::State::kField, BlockWidth::kWide);
  const auto seen = reference::SeenThrough(world.level, world.field);
  for (size_t b = 0; b < kWideBlocks.size(); ++b) {
    const auto twin =
        reference::Sums(world.level, CellsOfWide(world.ball), seen, 2 * ToVector(kWideBlocks[b]));
    for (int n = 0; n < kSumChannels; ++n)
      ExpectClose(sums[b * kSumChannels + n], twin[n], twin[5], "sum", n);
  }
}

TEST(WideBlocks, EquationsAndSumsAgreeWithTheirTwins) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  kernels.Restrict();
  ExpectWideEquations(kernels, world, NoSteps(Coarse(world)));
  ExpectWideSums(kernels, world);
}

// The last wide cells hold fewer.
TEST(WideBlocks, SumsOfAnOddNumberOfCellsAgreeWithTheirTwins) {
  const BlockWorld world = MakeBlockWorld({38, 36, 30});
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  ExpectWideSums(kernels, world);
}

TEST(WideBlocks, StepsChangeTheEquationsOfWideBlocks) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  kernels.Restrict();
  kernels.AddSteps({&kWideBlocks[1], 1}, SomeWideSteps(), BlockWidth::kWide);
  ExpectWideEquations(kernels, world, WideSteps(world));
}

// Of the others and of the field once they are accepted, and of what the trial shows.
TEST(WideBlocks, StepsBecomeThoseOfTheCells) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  kernels.Restrict();
  kernels.AddSteps({&kWideBlocks[1], 1}, SomeWideSteps(), BlockWidth::kWide);
  kernels.Prolong();
  const reference::CellSteps steps = AtCells(world, WideSteps(world));
  ExpectEquations(kernels, world, steps);
  kernels.Try();
  const auto twin = reference::Composed(world.level, world.field, steps);
  const auto seen = reference::SeenThrough(world.level, twin);
  const auto twin_sums =
      reference::Sums(world.level, CellsOfWide(world.ball), seen, 2 * ToVector(kWideBlocks[1]));
  const std::vector<float> sums =
      kernels.Sums({&kWideBlocks[1], 1}, BlockKernels::State::kTrial, BlockWidth::kWide);
  for (int n = 0; n < kSumChannels; ++n) ExpectClose(sums[n], twin_sums[n], twin_sums[5], "sum", n);
  kernels.Accept();
  const std::vector<FieldVector> field = kernels.Field();
  float moved = 0;
  for (size_t v = 0; v < field.size(); ++v) {
    ASSERT_LT((field[v] - twin[v]).norm(), 2e-4) << "voxel " << v;
    moved = std::max(moved, (field[v] - world.field[v]).norm());
  }
  EXPECT_GT(moved, 0.3);
}

// What wide blocks have given once is not given again.
TEST(WideBlocks, StepsTakenBackLeaveNothing) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  std::vector<float> steps = SomeWideSteps();
  for (int time = 0; time < 2; ++time) {
    kernels.Restrict();
    kernels.AddSteps({&kWideBlocks[1], 1}, steps, BlockWidth::kWide);
    kernels.Prolong();
    kernels.Try();
    for (float& f : steps) f = -f;
  }
  kernels.Accept();
  const std::vector<FieldVector> field = kernels.Field();
  for (size_t v = 0; v < field.size(); ++v)
    ASSERT_LT((field[v] - world.field[v]).norm(), 1e-5) << "voxel " << v;
}

TEST(WideBlocks, TheMeanOfTheLastOfAnOddNumberIsOfFewer) {
  const Grid grid = [] {
    Grid out;
    out.size = {3, 1, 1};
    return out;
  }();
  const std::vector<float> values = {1, 3, 8};
  EXPECT_EQ(CellMeans(grid, values), (std::vector<float>{2, 8}));
}

}  // namespace
}  // namespace kvx

// The block kernels against their plain-loop twins on an oblique,
// anisotropic level with bone, air and a field of view that ends.
#include "kernels/block_kernels.h"

#include <gtest/gtest.h>

#include <numeric>

#include "kernels/reference/block_moments.h"
#include "tests/support/block_world.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(BlockKernels, EquationsAndSumsAgreeWithTheirTwins) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  ExpectEquations(kernels, world, NoSteps(world));
  const std::vector<float> sums = kernels.Sums(kSomeBlocks, BlockKernels::State::kField);
  const auto seen = reference::SeenThrough(world.level, world.field);
  for (size_t b = 0; b < kSomeBlocks.size(); ++b) {
    const auto twin = reference::Sums(world.level, world.ball, seen, ToVector(kSomeBlocks[b]));
    for (int n = 0; n < kSumChannels; ++n)
      ExpectClose(sums[b * kSumChannels + n], twin[n], twin[5], "sum", n);
  }
}

// Slopes are those of the template's intensities as before.
TEST(BlockKernels, EquationsTakeOtherTargetsAndWeights) {
  BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  std::vector<float> targets = world.level.intensity, weights = world.level.weight;
  for (size_t v = 0; v < targets.size(); ++v) {
    targets[v] += 0.5f * float(std::sin(double(v)));
    weights[v] *= 1.5f + float(std::cos(double(v)));
  }
  kernels.SetTargets(targets, weights);
  kernels.Linearise();
  const BlockLevel as_it_was = world.level;
  world.level.weight = weights;
  ExpectEquations(kernels, world, NoSteps(world), targets);
  BlockKernels others(SharedBackend(), as_it_was, world.ball, world.field);
  const std::vector<float> seen = others.Seen();
  const auto twin = reference::SeenThrough(as_it_was, world.field);
  for (const cl_int c : as_it_was.visible) {
    const Eigen::Vector3i p = 2 * Coarsened(as_it_was.grid, 2).Ijk(size_t(c));
    const size_t v = as_it_was.grid.Index(p.x(), p.y(), p.z());
    if (twin[v])
      ASSERT_NEAR(seen[v], *twin[v], 1e-3) << v;
    else
      ASSERT_EQ(seen[v], kUnseen) << v;
  }
}

TEST(BlockKernels, EquationsAreTheSameHoweverManyLanesAddThemUp) {
  const BlockWorld world = MakeBlockWorld();
  for (const int lanes : {1, 2, 32}) {
    BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field, lanes);
    kernels.Linearise();
    ExpectEquations(kernels, world, NoSteps(world));
  }
}

// Both images are the function of x, and every voxel stays where it is; the scan ends after so many planes.
template <class Function>
BlockLevel LevelOf(Function of_x, int scan_planes) {
  BlockLevel level;
  level.grid.size = {32, 32, 32};
  level.grid.spacing_mm = {2, 2, 2};
  Grid scan = level.grid;
  scan.size.x() = scan_planes;
  level.scan = Volume(scan);
  for (size_t v = 0; v < scan.VoxelCount(); ++v) level.scan.values[v] = of_x(scan.Ijk(v).x());
  const size_t voxels = level.grid.VoxelCount();
  for (size_t v = 0; v < voxels; ++v) {
    const Eigen::Vector3i p = level.grid.Ijk(v);
    level.intensity.push_back(of_x(p.x()));
    level.start.push_back({float(p.x()), float(p.y()), float(p.z()), 0});
  }
  level.weight.assign(voxels, 1.0f);
  level.mobility.assign(voxels, 1.0f);
  level.stiffness.assign(voxels / 8, 1.0f);
  for (size_t c = 0; c < voxels / 8; ++c)
    level.active.push_back(cl_int(c)), level.visible.push_back(cl_int(c));
  return level;
}

// Of the block in the middle of such a level.
std::vector<float> EquationsOf(const BlockLevel& level, const BallBasis& ball) {
  BlockKernels kernels(SharedBackend(), level, ball,
                       std::vector<FieldVector>(level.grid.VoxelCount(), FieldVector::Zero()));
  kernels.Linearise();
  return kernels.Equations(std::vector<cl_int4>{{{4, 4, 4, 0}}});
}

// At its zeros the spline through 0, 1, 0, -1, ... rises by 1.5 a voxel; a difference over two voxels says 1.
TEST(BlockKernels, AWaveOfFourVoxelsIsAsSteepAsItsSpline) {
  const auto wave = [](int x) { return x % 2 == 0 ? 0.0f : x % 4 == 1 ? 1.0f : -1.0f; };
  const BallBasis ball = MakeBallBasis(BlockSpline());
  const std::vector<float> equations = EquationsOf(LevelOf(wave, 32), ball);
  double basis_squared = 0;
  for (const auto& phi : ball.cell_basis) basis_squared += double(phi[0]) * phi[0];
  // Of the eight voxels of a cell four lie at zeros.
  EXPECT_NEAR(equations[0], 4 * std::pow(1.5 / 2, 2) * basis_squared, 1e-3 * basis_squared);
  EXPECT_NEAR(equations[3 * 64], 0, 1e-6 * basis_squared);  // across
}

// A ramp of 1 a voxel, 0.5 a mm: as steep in the last plane that the scan shows as elsewhere.
TEST(BlockKernels, ASlopeGoesOnToTheLastPlaneThatTheScanShows) {
  constexpr int kPlanes = 16;
  const BallBasis ball = MakeBallBasis(BlockSpline());
  const std::vector<float> equations = EquationsOf(LevelOf([](int x) { return float(x); }, kPlanes), ball);
  double basis_squared = 0;  // of the cells that it shows; the support begins at voxel 4
  for (size_t c = 0; c < ball.cells.size(); ++c) {
    const double phi = ball.cell_basis[c][0];
    if (4 + 2 * ball.cells[c].s[0] < kPlanes) basis_squared += phi * phi;
  }
  EXPECT_NEAR(equations[0], 8 * 0.5 * 0.5 * basis_squared, 1e-3 * basis_squared);
}

// The force along x in all control points of a block, of a field of 1 mm that goes on beyond the active
// cells.
double SumOfForces(std::span<const float> equations) {
  const auto first = equations.begin() + 6 * 64 + 9 * 8;
  return std::accumulate(first, first + 8, 0.0);
}

// Such a field has no curvature; there is a force only as the active cells' neighbours count as 0.
TEST(BlockKernels, TheFieldBeyondTheActiveCellsCountsAsZero) {
  BlockLevel level = MakeBlockWorld().level;
  level.stiffness.assign(level.stiffness.size(), 1.0f);
  level.mobility.assign(level.mobility.size(), 1.0f);
  const Grid cells = Coarsened(level.grid, 2);
  std::erase_if(level.active, [&](cl_int c) { return cells.Ijk(size_t(c)).x() > 10; });
  std::erase_if(level.visible, [&](cl_int c) { return cells.Ijk(size_t(c)).x() > 10; });
  const BallBasis ball = MakeBallBasis(BlockSpline());
  const std::vector<FieldVector> field(level.grid.VoxelCount(), FieldVector(1, 0, 0, 0));
  BlockKernels kernels(SharedBackend(), level, ball, field);
  kernels.Linearise();
  const std::vector<cl_int4> blocks = {{{8, 6, 4, 0}}};
  const auto twin = reference::Equations(
      level, ball, field, reference::SeenThrough(level, field),
      reference::CellSteps(level.stiffness.size(), Eigen::Vector3d::Zero()), ToVector(blocks[0]));
  const double force = SumOfForces(kernels.Equations(blocks));
  EXPECT_GT(std::abs(force), 1);
  EXPECT_NEAR(SumOfForces(std::vector<float>(twin.begin(), twin.end())), force, 1e-3 * std::abs(force));
}

const std::vector<cl_int4> kDisjoint = {{{8, 4, 4, 0}}, {{-16, 4, 4, 0}}};
const std::vector<cl_int4> kAtCorners = {{{-8, -8, -8, 0}}, {{24, 20, 16, 0}}};

std::vector<float> SomeSteps() {
  std::vector<float> steps(48);
  for (size_t n = 0; n < steps.size(); ++n) steps[n] = 0.8f * float(std::sin(1.0 + double(n)));
  return steps;
}

reference::CellSteps TwinSteps(const BlockWorld& world, const std::vector<float>& steps,
                               const std::vector<cl_int4>& blocks = kDisjoint) {
  reference::CellSteps out = NoSteps(world);
  for (size_t b = 0; b < blocks.size(); ++b) {
    const std::vector<float> own(steps.begin() + long(24 * b), steps.begin() + long(24 * b + 24));
    reference::AddStep(world.level, world.ball, ToVector(blocks[b]), own, out);
  }
  return out;
}

// Images are linear within a sweep: sums brought up to date per cell equal sums over displaced voxels.
TEST(BlockKernels, StepsChangeTheEquationsOfAllBlocksThatTheyReach) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  kernels.AddSteps(kDisjoint, SomeSteps());
  ExpectEquations(kernels, world, TwinSteps(world, SomeSteps()));
}

// What is kept of the bending energy between two questions is of the field as it is.
TEST(BlockKernels, EquationsThatWereAskedForBeforeFollowTheField) {
  const BlockWorld world = MakeBlockWorld();
  for (const bool accepted : {false, true}) {
    BlockKernels asked(SharedBackend(), world.level, world.ball, world.field),
        unasked(SharedBackend(), world.level, world.ball, world.field);
    for (BlockKernels* kernels : {&asked, &unasked}) kernels->Linearise();
    const std::vector<float> before = asked.Equations(kDisjoint);
    EXPECT_EQ(asked.Equations(kDisjoint), before);
    for (BlockKernels* kernels : {&asked, &unasked}) kernels->AddSteps(kDisjoint, SomeSteps());
    if (accepted) {
      asked.Equations(kDisjoint);
      for (BlockKernels* kernels : {&asked, &unasked}) kernels->Accept(), kernels->Linearise();
    }
    EXPECT_EQ(asked.Equations(kDisjoint), unasked.Equations(kDisjoint)) << accepted;
  }
}

class ComposedSteps : public testing::TestWithParam<std::vector<cl_int4>> {};

TEST_P(ComposedSteps, AreInTheFieldOnceAccepted) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  kernels.AddSteps(GetParam(), SomeSteps());
  kernels.Try();
  const auto twin = reference::Composed(world.level, world.field, TwinSteps(world, SomeSteps(), GetParam()));
  const auto seen = reference::SeenThrough(world.level, twin);
  const auto twin_sums = reference::Sums(world.level, world.ball, seen, ToVector(GetParam()[0]));
  const std::vector<float> sums = kernels.Sums(GetParam(), BlockKernels::State::kTrial);
  for (int n = 0; n < kSumChannels; ++n) ExpectClose(sums[n], twin_sums[n], twin_sums[5], "sum", n);
  EXPECT_EQ(kernels.Field(), world.field);
  kernels.Accept();
  const std::vector<FieldVector> field = kernels.Field();
  double moved = 0;
  for (size_t v = 0; v < field.size(); ++v) {
    ASSERT_LT((field[v] - twin[v]).norm(), 1e-4) << "voxel " << v;
    moved = std::max<double>(moved, (field[v] - world.field[v]).norm());
  }
  EXPECT_GT(moved, 0.5);
}

INSTANTIATE_TEST_SUITE_P(BlockKernels, ComposedSteps, testing::Values(kDisjoint, kAtCorners));

TEST(BlockKernels, AStepTakenBackLeavesNothing) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  std::vector<float> steps = SomeSteps();
  kernels.AddSteps(kDisjoint, steps);
  kernels.Try();
  for (float& f : steps) f = -f;
  kernels.AddSteps(kDisjoint, steps);
  kernels.Accept();
  const std::vector<FieldVector> field = kernels.Field();
  for (size_t v = 0; v < field.size(); ++v)
    ASSERT_LT((field[v] - world.field[v]).norm(), 1e-5) << "voxel " << v;
}

// Only what steps have changed is composed and looked at again.
TEST(BlockKernels, StepsAfterATrialGiveWhatAllStepsGiveAtOnce) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels at_once(SharedBackend(), world.level, world.ball, world.field);
  BlockKernels by_and_by(SharedBackend(), world.level, world.ball, world.field);
  const std::vector<float> all = SomeSteps(), near(all.begin(), all.begin() + 24);
  const std::vector<cl_int4> first = {kDisjoint[0]}, second = {{{24, 20, 16, 0}}};
  for (BlockKernels* kernels : {&at_once, &by_and_by}) {
    kernels->Linearise();
    kernels->AddSteps(first, near);
    if (kernels == &by_and_by) kernels->Try();
    kernels->AddSteps(second, near);
    kernels->Try();
  }
  EXPECT_EQ(by_and_by.Sums(kSomeBlocks, BlockKernels::State::kTrial),
            at_once.Sums(kSomeBlocks, BlockKernels::State::kTrial));
  by_and_by.Accept();
  at_once.Accept();
  const std::vector<FieldVector> field = by_and_by.Field();
  EXPECT_EQ(field, at_once.Field());
  EXPECT_NE(field, world.field);
  EXPECT_EQ(by_and_by.TakeField(), field);
}

// What a sweep leaves behind must not come back in the next, which moves something else.
TEST(BlockKernels, ASecondSweepStartsFromTheFirst) {
  const BlockWorld world = MakeBlockWorld();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  std::vector<FieldVector> field = world.field;
  const std::vector<float> all = SomeSteps(), steps(all.begin(), all.begin() + 24);
  for (const cl_int4& block : {kDisjoint[0], cl_int4{{24, 20, 16, 0}}, cl_int4{{0, 16, 4, 0}}}) {
    kernels.Linearise();
    kernels.AddSteps(std::vector{block}, steps);
    if (block.s[0] != 24) kernels.Try();  // the second sweep is accepted untried
    kernels.Accept();
    reference::CellSteps twin = NoSteps(world);
    reference::AddStep(world.level, world.ball, ToVector(block), steps, twin);
    field = reference::Composed(world.level, field, twin);
  }
  const std::vector<FieldVector> after = kernels.Field();
  for (size_t v = 0; v < field.size(); ++v) ASSERT_LT((after[v] - field[v]).norm(), 3e-4) << "voxel " << v;
  kernels.Linearise();
  const std::vector<float> sums = kernels.Sums(kSomeBlocks, BlockKernels::State::kField);
  const auto seen = reference::SeenThrough(world.level, field);
  for (size_t b = 0; b < kSomeBlocks.size(); ++b) {
    const auto twin = reference::Sums(world.level, world.ball, seen, ToVector(kSomeBlocks[b]));
    for (int n = 0; n < kSumChannels; ++n)
      ExpectClose(sums[b * kSumChannels + n], twin[n], twin[5], "sum", n);
  }
}

// There the field counts as 0 again once they are accepted.
TEST(BlockKernels, StepsBeyondTheActiveCellsEndWithTheirSweep) {
  BlockWorld world = MakeBlockWorld();
  world.level.bending = 1e6;  // the force is what counts
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  kernels.AddSteps(kAtCorners, SomeSteps());
  kernels.Accept();
  kernels.Linearise();
  world.field = kernels.Field();
  ExpectEquations(kernels, world, NoSteps(world));
}

// A step that is the same at all control points, once accepted, is held back the same at all of them: neither
// end of an axis is the first.
TEST(BlockKernels, ABendIsHeldBackAlikeFromAllSides) {
  BlockLevel level = MakeBlockWorld().level;
  level.grid.size = {48, 48, 48};
  const size_t voxels = level.grid.VoxelCount();
  level.start.assign(voxels, FieldVector::Zero());
  level.intensity.assign(voxels, 0), level.weight.assign(voxels, 0), level.mobility.assign(voxels, 1);
  level.stiffness.assign(voxels / 8, 1);
  level.active.resize(voxels / 8), level.visible.clear();
  std::iota(level.active.begin(), level.active.end(), 0);
  level.visible.push_back(0);
  const std::vector<cl_int4> blocks = {{{12, 12, 12, 0}}};
  BlockKernels kernels(SharedBackend(), level, MakeBallBasis(BlockSpline()),
                       std::vector<FieldVector>(voxels, FieldVector::Zero()));
  kernels.Linearise();
  std::vector<float> steps(24, 0.0f);
  std::fill_n(steps.begin(), kControlPoints, 1.0f);
  kernels.AddSteps(blocks, steps);
  kernels.Accept();
  kernels.Linearise();
  const std::vector<float> equations = kernels.Equations(blocks);
  const float* force = &equations[6 * 64 + 9 * 8];
  EXPECT_GT(force[0], 0.1);
  for (int a = 1; a < kControlPoints; ++a) EXPECT_NEAR(force[a], force[0], 0.02 * force[0]) << a;
}

// A translation of every control point by the same amount moves the block's centre by nearly that amount.
TEST(BlockKernels, TheBallBasisCoversTheBallAndNothingElse) {
  const BallBasis ball = MakeBallBasis(BlockSpline());
  ASSERT_EQ(ball.voxels.size(), 8 * ball.cells.size());
  EXPECT_NEAR(double(ball.voxels.size()), 4.0 / 3.0 * kPi * 12 * 12 * 12, 200);
  float centre = 0;
  for (size_t n = 0; n < ball.cells.size(); ++n) {
    for (int a = 0; a < 3; ++a)
      ASSERT_TRUE(ball.cells[n].s[a] >= 0 && 2 * ball.cells[n].s[a] < kSupportVoxels);
    if (ball.cells[n].s[0] != 6 || ball.cells[n].s[1] != 6 || ball.cells[n].s[2] != 6) continue;
    for (const float phi : ball.cell_basis[n]) centre += phi;
  }
  EXPECT_NEAR(centre, 1.15f, 0.2f);
}

TEST(BlockKernels, SamplesAddUpToTheTwinsSums) {
  BlockWorld world = MakeBlockWorld();
  for (float& w : world.level.weight) w = w > 0 ? 1 : 0;
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  const std::vector<float> samples = kernels.Samples(kSomeBlocks, BlockKernels::State::kField);
  const auto seen = reference::SeenThrough(world.level, world.field);
  const size_t run = kernels.VoxelsPerBall();
  ASSERT_EQ(samples.size(), 3 * run * kSomeBlocks.size());
  for (size_t b = 0; b < kSomeBlocks.size(); ++b) {
    const auto twin = reference::Sums(world.level, world.ball, seen, ToVector(kSomeBlocks[b]));
    double n = 0, ts = 0, ss = 0;
    for (size_t v = 0; v < run; ++v) {
      const double t = samples[3 * run * b + v], s = samples[(3 * b + 1) * run + v];
      n += samples[(3 * b + 2) * run + v], ts += t * s, ss += s * s;
    }
    EXPECT_NEAR(n, twin[0], 0.001 * double(run));
    ExpectClose(ts, twin[4], 20 * std::sqrt(twin[3] * twin[5]), "t s", b);
    ExpectClose(ss, twin[5], 20 * twin[5], "s s", b);
  }
}

}  // namespace
}  // namespace kvx

// A block's equations against the squares that they are made of: slopes and curvatures are differences of
// these once the block has moved and the scan has been read again.
#include <gtest/gtest.h>

#include <numeric>

#include "core/voxels/voxel_box.h"
#include "tests/support/block_world.h"

namespace kvx {
namespace {
using namespace testing_support;
using Eigen::Matrix3d, Eigen::Vector3d, Eigen::Vector3i;

constexpr int kVoxels = 64, kScanVoxels = 96;
constexpr int kStepValues = 3 * kControlPoints;

// Scan voxels by voxels, and mm by voxels.
const Matrix3d kStart = Matrix3d{{1, 0.06, 0}, {0, 1, -0.06}, {0.06, -0.06, 1}};
const Matrix3d kField = Matrix3d{{0, 0, 0.02}, {0.02, 0, 0}, {0, -0.02, 0}};

// All of it counts and moves. An affine start and an affine field show a scan that is a function of one
// phase, linear in place, far from the scan's ends, and the template shows the same. Mobility is anything,
// and weights are its power.
template <class Function>
BlockWorld AffineWorld(const Vector3d& phase_per_scan_voxel, Function grey_at, int weight_power) {
  BlockWorld world;
  BlockLevel& level = world.level;
  level.grid = ObliqueGrid(Vector3i::Constant(kVoxels));
  level.scan = Volume(ObliqueGrid(Vector3i::Constant(kScanVoxels)));
  const Vector3d middle = Vector3d::Constant(kVoxels / 2), scan_middle = Vector3d::Constant(kScanVoxels / 2);
  for (size_t v = 0; v < level.scan.values.size(); ++v) {
    const Vector3d from_middle = level.scan.grid.Ijk(v).cast<double>() - scan_middle;
    level.scan.values[v] = float(grey_at(phase_per_scan_voxel.dot(from_middle)));
  }
  std::mt19937 random(5);
  std::uniform_real_distribution<float> mobility(0.3f, 1.0f);
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v) {
    const Vector3d from_middle = level.grid.Ijk(v).cast<double>() - middle;
    level.start.emplace_back(0, 0, 0, 0), world.field.emplace_back(0, 0, 0, 0);
    level.start.back().head<3>() = (scan_middle + kStart * from_middle).cast<float>();
    world.field.back().head<3>() = (Vector3d(0.4, -0.3, 0.2) + kField * from_middle).cast<float>();
    level.mobility.push_back(mobility(random));
    level.weight.push_back(float(std::pow(level.mobility.back(), weight_power)));
  }
  level.active.resize(level.grid.VoxelCount() / 8);
  std::iota(level.active.begin(), level.active.end(), 0);
  level.visible = level.active;
  level.stiffness.assign(level.active.size(), 1.0f);
  for (const auto& grey : reference::SeenThrough(level, world.field))
    level.intensity.push_back(float(grey.value_or(0)));
  return world;
}

// How the phase that such a level shows rises, per voxel of the level.
Vector3d PhasePerVoxel(const Vector3d& per_scan_voxel, const Grid& grid) {
  return (kStart * (Matrix3d::Identity() + grid.VoxFromMm() * kField)).transpose() * per_scan_voxel;
}

// 1/2 sum w (s - gain t - bias)^2.
double Squares(const BlockLevel& level, const std::vector<float>& seen, double gain, double bias) {
  double sum = 0;
  for (size_t v = 0; v < seen.size(); ++v) {
    const double off = double(seen[v]) - gain * double(level.intensity[v]) - bias;
    sum += 0.5 * double(level.weight[v]) * off * off;
  }
  return sum;
}

// One block in the middle of such a level, as wide as others or twice that.
class BlockKernelsSlopes : public testing::TestWithParam<BlockWidth> {
 protected:
  static bool Wide() { return GetParam() == BlockWidth::kWide; }
  static std::vector<cl_int4> Block() { return {Wide() ? cl_int4{{4, 4, 4, 0}} : cl_int4{{20, 20, 20, 0}}}; }
  static std::vector<float> Equations(BlockKernels& kernels) {
    kernels.Linearise();
    if (Wide()) kernels.Restrict();
    return kernels.Equations(Block(), GetParam());
  }
  // The squares that the images have, the block having taken this step.
  static double Squares(BlockKernels& kernels, const BlockWorld& world, const std::vector<float>& step_mm,
                        double gain, double bias) {
    kernels.Linearise();
    if (Wide()) kernels.Restrict();
    kernels.AddSteps(Block(), step_mm, GetParam());
    if (Wide()) kernels.Prolong();
    kernels.Try();
    return kvx::Squares(world.level, SeenOnTrial(kernels, world), gain, bias);
  }

 private:
  // Balls one beside the other hold every voxel that moves; the others count as in agreement.
  static std::vector<float> SeenOnTrial(BlockKernels& kernels, const BlockWorld& world) {
    std::vector<cl_int4> balls;
    const int first = Wide() ? 0 : 12, count = Wide() ? 6 : 3;
    ForEachVoxel(VoxelBox{Vector3i::Zero(), Vector3i::Constant(count)}, [&](const Vector3i& p) {
      balls.push_back({{first + 8 * p.x(), first + 8 * p.y(), first + 8 * p.z(), 0}});
    });
    const std::vector<float> samples = kernels.Samples(balls, BlockKernels::State::kTrial);
    const size_t run = kernels.VoxelsPerBall();
    std::vector<float> seen = world.level.intensity;
    for (size_t ball = 0; ball < balls.size(); ++ball) {
      for (size_t n = 0; n < run; ++n) {
        const Vector3i p = ToVector(balls[ball]) + ToVector(world.ball.voxels[n]);
        if (samples[(3 * ball + 2) * run + n] > 0)
          seen[world.level.grid.Index(p.x(), p.y(), p.z())] = samples[(3 * ball + 1) * run + n];
      }
    }
    return seen;
  }
};
INSTANTIATE_TEST_SUITE_P(BlockKernels, BlockKernelsSlopes,
                         testing::Values(BlockWidth::kOwn, BlockWidth::kWide),
                         [](const auto& width) { return width.param == BlockWidth::kOwn ? "Own" : "Twice"; });

std::vector<float> Only(size_t n, float mm) {
  std::vector<float> step_mm(kStepValues, 0.0f);
  step_mm[n] = mm;
  return step_mm;
}

// On a ramp squares are quadratic in a step, so that central differences are exact, and both images are
// equally steep. A cell's voxels move by its own step and by those of the cells beside it; where weight times
// mobility is the same everywhere, what they say of a residual that is linear in place adds up to what they
// would say if each moved as its cell. So only rounding is left, of sums of squares of 60 greys in single
// precision.
TEST_P(BlockKernelsSlopes, TheRightSideIsTheSlopeOfTheSquares) {
  const BlockWorld world = AffineWorld(
      {0.4, -0.3, 0.5}, [](double phase) { return phase; }, -1);
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  const std::vector<float> equations = Equations(kernels);
  constexpr float kStepMm = 0.5f;
  constexpr double kGain = 0.8, kBias = 2;
  std::vector<double> slopes, quotients;
  double largest = 0;
  for (size_t n = 0; n < kStepValues; ++n) {
    const double up = Squares(kernels, world, Only(n, kStepMm), kGain, kBias),
                 down = Squares(kernels, world, Only(n, -kStepMm), kGain, kBias);
    quotients.push_back((up - down) / (2 * double(kStepMm)));
    largest = std::max(largest, std::abs(quotients.back()));
    const float* of = &equations[384 + n];  // J s, J t, J
    slopes.push_back(of[0] - kGain * of[kStepValues] - kBias * of[2 * kStepValues]);
  }
  for (size_t n = 0; n < kStepValues; ++n) EXPECT_NEAR(slopes[n], quotients[n], 1e-4 * largest) << n;
}

// What is left of a curvature between cells, for a step that is so much at the control points. Voxels lie a
// quarter of a cell beside its middle and move by three quarters of its step and a quarter of the next one's:
// on a line of cells their squares add up to 5/8 of each cell's step with itself and 3/16 with either next
// one's. Cells take those of wide cells in the same way.
double LeftBetweenCells(const BallBasis& ball, const Eigen::Matrix<double, kControlPoints, 1>& step,
                        bool wide) {
  const Vector3d shares = wide ? Vector3d(145, 54, 1.5) / 256 : Vector3d(160, 48, 0) / 256;
  Grid box;  // two cells more on every side
  box.size.setConstant(kSupportVoxels / 2 + 4);
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(Eigen::Index(box.VoxelCount()));
  for (size_t c = 0; c < ball.cells.size(); ++c) {
    const Vector3i p = ToVector(ball.cells[c]) + Vector3i::Constant(2);
    double& here = moved[Eigen::Index(box.Index(p.x(), p.y(), p.z()))];
    for (int a = 0; a < kControlPoints; ++a) here += step[a] * double(ball.cell_basis[c][size_t(a)]);
  }
  Eigen::VectorXd spread = moved;
  for (const size_t stride : {box.Index(1, 0, 0), box.Index(0, 1, 0), box.Index(0, 0, 1)}) {
    const Eigen::VectorXd before = spread;
    for (Eigen::Index n = 0; n < before.size(); ++n) {
      spread[n] *= shares[0];
      for (const Eigen::Index cells : {-2, -1, 1, 2}) {
        const Eigen::Index other = n + cells * Eigen::Index(stride);
        if (other >= 0 && other < before.size()) spread[n] += shares[std::abs(cells)] * before[other];
      }
    }
  }
  return moved.dot(spread) / moved.squaredNorm();
}

double Curvature(const std::vector<float>& equations, const std::vector<float>& step_mm) {
  constexpr int kPair[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
  double sum = 0;
  for (int n = 0; n < kStepValues; ++n) {
    for (int m = 0; m < kStepValues; ++m) {
      const int at = 64 * kPair[n / 8][m / 8] + 8 * (n % 8) + m % 8;
      sum += double(step_mm[size_t(n)]) * double(step_mm[size_t(m)]) * double(equations[size_t(at)]);
    }
  }
  return sum;
}

// Eight along one axis at one control point each, and four of everything.
std::vector<float> SomeStep(int trial) {
  if (trial < 8) return Only(size_t(5 * trial % kStepValues), 0.3f);
  std::vector<float> step_mm(kStepValues);
  for (int n = 0; n < kStepValues; ++n) step_mm[size_t(n)] = 0.2f * float(std::sin(1.0 + trial * n));
  return step_mm;
}

// Of a wave of k rad per voxel the differences over two and four voxels are k^2 / 12 too steep, and as its
// slope changes from voxel to voxel a curvature is off by up to k^2 / 2, or 5/2 k^2 where cells are twice as
// wide. The wave has one direction, so that a step moves it as a scalar does.
TEST_P(BlockKernelsSlopes, TheMatrixIsTheCurvatureOfTheSquaresWhereImagesAgree) {
  const Vector3d wave = (Wide() ? 0.5 : 1.0) * Vector3d(0.07, -0.05, 0.06);
  const BlockWorld world = AffineWorld(
      wave, [](double phase) { return 20 * std::sin(phase); }, -2);
  const Vector3d per_voxel = PhasePerVoxel(wave, world.level.grid),
                 per_mm = world.level.grid.VoxFromMm().transpose() * per_voxel;
  const double bent = (Wide() ? 3 : 1) * per_voxel.squaredNorm();
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  const std::vector<float> equations = Equations(kernels);
  for (int trial = 0; trial < 12; ++trial) {
    const std::vector<float> there = SomeStep(trial);
    std::vector<float> back = there;
    for (float& mm : back) mm = -mm;
    Eigen::Matrix<double, kControlPoints, 1> along;
    for (size_t a = 0; a < kControlPoints; ++a)
      along[Eigen::Index(a)] = per_mm.dot(Vector3d(there[a], there[8 + a], there[16 + a]));
    const double quotient =
        Squares(kernels, world, there, 1, 0) + Squares(kernels, world, back, 1, 0);  // 0 in between
    const double part = quotient / Curvature(equations, there);
    EXPECT_NEAR(part, LeftBetweenCells(world.ball, along, Wide()), bent) << trial;
  }
}

}  // namespace
}  // namespace kvx

// A block of tissue between two plates of bone, one of which slides along the other: a shear on paper.
#include "pipeline/model/pose_equilibrium.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/numbers/smooth_step.h"
#include "pipeline/posing/brick_body.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using Eigen::Vector3d, Eigen::Vector3i;
using testing_support::SharedBackend;

const Vector3i kVoxels(56, 44, 44);
constexpr int kFirstSoft = 12, kSoftEnd = 44;  // along x

struct Block {
  Mask body;
  LabelMap bones;
  WeightMap weights;  // the further through the tissue, smoothly, the more of the second plate
  std::vector<PoseVector> scan_poses;
  BrickedBody bricked;                                    // of the examples
  std::vector<Eigen::MatrixXf> known_from, without_scan;  // as is: scans say nothing of elastic tissue
  ExampleMoments moments;

  explicit Block(const Vector3d& spacing_mm = {1, 1, 1},
                 const Eigen::Matrix3d& direction = Eigen::Matrix3d::Identity()) {
    Grid grid;
    grid.size = kVoxels;
    grid.spacing_mm = spacing_mm;
    grid.direction = direction;
    if (!direction.isIdentity()) grid.origin.lps = {-120, 340, 55};
    body = Mask(grid, 1);
    bones = LabelMap(grid);
    weights = WeightMap(grid);
    for (size_t v = 0; v < grid.VoxelCount(); ++v) {
      const int x = grid.Ijk(v).x();
      bones.values[v] = x < kFirstSoft ? 1 : x >= kSoftEnd ? 2 : 0;
      weights.values[v] = {{0, 1, 0, 0}, {float(1 - SecondsShare(x)), float(SecondsShare(x)), 0, 0}};
    }
  }
  static double SecondsShare(int x) { return SmoothStep(kFirstSoft, kSoftEnd - 1, x); }
  static PoseVector Slid(double mm, const Vector3d& along = Vector3d::UnitY()) {
    return {RigidTransform{}, {Eigen::Quaterniond::Identity(), mm * along}};
  }
  ResolvedPose Asked(const PoseVector& pose, const std::vector<float>& coefficients = {}) const {
    ResolvedPose out{pose, Eigen::MatrixXf::Zero(2, Eigen::Index(scan_poses.size())),
                     Eigen::VectorXd::Zero(2), true};
    for (size_t k = 0; k < coefficients.size(); ++k)
      out.coefficients.col(Eigen::Index(k)).setConstant(coefficients[k]);
    return out;
  }
  PoseEquilibrium Equilibrium() const {
    return {{body, bones, weights, bricked, scan_poses, known_from, without_scan, moments}, SharedBackend()};
  }
};

double Largest(const AddedDisplacement& added) {
  double most = 0;
  for (const Eigen::Vector3f& d : added.voxels) most = std::max(most, double(d.norm()));
  return most;
}

// From the last layer of one plate to the first of the other.
double ShearedMm(int x, double slid_mm) {
  return slid_mm * double(x - (kFirstSoft - 1)) / double(kSoftEnd - (kFirstSoft - 1));
}

constexpr double kNearlyMm = 0.25;  // it is not relaxed to the end

TEST(PoseEquilibrium, ASlidingPlateShearsTheTissueEvenly) {
  const Block block;
  const double slid_mm = 3;
  const auto added = block.Equilibrium().BeyondExamples(block.Asked(Block::Slid(slid_mm)));
  EXPECT_GT(added->step.prod(), 1) << "on a coarser lattice";
  for (int x = kFirstSoft; x < kSoftEnd; ++x) {
    const double by_bones = slid_mm * Block::SecondsShare(x);
    EXPECT_NEAR(by_bones + added->At({x, 22, 22}).y(), ShearedMm(x, slid_mm), kNearlyMm) << x;
  }
  for (const int x : {2, 53}) EXPECT_LT(added->At({x, 22, 22}).norm(), 1e-4) << "bone";
}

// An oblique left-handed grid with voxels of three sizes, far from its origin: the plate slides along its j.
TEST(PoseEquilibrium, SoItDoesOnAnyGrid) {
  Eigen::Matrix3d direction = Eigen::AngleAxisd(0.7, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  direction.col(2) *= -1;
  const Vector3d spacing_mm(1, 1.3, 1.9);
  const Block block(spacing_mm, direction);
  const auto added = block.Equilibrium().BeyondExamples(block.Asked(Block::Slid(3, direction.col(1))));
  for (int x = kFirstSoft; x < kSoftEnd; x += 4) {
    const Vector3d mm = spacing_mm.cwiseProduct(added->At({x, 22, 22}));
    EXPECT_NEAR(3 * Block::SecondsShare(x) + mm.y(), ShearedMm(x, 3), kNearlyMm) << x;
    EXPECT_LT(std::hypot(mm.x(), mm.z()), 0.1) << x;
  }
}

// Of the second scan the sliding plate lies nowhere near: its equilibrium there is made from the first
// scan's.
TEST(PoseEquilibrium, ABoneThatAScanDoesNotShowPullsNothing) {
  Block block;
  block.scan_poses = {Block::Slid(2), Block::Slid(-25)};
  const auto at_rest = [&] {
    const auto added = block.Equilibrium().BeyondExamples(block.Asked(Block::Slid(2), {0, 1}));
    return added->At({40, 22, 22}).norm();
  };
  EXPECT_GT(at_rest(), 0.5);
  block.known_from = {Eigen::MatrixXf::Zero(2, 2), Eigen::MatrixXf::Zero(2, 2)};
  block.known_from[0].col(0).setOnes();
  block.known_from[1] << 0, 1, 1, 0;
  EXPECT_LT(at_rest(), 0.1);
}

TEST(PoseEquilibrium, ThreadsThatAskForDifferentPosesGetTheirOwn) {
  const Block block;
  const PoseEquilibrium equilibrium = block.Equilibrium();
  std::vector<std::vector<Eigen::Vector3f>> alone, together(6);
  for (int n = 0; n < 6; ++n)
    alone.push_back(equilibrium.BeyondExamples(block.Asked(Block::Slid(1 + n % 6)))->voxels);
  ParallelFor(together.size(), [&](size_t n) {
    together[n] = equilibrium.BeyondExamples(block.Asked(Block::Slid(1 + double(n))))->voxels;
  });
  EXPECT_EQ(together, alone);
}

TEST(PoseEquilibrium, AddsNothingWhereBonesMoveAsOneOrAsInAScan) {
  Block block;
  block.scan_poses = {Block::Slid(2), Block::Slid(4)};
  const PoseEquilibrium equilibrium = block.Equilibrium();
  const RigidTransform turned{Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d(1, 2, 0.5).normalized())),
                              Vector3d(20, -7, 3)};
  EXPECT_LT(Largest(*equilibrium.BeyondExamples(block.Asked({turned, turned}))), 0.01);
  EXPECT_LT(Largest(*equilibrium.BeyondExamples(block.Asked(Block::Slid(0)))), 1e-3);
  EXPECT_EQ(Largest(*equilibrium.BeyondExamples(block.Asked(Block::Slid(4), {0, 1}))), 0);
}

// Half of each of two examples at the mean of their shears: as elastic as the tissue is there is no more.
TEST(PoseEquilibrium, TakesOffWhatExamplesInterpolate) {
  Block block;
  block.scan_poses = {Block::Slid(2), Block::Slid(4)};
  const PoseEquilibrium equilibrium = block.Equilibrium();
  const double alone = Largest(*equilibrium.BeyondExamples(block.Asked(Block::Slid(3))));
  EXPECT_GT(alone, 0.5);
  EXPECT_LT(Largest(*equilibrium.BeyondExamples(block.Asked(Block::Slid(3), {0.5f, 0.5f}))), 0.1 * alone);
}

TEST(PoseEquilibrium, IsTheSameInAnyFrame) {
  Block block;
  const auto before = block.Equilibrium().BeyondExamples(block.Asked(Block::Slid(3)));
  const RigidTransform turned{Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Vector3d(0.3, 1, -0.5).normalized())),
                              Vector3d(-4, 9, 30)};
  PoseVector pose = Block::Slid(3);
  for (RigidTransform& bone : pose) bone = turned * bone;
  const auto after = block.Equilibrium().BeyondExamples(block.Asked(pose));
  for (size_t n = 0; n < before->voxels.size(); ++n)
    ASSERT_LT((after->voxels[n] - before->voxels[n]).norm(), 0.02f) << n;
}

TEST(PoseEquilibrium, ALatticesNodesAreAboutAsFarApartAlongEveryAxis) {
  const auto step_of = [](const Vector3d& spacing_mm) {
    const Block block(spacing_mm);
    return block.Equilibrium().BeyondExamples(block.Asked(Block::Slid(0)))->step;
  };
  EXPECT_EQ(step_of({1, 1, 1}), Vector3i(2, 2, 2));
  EXPECT_EQ(step_of({1, 1, 4}), Vector3i(2, 2, 1));
  EXPECT_EQ(step_of({2.1, 1, 1.4}), Vector3i(1, 2, 1));
}

// The scan shows half of the shear that elastic tissue would: from the template alone the share is one half.
TEST(PoseEquilibrium, LearnsItsShareFromTheScans) {
  Block block;
  block.scan_poses = {Block::Slid(3)};
  const auto whole = block.Equilibrium().BeyondExamples(block.Asked(Block::Slid(3)));
  DisplacementField example(block.body.grid, Eigen::Vector3f::Zero());
  for (size_t v = 0; v < example.values.size(); ++v) {
    if (!block.bones.values[v])
      example.values[v] = 0.5f * whole->At(example.grid.Ijk(v)).cast<float>();  // voxels of 1 mm
  }
  const BoneSet bones{{{.label = 1, .name = "a"}, {.label = 2, .name = "b", .parent = 0}}, block.bones};
  Scan scan;
  scan.volume = Volume(block.body.grid);
  block.bricked = BrickBody({scan, block.body, bones, block.weights, {&example}});
  block.without_scan = {Eigen::MatrixXf::Zero(2, 1)};
  const auto half = block.Equilibrium().BeyondExamples(block.Asked(Block::Slid(3)));
  for (const int x : {16, 20, 35, 40})
    EXPECT_NEAR(half->At({x, 22, 22}).y(), 0.5 * whole->At({x, 22, 22}).y(), 0.01) << x;
}

TEST(PoseEquilibrium, KeepsTheLastPoses) {
  const Block block;
  const PoseEquilibrium equilibrium = block.Equilibrium();
  const auto first = equilibrium.BeyondExamples(block.Asked(Block::Slid(3)));
  EXPECT_EQ(equilibrium.BeyondExamples(block.Asked(Block::Slid(3))), first);
  const auto other = equilibrium.BeyondExamples(block.Asked(Block::Slid(1)));
  EXPECT_NE(other, first);
  EXPECT_EQ(equilibrium.BeyondExamples(block.Asked(Block::Slid(3)))->voxels, first->voxels);
}

}  // namespace
}  // namespace kvx

// One bone against one scan: steps that lead back, and voxels so coarse that edges fall between them.
#include "pipeline/bones/refine/bone_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "pipeline/bones/refine/articulated_fit.h"
#include "tests/support/ellipsoid_world.h"

namespace kvx {
namespace {
using namespace testing_support;

// One ellipsoid, and scans of it on grids that share no voxel centres with the template's.
struct LoneBone {
  double voxel_mm;
  EllipsoidWorld world;
  CubicImage image;
  std::vector<BoneTissue> tissue;

  explicit LoneBone(double voxel)
      : voxel_mm(voxel),
        world(kOneBone, Cube(64, {1, 1, 1.1}, Eigen::Matrix3d::Identity())),
        image(world.template_scan->volume),
        tissue(SampleTissue(*world.bones, image, WeightMap(world.template_scan->volume.grid, {{}, {1.0f}}))) {
  }

  Grid Cube(double edge_mm, const Eigen::Vector3d& shape, const Eigen::Matrix3d& direction) const {
    const Eigen::Vector3d spacing_mm = voxel_mm * shape;
    return Box((edge_mm / spacing_mm.array()).ceil().cast<int>().matrix(), spacing_mm, direction);
  }
  CubicImage Scan(const RigidTransform& truth, const Eigen::Vector3d& shape) const {
    return CubicImage(Painted(Cube(72, shape, kOblique), kOneBone, {truth}));
  }
  const PointMm& centre() const { return world.bones->bones[0].centroid; }
};

RigidTransform Planted(int n) {
  return Exp((Twist() << 0.2 * std::sin(n), 0.3 * std::sin(2 * n + 1), 0.2 * std::cos(3 * n), std::cos(n),
              1.5 * std::sin(5 * n), std::cos(2 * n))
                 .finished());
}

// First order: the step is the motion that was planted, whichever image is the finer one.
// Weighted rows of an exact solution lead back to it.
TEST(PoseEquations, LeadBackToWhatTheRowsWereMadeOf) {
  PoseEquations::Row truth;
  truth << 0.1, -0.2, 0.3, 1, -2, 3, 0.9, 0.05;
  PoseEquations equations;
  for (int n = 0; n < 40; ++n) {
    PoseEquations::Row row;
    for (int a = 0; a < 8; ++a) row[a] = std::sin(1.0 + n * (a + 1.3) + a);
    equations.Add(row, 0.5 + n % 3, row.dot(truth));
  }
  EXPECT_LT((equations.normal - equations.normal.transpose()).norm(), 1e-12);
  EXPECT_NEAR((equations.normal.ldlt().solve(equations.right) - truth).norm(), 0, 1e-9);
}

TEST(BoneProblem, OneStepLeadsBackFromASmallMotion) {
  const LoneBone bone(1.2);
  const Twist planted = (Twist() << 0.01, -0.008, 0.012, 0.06, -0.05, 0.04).finished();
  for (const Eigen::Vector3d& shape :
       {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0.7, 0.8, 0.7), Eigen::Vector3d(1.3, 1.2, 1.4)}) {
    const RigidTransform truth = Planted(1);
    const CubicImage scan = bone.Scan(truth, shape);
    RigidTransform off = RotationAbout(bone.centre(), -planted.head<3>(), planted.head<3>().norm());
    off.translation_mm -= planted.tail<3>();
    const RigidTransform start = truth * off;
    BoneProblem problem(bone.tissue[0], bone.image, scan, {start}, 0);
    problem.Look(start);
    problem.Trust();
    problem.Look(start);
    BoneProblem::Row right;
    const BoneProblem::Normal normal = problem.Equations(right);
    const BoneProblem::Row step = normal.ldlt().solve(right);
    EXPECT_LT((step.head<3>() - planted.head<3>()).norm(), 0.3 * planted.head<3>().norm()) << shape;
    EXPECT_LT((step.segment<3>(3) - planted.tail<3>()).norm(), 0.3 * planted.tail<3>().norm()) << shape;
    EXPECT_GT(problem.Correlation(), 0.95);
  }
}

// The ellipsoid's shell is half a voxel thick: from the template's voxels alone the centre is found to 0.22
// mm.
TEST(BoneProblem, VoxelsOfTheScanTellWhatLiesBetweenThoseOfTheTemplate) {
  const LoneBone bone(3.0);
  double squares = 0;
  constexpr int kScans = 12;
  for (int n = 0; n < kScans; ++n) {
    const CubicImage scan = bone.Scan(Planted(n), {1, 0.95, 1.05});
    const BoneEstimate fit = FitArticulated(bone.tissue, bone.image, scan, {Planted(n)}, {5.0})[0];
    squares += std::pow(CentreMm(fit.scan_from_template, Planted(n), bone.centre()), 2);
  }
  EXPECT_LT(std::sqrt(squares / kScans), 0.195);
}

// 4.5 mm beside the bone with a reach of 4: correlation and spread are not those of the fit that was refused.
TEST(FitArticulated, ABoneThatWouldLeaveItsReachIsAsUncertainAsItsStart) {
  const LoneBone bone(1.2);
  const RigidTransform truth = Planted(1);
  RigidTransform start = truth;
  start.translation_mm.x() += 4.5;
  const CubicImage scan = bone.Scan(truth, {1, 1, 1});
  const BoneEstimate fit = FitArticulated(bone.tissue, bone.image, scan, {start}, {4.0})[0];
  EXPECT_EQ(RowMajor(fit.scan_from_template), RowMajor(start));
  EXPECT_TRUE(fit.left_reach);
  EXPECT_LT(fit.correlation, 0.8);
  EXPECT_NEAR(std::sqrt(fit.covariance.bottomRightCorner<3, 3>().trace()), 4.5, 0.3);
  const BoneEstimate free = FitArticulated(bone.tissue, bone.image, scan, {start}, {5.0})[0];
  EXPECT_FALSE(free.left_reach);
  EXPECT_GT(free.correlation, 0.95);
  EXPECT_LT(CentreMm(free.scan_from_template, truth, bone.centre()), 0.1);
}

// Every `n` slices of one as one.
Volume Merged(const Volume& fine, int n) {
  Grid grid = fine.grid;
  grid.size.z() /= n;
  grid.spacing_mm.z() *= n;
  grid.origin = fine.grid.ToMm(PointVox{{0, 0, 0.5 * (n - 1)}});
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    for (int k = 0; k < n; ++k) out.values[v] += fine(p.x(), p.y(), n * p.z() + k) / float(n);
  }
  return out;
}

const std::vector<Ellipsoid> kFlatBone{{"bone", "", {0, 0, 0}, {19, 13, 8}}};

// What one image blurs along its slices the other shows, and the other way round: taken as they are, the bone
// is turned by 1.5 degrees.
TEST(BoneProblem, SlicesAcrossEachOtherHardlyTurnABone) {
  constexpr int kSlices = 4, kScans = 12;
  const Grid fine = Box({56, 52, 52}, {1, 1, 1}, Eigen::Matrix3d::Identity());
  LabelMap fine_labels(fine);
  const Volume seen = Merged(Painted(fine, kFlatBone, {RigidTransform{}}, &fine_labels), kSlices);
  BoneSet bones{EllipsoidWorld(kFlatBone, fine).bones->bones, LabelMap(seen.grid)};
  for (size_t v = 0; v < seen.values.size(); ++v) {
    const Eigen::Vector3i p = seen.grid.Ijk(v);
    bones.labels.values[v] = fine_labels(p.x(), p.y(), kSlices * p.z() + kSlices / 2);
  }
  const CubicImage image(seen);
  const auto tissue = SampleTissue(bones, image, WeightMap(seen.grid, {{}, {1.0f}}));
  double squares_mm2 = 0, squares_deg2 = 0;
  for (int n = 0; n < kScans; ++n) {
    const RigidTransform truth =
        Planted(n) * RotationAbout(bones.bones[0].centroid, Eigen::Vector3d::UnitX(), RadFromDeg(60));
    const CubicImage scan(Merged(Painted(fine, kFlatBone, {truth}), kSlices));
    const BoneEstimate fit = FitArticulated(tissue, image, scan, {truth}, {5.0})[0];
    squares_mm2 += std::pow(CentreMm(fit.scan_from_template, truth, bones.bones[0].centroid), 2);
    squares_deg2 += std::pow(AngleDeg(fit.scan_from_template, truth), 2);
  }
  EXPECT_LT(std::sqrt(squares_mm2 / kScans), 0.1);
  EXPECT_LT(std::sqrt(squares_deg2 / kScans), 0.7);
}

}  // namespace
}  // namespace kvx

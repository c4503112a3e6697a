// One bone against one scan: steps that lead back, slopes and curvatures against differences of the squares,
// and voxels so coarse that edges fall between them.
#include "pipeline/bones/refine/bone_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "core/local_motion.h"
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

// A bone in a texture of long waves that goes on around it, and the squares of eq. 1 both ways: of voxels of
// the template against the scan and of the scan's against the template, gain and bias at their best.
struct BoneInWaves {
  static constexpr double kStepMm = 0.03;  // of differences; waves have at most 0.42 rad per mm
  RigidTransform truth = Planted(1);
  EllipsoidWorld world{kOneBone, Box({54, 54, 50}, {1.2, 1.1, 1.3}, Eigen::Matrix3d::Identity())};
  CubicImage in_template{Waves(world.template_scan->volume.grid, {}, 1, 0)};
  CubicImage scan;
  std::vector<BoneTissue> tissue;

  // `own`: how much the scan shows besides.
  explicit BoneInWaves(double own)
      : scan(Waves(Box({56, 54, 56}, {1.15, 1.2, 1.25}, kOblique), truth, 1.25, own)) {
    const Grid& grid = in_template.grid();
    tissue = SampleTissue(*world.bones, in_template, WeightMap(grid, {{}, {1.0f}}));
    for (TissueSample& sample : tissue[0].samples) sample.away_mm = 0;  // as if it could not slip
  }
  static Volume Waves(const Grid& grid, const RigidTransform& from_template, double gain, double own) {
    Volume out(grid);
    for (size_t v = 0; v < out.values.size(); ++v) {
      const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
      const Eigen::Vector3d& at = x.lps;
      out.values[v] = float(40 + gain * 20 * Texture(0.6 * (from_template.Inverse() * x).lps) +
                            own * 20 * std::sin(0.3 * at.x() - 0.2 * at.y() + 0.15 * at.z()));
    }
    return out;
  }
  PointMm centre() const { return tissue[0].centre; }
  // Millimetres of a turn are those of the bone's voxels.
  RigidTransform Moved(const RigidTransform& pose, Twist by_mm) const {
    by_mm.head<3>() /= tissue[0].radius_mm;
    return MovedLocally(pose, by_mm, centre());
  }
  // Of scan voxels those count, in the box of the template's, that show one of its voxels at `at`.
  std::vector<Eigen::Vector3d> VoxelsOfScan(const RigidTransform& at) const {
    const Grid& grid = scan.grid();
    Eigen::Vector3d low = grid.size.cast<double>(), high = -low;
    for (const TissueSample& sample : tissue[0].samples) {
      const Eigen::Vector3d p = grid.ToVox(at * PointMm{centre().lps + sample.from_centre_mm}).ijk;
      low = low.cwiseMin(p), high = high.cwiseMax(p);
    }
    std::vector<Eigen::Vector3d> out;
    const Image<int32_t>& sample_at = tissue[0].sample_at;
    for (size_t v = 0; v < grid.VoxelCount(); ++v) {
      const Eigen::Vector3d p = grid.Ijk(v).cast<double>();
      if ((p.array() < low.array()).any() || (p.array() > high.array()).any()) continue;
      const Eigen::Vector3d in_box = sample_at.grid.ToVox(at.Inverse() * grid.ToMm(PointVox{p})).ijk;
      const Eigen::Vector3i near = in_box.array().round().cast<int>();
      if (sample_at.grid.Contains(near) && sample_at(near.x(), near.y(), near.z()) != kNoSample)
        out.push_back(p);
    }
    return out;
  }
  static double Value(const CubicImage& image, const PointMm& x) {
    double value = 0;
    Eigen::Vector3d unused;
    EXPECT_TRUE(image.At(image.grid().ToVox(x).ijk, value, unused));
    return value;
  }
  // Half the squares, as both ways count: by the larger of the voxels.
  double Squares(const RigidTransform& pose, const std::vector<Eigen::Vector3d>& voxels_of_scan) const {
    std::vector<Eigen::Vector3d> seen;  // weight, template, scan
    const double of_template = in_template.grid().spacing_mm.prod(), of_scan = scan.grid().spacing_mm.prod();
    const double most = std::max(of_template, of_scan);
    for (const TissueSample& sample : tissue[0].samples)
      seen.emplace_back(0.5 * of_template / most, sample.value,
                        Value(scan, pose * PointMm{centre().lps + sample.from_centre_mm}));
    for (const Eigen::Vector3d& p : voxels_of_scan) {
      const PointMm x = scan.grid().ToMm(PointVox{p});
      seen.emplace_back(0.5 * of_scan / most, Value(in_template, pose.Inverse() * x), Value(scan, x));
    }
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    double squares = 0;
    for (const Eigen::Vector3d& s : seen) {
      const Eigen::Vector2d row(s[2], 1);
      normal += s[0] * row * row.transpose(), right += s[0] * s[1] * row, squares += s[0] * s[1] * s[1];
    }
    return 0.5 * (squares - right.dot(normal.ldlt().solve(right)));
  }
};

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

// A turn of 60 degrees takes more steps than three rounds have.
TEST(FitArticulated, GoesOnUntilABoneIsAtRest) {
  const LoneBone bone(0.7);
  const RigidTransform truth = Planted(1);
  const OrientedBox& box = bone.world.bones->bones[0].box;
  const RigidTransform start = truth * RotationAbout(bone.centre(), box.axes.col(0), RadFromDeg(60));
  const CubicImage scan = bone.Scan(truth, {1, 1, 1});
  const BoneEstimate fit = FitArticulated(bone.tissue, bone.image, scan, {start}, {100.0})[0];
  EXPECT_LT(AngleDeg(fit.scan_from_template, truth), 0.5);
}

// Rows hold the mean of both images' slopes. Squares of the one way go by the scan's, of the other way by the
// template's: as far as these differ, the two ways make up for each other but for where voxels happen to lie,
// some thousands each way. Differences themselves miss (2 k h)^2 / 6 of a slope, a ten-thousandth.
TEST(BoneProblem, TheRightSideIsTheSlopeOfTheSquaresBothWays) {
  for (const double own : {0.0, 0.5}) {
    const BoneInWaves bone(own);
    for (const double off_mm : {0.3, -0.6}) {
      const RigidTransform start = bone.Moved(bone.truth, off_mm * Twist(1, -0.5, 0.7, 0.6, 1, -0.8));
      BoneProblem problem(bone.tissue[0], bone.in_template, bone.scan, {start}, 0);
      problem.Look(start);
      BoneProblem::Row right;
      problem.Equations(right);
      right.head<3>() /= bone.tissue[0].radius_mm;
      const std::vector<Eigen::Vector3d> voxels = bone.VoxelsOfScan(start);
      Twist slope;
      for (int n = 0; n < 6; ++n) {
        const Twist step_mm = BoneInWaves::kStepMm * Twist::Unit(n);
        slope[n] = (bone.Squares(bone.Moved(start, step_mm), voxels) -
                    bone.Squares(bone.Moved(start, -step_mm), voxels)) /
                   (2 * BoneInWaves::kStepMm);
      }
      EXPECT_LT((right.head<6>() + slope).norm(), (own > 0 ? 2e-3 : 5e-4) * slope.norm())
          << own << ", " << off_mm;
    }
  }
}

// Gain and bias eliminated. Differences miss (2 k h)^2 / 12 of a curvature.
TEST(BoneProblem, TheMatrixIsTheCurvatureOfTheSquaresWhereImagesAgree) {
  const BoneInWaves bone(0);
  BoneProblem problem(bone.tissue[0], bone.in_template, bone.scan, {bone.truth}, 0);
  problem.Look(bone.truth);
  BoneProblem::Row right;
  const BoneProblem::Normal normal = problem.Equations(right);
  const Eigen::Matrix<double, 6, 2> cross = normal.topRightCorner<6, 2>();
  Eigen::Matrix<double, 6, 6> matrix =
      normal.topLeftCorner<6, 6>() - cross * normal.bottomRightCorner<2, 2>().inverse() * cross.transpose();
  matrix.topRows<3>() /= bone.tissue[0].radius_mm;
  matrix.leftCols<3>() /= bone.tissue[0].radius_mm;
  const std::vector<Eigen::Vector3d> voxels = bone.VoxelsOfScan(bone.truth);
  const auto squares = [&](const Twist& by_mm) {
    return bone.Squares(bone.Moved(bone.truth, by_mm), voxels);
  };
  Eigen::Matrix<double, 6, 6> curvature;
  for (int n = 0; n < 6; ++n) {
    for (int m = 0; m < 6; ++m) {
      const Twist u = BoneInWaves::kStepMm * Twist::Unit(n), w = BoneInWaves::kStepMm * Twist::Unit(m);
      curvature(n, m) = (squares(u + w) + squares(-u - w) - squares(u - w) - squares(w - u)) /
                        (4 * std::pow(BoneInWaves::kStepMm, 2));
    }
  }
  EXPECT_LT((matrix - curvature).norm(), 2e-4 * curvature.norm());
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

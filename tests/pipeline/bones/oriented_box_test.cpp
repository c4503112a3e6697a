// Boxes of shapes whose principal axes are alike: where the axes lie can be said on paper, whatever noise the
// label map's border has.
#include "pipeline/bones/bone_set/oriented_box.h"

#include <gtest/gtest.h>

#include <random>

#include "core/rigid_transform.h"

namespace kvx {
namespace {

constexpr int kLabel = 3;
constexpr double kOfNoiseDeg =
    6;  // a tenth of the border's voxels lean the axes of so small shapes by a few degrees
const Eigen::Vector3d kMiddle(25, 25, 25);
// Far from the grid's axes, so that no sign is one by chance.
const Eigen::Matrix3d kTurned =
    (Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()) *
     Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()))
        .toRotationMatrix();
// The parent lies behind, its long axis along this bone's first column, its second along the second.
const BoxGuide kGuide{PointMm{kMiddle - 40 * kTurned.col(0)}, kTurned.col(0), kTurned.col(1)};

// Half axes along the columns of `axes`. One voxel in ten at the border is taken away or added.
LabelMap NoisyEllipsoid(const Eigen::Vector3d& half_mm, const Eigen::Matrix3d& axes, unsigned seed) {
  Grid grid;
  grid.size = {51, 51, 51};
  LabelMap labels(grid);
  std::mt19937 random(seed);
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const Eigen::Vector3d x =
        axes.transpose() * (grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps - kMiddle);
    const double radius = x.cwiseQuotient(half_mm).norm(), border = 0.5 / half_mm.minCoeff();
    const bool flipped = std::abs(radius - 1) < border && random() % 10 == 0;
    labels.values[v] = (radius < 1) != flipped ? kLabel : 0;
  }
  return labels;
}

double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return DegFromRad(std::acos(std::clamp(a.dot(b), -1.0, 1.0)));
}

// The largest angle that any axis has to the columns of `axes`, over ten label maps.
double FarthestDeg(const Eigen::Vector3d& half_mm, const Eigen::Matrix3d& shape, const BoxGuide& guide,
                   const Eigen::Matrix3d& axes) {
  double most = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const OrientedBox box = FitOrientedBox(NoisyEllipsoid(half_mm, shape, seed), kLabel, guide);
    for (int a = 0; a < 3; ++a) most = std::max(most, AngleDeg(box.axes.col(a), axes.col(a)));
  }
  return most;
}

TEST(OrientedBoxUnderNoise, OfARoundBarTheSecondAxisIsTheParents) {
  EXPECT_LT(FarthestDeg({20, 6, 6}, kTurned, kGuide, kTurned), kOfNoiseDeg);
}

TEST(OrientedBoxUnderNoise, OfADiscTheLongAxisPointsAwayFromTheParent) {
  EXPECT_LT(FarthestDeg({12, 12, 5}, kTurned, kGuide, kTurned), kOfNoiseDeg);
}

TEST(OrientedBoxUnderNoise, OfABallBothAxesAreTheGuides) {
  EXPECT_LT(FarthestDeg({8, 8, 8}, kTurned, kGuide, kTurned), kOfNoiseDeg);
}

// A patella: the way from the femur's middle to it leads forwards as much as down, along the disc's normal.
TEST(OrientedBoxUnderNoise, OfADiscInFrontOfItsParentItPointsAlongTheParentsLongAxis) {
  const BoxGuide in_front{PointMm{kMiddle - 40 * kTurned.col(2)}, kTurned.col(0), kTurned.col(1)};
  EXPECT_LT(FarthestDeg({12, 12, 5}, kTurned, in_front, kTurned), kOfNoiseDeg);
}

// Its shape says where the second axis lies: across the parent's, whose sign noise would have to say.
TEST(OrientedBoxUnderNoise, AFlatBoneAcrossItsParentsSecondAxisDoesNotTurnOver) {
  Eigen::Matrix3d across;
  across << kTurned.col(0), kTurned.col(2), -kTurned.col(1);
  EXPECT_LT(FarthestDeg({20, 9, 5}, across, kGuide, across), kOfNoiseDeg);
}

TEST(OrientedBoxUnderNoise, WhereTheShapeTellsTheAxesApartTheGuideTurnsNone) {
  BoxGuide askew = kGuide;
  askew.across = (kTurned.col(1) + kTurned.col(2)).normalized();
  askew.towards_parent.lps += 30 * kTurned.col(1);
  EXPECT_LT(FarthestDeg({20, 10, 6}, kTurned, askew, kTurned), kOfNoiseDeg);
}

// The second axis of a round bar bent to its parent is the parent's, carried along by the bend.
TEST(OrientedBoxUnderNoise, TheSecondAxisIsHandedDownAroundABend) {
  const Eigen::Matrix3d bend = Eigen::AngleAxisd(RadFromDeg(60), kTurned.col(1)).toRotationMatrix();
  const BoxGuide before{PointMm{kMiddle - 40 * bend * kTurned.col(0)}, kTurned.col(0), kTurned.col(1)};
  EXPECT_LT(FarthestDeg({20, 6, 6}, bend * kTurned, before, bend * kTurned), kOfNoiseDeg);
}

// A rod of one voxel's width has no second axis of its own, a single voxel no axis at all.
TEST(OrientedBox, OfARodAndAPointTheOtherAxesAreTheGuides) {
  Grid grid;
  grid.size = {51, 51, 51};
  LabelMap rod(grid), point(grid);
  point(25, 25, 25) = kLabel;
  for (int k = 20; k <= 30; ++k) rod(25, 25, k) = kLabel;
  const OrientedBox of_point = FitOrientedBox(point, kLabel, kGuide);
  EXPECT_LT((of_point.axes.col(0) - Eigen::Vector3d(kTurned.col(0))).norm(), 0.5);
  for (const OrientedBox& box : {of_point, FitOrientedBox(rod, kLabel, kGuide)}) {
    EXPECT_TRUE(box.axes.isUnitary(1e-9)) << box.axes;
    EXPECT_NEAR(box.axes.determinant(), 1, 1e-9);
  }
  EXPECT_NEAR(std::abs(FitOrientedBox(rod, kLabel, kGuide).axes(2, 0)), 1, 1e-9);
}

}  // namespace
}  // namespace kvx

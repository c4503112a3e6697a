// Planted motions refined from a start that is some degrees off, and how well the spread is known.
#include "pipeline/bones/refine_bones.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/voxels/cubic_spline.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/scans/cubic_image.h"
#include "pipeline/skeleton/bone_certainty.h"
#include "tests/support/ellipsoid_hinge.h"

namespace kvx {
namespace {
using namespace testing_support;
using ::testing::HasSubstr;

// Splines run through their samples, and are exact on a ramp away from the mirrored border.
TEST(CubicImage, RunsThroughItsSamplesAndIsExactOnARamp) {
  const Grid grid = ObliqueGrid({9, 8, 7});
  Volume rough(grid);
  for (size_t v = 0; v < rough.values.size(); ++v) rough.values[v] = float((v * 7919) % 101);
  const CubicImage image(rough);
  double value;
  Eigen::Vector3d gradient;
  for (size_t v = 0; v < rough.values.size(); v += 13) {
    ASSERT_TRUE(image.At(grid.Ijk(v).cast<double>(), value, gradient));
    EXPECT_NEAR(value, rough.values[v], 1e-3);
  }
  const LinearRamp ramp;
  const Grid wide = ObliqueGrid({41, 41, 41});
  const CubicImage smooth(ramp.On(wide));
  const Eigen::Vector3d p(20.3, 19.6, 20.9);
  ASSERT_TRUE(smooth.At(p, value, gradient));
  EXPECT_NEAR(value, ramp.At(wide.ToMm(PointVox{p})), 1e-3);
  EXPECT_NEAR((wide.VoxFromMm().transpose() * gradient - ramp.gradient_per_mm).norm(), 0, 1e-3);
  EXPECT_FALSE(smooth.At({-0.01, 3, 3}, value, gradient));
  EXPECT_FALSE(smooth.At({3, 40.01, 3}, value, gradient));
}

// Oracle: the spline's values, looked up for themselves, and their differences; at mirrored borders too.
TEST(CubicImage, ValuesAndSlopesAreTheSplines) {
  const Grid grid = ObliqueGrid({9, 2, 7});
  Volume rough(grid);
  for (size_t v = 0; v < rough.values.size(); ++v) rough.values[v] = float((v * 7919) % 101);
  const CubicImage image(rough);
  const Volume spline = SplineCoefficients(rough);
  constexpr double kStep = 1e-2;
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.1, 0.5, 0.2), Eigen::Vector3d(4.4, 0.3, 3.7),
                                   Eigen::Vector3d(7.9, 0.9, 5.8), Eigen::Vector3d(6.5, 0.02, 1.1)}) {
    double value;
    Eigen::Vector3d gradient;
    ASSERT_TRUE(image.At(p, value, gradient));
    EXPECT_NEAR(value, SampleSpline(spline, PointVox{p}), 1e-4);
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3d h = kStep * Eigen::Vector3d::Unit(a);
      const double slope =
          (SampleSpline(spline, PointVox{p + h}) - SampleSpline(spline, PointVox{p - h})) / (2 * kStep);
      EXPECT_NEAR(gradient[a], slope, 0.05) << p.transpose() << " along " << a;
    }
  }
}

const std::vector<Twist> kOff{(Twist() << 0.05, -0.02, 0.02, 0.3, 0.2, -0.3).finished(),
                              (Twist() << -0.05, 0.02, 0.03, -0.3, 0.3, 0.2).finished()};

TEST(RefineBones, FindsAPlantedHingeFromSomeDegreesOff) {
  const Hinge hinge;
  const Volume scan = hinge.Scan();
  const BoneFits fits = hinge.Refine(scan, kOff);
  for (int b = 0; b < 2; ++b) {
    EXPECT_LT(AngleDeg(fits[b].scan_from_template, hinge.truth[b]), 0.3) << b;
    EXPECT_LT(CentreMm(fits[b].scan_from_template, hinge.truth[b], hinge.world.bones->bones[b].centroid),
              0.05);
    EXPECT_GT(fits[b].correlation, 0.95);
    EXPECT_FALSE(fits[b].Doubtful());
  }
  const BoneFits again = hinge.Refine(scan, kOff);
  for (int b = 0; b < 2; ++b) {
    EXPECT_EQ(RowMajor(fits[b].scan_from_template), RowMajor(again[b].scan_from_template));
    EXPECT_EQ(fits[b].covariance, again[b].covariance);
  }
}

TEST(RefineBones, FindsItInAnotherContrast) {
  const Hinge hinge;
  Volume scan = hinge.Scan();
  for (float& value : scan.values) value = 250 - 1.3f * value;
  const BoneFits fits = hinge.Refine(scan, kOff);
  for (size_t b = 0; b < 2; ++b) {
    EXPECT_LT(AngleDeg(fits[b].scan_from_template, hinge.truth[b]), 0.5);
    EXPECT_LT(CentreMm(fits[b].scan_from_template, hinge.truth[b], hinge.world.bones->bones[b].centroid),
              0.1);
  }
}

// Mean squares over several noises. The spread also stands for what noise does not move, such as tissue that
// slips, so that errors by noise alone are smaller: about half.
TEST(RefineBones, TheSpreadIsAsLargeAsTheErrorsUnderNoise) {
  const Hinge hinge;
  const std::vector<Twist> none(2, Twist::Zero());
  double turned = 0, stated_turn = 0, moved = 0, stated_move = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const BoneFits fits = hinge.Refine(hinge.Scan(12, seed), none);
    for (size_t b = 0; b < 2; ++b) {
      const Bone& bone = hinge.world.bones->bones[b];
      turned += std::pow((fits[b].scan_from_template.Inverse() * hinge.truth[b]).AngleRad(), 2);
      moved += std::pow(CentreMm(fits[b].scan_from_template, hinge.truth[b], bone.centroid), 2);
      stated_turn += fits[b].covariance.topLeftCorner<3, 3>().trace();
      stated_move += std::pow(CentreSdMm(fits[b]), 2);
    }
  }
  for (const double share : {turned / stated_turn, moved / stated_move}) {
    EXPECT_GT(share, 0.25);
    EXPECT_LT(share, 0.8);
  }
}

// The search doubts whether it lies near there, not how it lies there.
TEST(RefineBones, ADoubtfulBoneIsRefinedAndStaysDoubtful) {
  const Hinge hinge;
  const Volume scan = hinge.Scan();
  const BoneFits fits = hinge.Refine(scan, kOff, true), sure = hinge.Refine(scan, kOff);
  for (size_t b = 0; b < 2; ++b) {
    EXPECT_LT(AngleDeg(fits[b].scan_from_template, hinge.truth[b]), 0.3);
    EXPECT_EQ(fits[b].covariance, sure[b].covariance);
    EXPECT_TRUE(fits[b].Doubtful());
  }
}

// Found 4 mm beside it; its reach is 0.3 of a thickness of 12 mm.
TEST(RefineBones, ABoneThatWouldGoFarIsDoubtfulAndStays) {
  const Hinge hinge;
  Twist beside = Twist::Zero();
  beside[4] = 4;
  const BoneFits fits = hinge.Refine(hinge.Scan(), {Twist::Zero(), beside});
  EXPECT_FALSE(fits[0].Doubtful()) << fits[0].note;
  EXPECT_TRUE(fits[1].Doubtful());
  EXPECT_THAT(fits[1].note, HasSubstr("fits better beside the place where it was found"));
  const Bone& tip = hinge.world.bones->bones[1];
  EXPECT_NEAR(CentreMm(fits[1].scan_from_template, hinge.truth[1], tip.centroid), 4, 1e-9);
  EXPECT_GT(BoundsOf(tip, fits[1]).surface_mm, 4);
}

// 500 mm away, where the search has a bone that the scan does not show.
TEST(RefineBones, OfABoneOutOfViewHardlyAnythingIsKnown) {
  const Hinge hinge;
  Twist away = Twist::Zero();
  away[4] = 500;
  const BoneFit tip = hinge.Refine(hinge.Scan(), {Twist::Zero(), away}, true)[1];
  const Bone& bone = hinge.world.bones->bones[1];
  EXPECT_NEAR(DegFromRad(BoundsOf(bone, tip).turn_rad), 180, 1e-9);
  EXPECT_GT(BoundsOf(bone, tip).surface_mm, 2 * bone.box.extent_mm.maxCoeff());
}

// Cut off through the near end of the tip, of which little is seen.
TEST(RefineBones, ABoneThatTheScanHardlyShowsStaysWhereItIsTakenToBe) {
  const Hinge hinge;
  const Volume scan = hinge.Scan();
  const Bone& tip = hinge.world.bones->bones[1];
  VoxelBox seen{Eigen::Vector3i::Zero(), scan.grid.size};
  seen.high.x() = int(scan.grid.ToVox(hinge.truth[1] * tip.centroid).ijk.x()) - 8;
  const BoneFit fit = hinge.Refine(Cropped(scan, seen), {Twist::Zero(), kOff[1]}, true)[1];
  EXPECT_NEAR(AngleDeg(fit.scan_from_template, hinge.truth[1]), DegFromRad(kOff[1].head<3>().norm()), 1e-6);
  EXPECT_NEAR(DegFromRad(BoundsOf(tip, fit).turn_rad), 180, 1e-9);
}

TEST(RefineBones, AHintIsAllThatIsKnownOfABoneOutOfView) {
  const Hinge hinge;
  Twist away = Twist::Zero();
  away[4] = 500;
  const Volume scan = hinge.Scan();
  const PoseHints hints{{"tip", hinge.Refine(scan, {Twist::Zero(), away}, true)[1].scan_from_template}};
  const BoneFit tip = hinge.Refine(scan, {Twist::Zero(), away}, true, hints)[1];
  EXPECT_NEAR(DegFromRad(WeakestTurnRad(tip)), 5, 0.1);
  EXPECT_NEAR(CentreSdMm(tip), std::sqrt(3) / 6 * hinge.world.bones->bones[1].box.extent_mm.minCoeff(), 0.1);
}

RigidTransform TurnedAboutItself(const Hinge& hinge, int b, double deg) {
  const Bone& bone = hinge.world.bones->bones[size_t(b)];
  return hinge.truth[size_t(b)] * RotationAbout(bone.centroid, bone.box.axes.col(0), RadFromDeg(deg));
}

// A doubtful bone by a hint goes from where it was found as far as the hint outweighs its spread.
TEST(RefineBones, AHintDecidesWhatTheScanLeavesOfADoubtfulBone) {
  const Hinge hinge;
  const Volume scan = hinge.Scan(12);
  const PoseHints hints{{"tip", TurnedAboutItself(hinge, 1, 10)}};
  const BoneFit alone = hinge.Refine(scan, kOff, true)[1];
  const BoneFits fits = hinge.Refine(scan, kOff, true, hints);
  BoneFit expected = alone;
  WeighHint(hinge.world.bones->bones[1], hints.at("tip"), expected);
  EXPECT_EQ(RowMajor(fits[1].scan_from_template), RowMajor(expected.scan_from_template));
  EXPECT_EQ(fits[1].covariance, expected.covariance);
  EXPECT_NE(RowMajor(fits[1].scan_from_template), RowMajor(alone.scan_from_template));
  EXPECT_EQ(RowMajor(fits[0].scan_from_template),
            RowMajor(hinge.Refine(scan, kOff, true)[0].scan_from_template));
}

TEST(RefineBones, AWrongHintAgainstClearEvidenceDecidesNothing) {
  const Hinge hinge;
  RigidTransform far = hinge.truth[1];
  far.translation_mm += Eigen::Vector3d(9, 0, 0);
  for (const RigidTransform& wrong : {TurnedAboutItself(hinge, 1, 15), far}) {
    const BoneFits fits = hinge.Refine(hinge.Scan(), kOff, false, {{"tip", wrong}});
    EXPECT_LT(AngleDeg(fits[1].scan_from_template, hinge.truth[1]), 0.5);
    EXPECT_LT(CentreMm(fits[1].scan_from_template, hinge.truth[1], hinge.world.bones->bones[1].centroid),
              0.1);
  }
}

TEST(RefineBones, NamesAScanOfWhichTheVoxelSizeIsWrong) {
  const Hinge hinge;
  const BoneFits fits = hinge.Refine(Stretched(hinge.Scan(4), {1.06, 1, 1}), {Twist::Zero(), Twist::Zero()});
  for (const BoneFit& fit : fits) {
    EXPECT_EQ(fit.doubt, Doubt::kAnotherSize);
    EXPECT_THAT(fit.note, HasSubstr("as if its voxels were given as 1.06, 1.00 and 1.00 times as long"));
  }
}

// Gradient coils distort by so much.
TEST(RefineBones, AHundredthIsNotAnotherSize) {
  const Hinge hinge;
  for (const BoneFit& fit :
       hinge.Refine(Stretched(hinge.Scan(4), {1, 1.01, 1.01}), {Twist::Zero(), Twist::Zero()}))
    EXPECT_FALSE(fit.Doubtful()) << fit.note;
}

TEST(RefineBones, NamesAScanOfAnotherPersonsBones) {
  const Hinge hinge;
  const BoneFits fits = hinge.Refine(
      hinge.Scan(4, 1, {{"base", "", {-19, 0, 0}, {20, 8, 7}}, {"tip", "base", {17, 0, 0}, {14.5, 7, 6}}}),
      {Twist::Zero(), Twist::Zero()});
  for (const BoneFit& fit : fits) {
    EXPECT_EQ(fit.doubt, Doubt::kAnotherSize);
    EXPECT_THAT(fit.note, HasSubstr("it may be another person's"));
  }
}

}  // namespace
}  // namespace kvx

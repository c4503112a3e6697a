// Joints planted in noise-free poses must be found; what angles do not say must come back from the residuals.
#include "pipeline/skeleton/fit_skeleton.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/errors.h"
#include "core/joint_values.h"
#include "pipeline/skeleton/joint_centre.h"
#include "tests/support/conjunct_bend.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// Two bones that meet near the middle of the grid, and a third that follows the second.
BoneSet TwoBonesAndAFollower() {
  BoneSet set;
  set.labels = LabelMap(ObliqueGrid({12, 24, 12}));
  const auto draw = [&](int label, int from, int to, int i0, int i1) {
    for (int k = 4; k <= 7; ++k) {
      for (int j = from; j <= to; ++j) {
        for (int i = i0; i <= i1; ++i) set.labels(i, j, k) = uint16_t(label);
      }
    }
  };
  draw(1, 2, 10, 3, 6), draw(2, 13, 21, 3, 6), draw(3, 10, 13, 9, 10);
  const Grid& grid = set.labels.grid;
  set.bones = {{.label = 1, .name = "femur", .centroid = grid.ToMm(4, 6, 5)},
               {.label = 2, .name = "tibia", .parent = 0, .centroid = grid.ToMm(4, 17, 5)},
               {.label = 3, .name = "patella", .parent = 0, .centroid = grid.ToMm(9, 12, 5)}};
  for (Bone& bone : set.bones) bone.box = {bone.centroid, Eigen::Matrix3d::Identity(), {4, 9, 4}};
  return set;
}

struct Planted {
  PointMm centre;
  std::vector<Eigen::Vector3d> axes;
  RigidTransform At(std::initializer_list<double> degrees) const {
    RigidTransform motion;
    size_t d = 0;
    for (const double a : degrees) motion = motion * RotationAbout(centre, axes[d++], RadFromDeg(a));
    return motion;
  }
};

const RigidTransform kRoot = Exp((Twist() << 0.2, -0.1, 0.3, 5, 6, -7).finished());

Artifact<BoneFits> ScanOf(const RigidTransform& tibia, const RigidTransform& patella = {},
                          bool doubtful = false) {
  BoneFits fits(3);
  fits[0].scan_from_template = kRoot;
  fits[1].scan_from_template = kRoot * tibia;
  fits[2].scan_from_template = kRoot * patella;
  fits[1].doubt = doubtful ? Doubt::kBone : Doubt::kNone;
  return {{}, std::make_shared<BoneFits>(fits)};
}

SkeletonFit Fit(const std::vector<Artifact<BoneFits>>& scans, const FitSkeleton::Options& options) {
  StageContext context{SharedBackend(), {}};
  const Artifact<BoneSet> bones{{}, std::make_shared<BoneSet>(TwoBonesAndAFollower())};
  return FitSkeleton::Run({bones, scans}, options, context);
}

FitSkeleton::Options TibiaWith(std::vector<std::string> dofs, Region region = Region::kKnee) {
  return {.region = region, .joints = {{"tibia", std::move(dofs)}}};
}

double AcrossMm(const PointMm& a, const PointMm& b, const Eigen::Vector3d& axis) {
  return (a.lps - b.lps).cross(axis.normalized()).norm();
}

PointMm NearTheGap(const Eigen::Vector3d& off) {
  return {TwoBonesAndAFollower().labels.grid.ToMm(PointVox{{4.5, 11.5, 5.5}}).lps + off};
}

void ExpectSamePoses(const SkeletonFit& fit, const std::vector<Artifact<BoneFits>>& scans) {
  for (size_t k = 0; k < scans.size(); ++k) {
    const PoseVector pose =
        ForwardKinematics(fit.skeleton, fit.scan_angles[k], fit.scan_roots[k], fit.scan_residuals[k]);
    for (size_t b = 0; b < pose.size(); ++b) {
      EXPECT_LT((pose[b].Matrix() - (*scans[k])[b].scan_from_template.Matrix()).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

TEST(FitSkeleton, FindsAPlantedHinge) {
  const Planted hinge{NearTheGap({0.4, -0.6, 0.5}), {Eigen::Vector3d(0.3, -0.2, 0.9).normalized()}};
  const std::vector<Artifact<BoneFits>> scans = {ScanOf(hinge.At({25})), ScanOf(hinge.At({50})),
                                                 ScanOf(hinge.At({80}))};
  const SkeletonFit fit = Fit(scans, TibiaWith({"flexion"}, Region::kCustom));
  const Joint& joint = fit.skeleton.joints[1];
  ASSERT_EQ(joint.dofs.size(), 1u);
  // A long bone is taken to turn across its length, weakly: a tenth of a degree where scans are not exact.
  EXPECT_LT((joint.dofs[0].axis - hinge.axes[0]).norm(), 2e-3);
  EXPECT_LT(AcrossMm(joint.centre, hinge.centre, hinge.axes[0]), 0.01);
  EXPECT_LT(joint.residual_mm, 0.01);
  EXPECT_NEAR(DegFromRad(fit.scan_angles[2][0]), 80, 1e-3);
  EXPECT_NEAR(DegFromRad(joint.dofs[0].max_rad), 85, 0.01);
  EXPECT_NEAR(DegFromRad(joint.dofs[0].min_rad), -5, 0.01);
  EXPECT_EQ(joint.drivers, std::vector<int>{1});
  ExpectSamePoses(fit, scans);
}

TEST(FitSkeleton, ScansInAnotherOrderHaveTheSameJoints) {
  std::vector<Artifact<BoneFits>> scans;
  for (const double number : {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0}) {
    const Twist motion =
        (Twist() << 0.1 * number, std::sin(number), std::cos(number), 1, number, 2).finished();
    scans.push_back(ScanOf(Exp(motion)));
    scans.back().key = Sha256(std::to_string(number));
  }
  SkeletonFit fit = Fit(scans, TibiaWith({"a", "b", "c"}));
  std::ranges::reverse(scans);
  SkeletonFit turned = Fit(scans, TibiaWith({"a", "b", "c"}));
  EXPECT_EQ(BytesOf(turned.skeleton).view(), BytesOf(fit.skeleton).view());
  EXPECT_EQ(turned.scan_angles.front(), fit.scan_angles.back());
}

// Presets know of it, and it comes back from the residuals.
TEST(FitSkeleton, ConjunctRotationOfAKneeIsLeftToTheResidual) {
  const auto bent = [](double bend_deg) { return ScanOf(ConjunctBend(bend_deg)); };
  const std::vector<Artifact<BoneFits>> scans = {bent(25), bent(50), bent(85)};
  const SkeletonFit knee = Fit(scans, {.region = Region::kKnee});
  ExpectSamePoses(knee, scans);
  const auto off_deg = [&](const SkeletonFit& fit) {
    return BetweenAxesDeg(fit.skeleton.joints[1].dofs[0].axis, kConjunctHinge);
  };
  EXPECT_LT(off_deg(knee), 1.5);
  EXPECT_GT(off_deg(Fit(scans, TibiaWith({"flexion"}, Region::kCustom))), 3);
}

// About one axis, every point of it fits: the gap between the bones decides.
TEST(FitSkeleton, PlanarMotionTakesThePlaceOfTheGapAlongTheAxis) {
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, -0.2, 0.9).normalized();
  const Planted hinge{{NearTheGap({0, 0, 0}).lps + 40 * axis}, {axis}};
  const SkeletonFit fit = Fit({ScanOf(hinge.At({30})), ScanOf(hinge.At({60}))}, TibiaWith({"flexion"}));
  const auto gap = FindGap(TwoBonesAndAFollower().labels, 1, 2);
  ASSERT_TRUE(gap);
  EXPECT_LT((gap->lps - NearTheGap({0, 0, 0}).lps).norm(), 0.5);
  EXPECT_NEAR((fit.skeleton.joints[1].centre.lps - gap->lps).dot(axis), 0, 1e-6);
}

// A scan that hardly moves does not say which way a joint bends.
TEST(FitSkeleton, TheBoxSaysWhichWayAJointBendsThatNoScanBends) {
  const Planted hinge{NearTheGap({0, 0, 0}), {Eigen::Vector3d::UnitZ()}};
  const auto axis = [&](double angle_deg) {
    return Fit({ScanOf(hinge.At({angle_deg}))}, TibiaWith({"flexion"})).skeleton.joints[1].dofs[0].axis;
  };
  EXPECT_LT((axis(0.01) - axis(-0.01)).norm(), 0.01);
  EXPECT_LT((axis(6) + axis(-6)).norm(), 0.01) << "these scans bend it";
}

TEST(FitSkeleton, FindsTwoPlantedAxes) {
  const Eigen::Vector3d first = Eigen::Vector3d(0.9, 0.1, -0.4).normalized();
  const Eigen::Vector3d second = first.cross(Eigen::Vector3d(0.1, 1, 0.2)).normalized();
  const Planted saddle{NearTheGap({0.5, 0.3, -0.2}), {first, second}};
  const std::vector<Artifact<BoneFits>> scans = {ScanOf(saddle.At({20, 12})), ScanOf(saddle.At({45, -4})),
                                                 ScanOf(saddle.At({70, 18})), ScanOf(saddle.At({5, 15}))};
  const SkeletonFit fit = Fit(scans, TibiaWith({"flexion", "abduction"}, Region::kCustom));
  const Joint& joint = fit.skeleton.joints[1];
  EXPECT_LT((joint.dofs[0].axis - first).norm(), 1e-3);
  EXPECT_LT((joint.dofs[1].axis - second).norm(), 1e-3);
  EXPECT_LT((joint.centre.lps - saddle.centre.lps).norm(), 0.1);
  EXPECT_NEAR(DegFromRad(fit.scan_angles[1][1]), -4, 0.02);
  ExpectSamePoses(fit, scans);
}

// A knee asked for with three degrees of freedom:
// they explain every turn, and nothing of it is left to the residual.
TEST(FitSkeleton, ThreeAxesExplainEveryTurn) {
  const Planted knee{NearTheGap({0.2, 0.1, -0.3}),
                     {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX()}};
  const std::vector<Artifact<BoneFits>> scans = {ScanOf(knee.At({30, 4, -6})), ScanOf(knee.At({60, -3, 8})),
                                                 ScanOf(knee.At({80, 5, 12}))};
  const SkeletonFit fit = Fit(scans, TibiaWith({"flexion", "abduction", "rotation"}));
  const Joint& joint = fit.skeleton.joints[1];
  ASSERT_EQ(joint.dofs.size(), 3u);
  EXPECT_EQ(joint.dofs[2].name, "rotation");
  EXPECT_LT((joint.centre.lps - knee.centre.lps).norm(), 0.1);
  for (const auto& residuals : fit.scan_residuals) EXPECT_LT(residuals[1].head<3>().norm(), 1e-9);
  for (int scan = 0; scan < 3; ++scan) {
    for (int d = 0; d < 3; ++d) {
      EXPECT_LT(joint.dofs[size_t(d)].min_rad, fit.scan_angles[size_t(scan)][d]);
      EXPECT_GT(joint.dofs[size_t(d)].max_rad, fit.scan_angles[size_t(scan)][d]);
    }
  }
  ExpectSamePoses(fit, scans);
}

const std::vector<std::string> kSix = {"bend", "tilt", "twist", "bend_mm", "tilt_mm", "twist_mm"};

// The planted axes are z, y, x: shifts along them come back in mm, and nothing is left to the residual.
TEST(FitSkeleton, SixDegreesOfFreedomExplainTheWholeMotion) {
  const Planted knee{NearTheGap({0.2, 0.1, -0.3}),
                     {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX()}};
  std::vector<Artifact<BoneFits>> scans;
  for (const double bend_deg : {30.0, 60.0, 80.0}) {
    RigidTransform motion = knee.At({bend_deg, 0.1 * bend_deg, 0});
    motion.translation_mm += Eigen::Vector3d(0.5, 1, -2);
    scans.push_back(ScanOf(motion));
  }
  const SkeletonFit fit = Fit(scans, TibiaWith(kSix));
  const Joint& joint = fit.skeleton.joints[1];
  ASSERT_EQ(joint.dofs.size(), 6u);
  for (size_t k = 0; k < scans.size(); ++k) {
    EXPECT_LT(fit.scan_residuals[k][1].norm(), 1e-9);
    Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
    for (int d = 3; d < 6; ++d) {
      EXPECT_TRUE(joint.dofs[size_t(d)].axis.isApprox(joint.dofs[size_t(d - 3)].axis));
      const double value = fit.scan_angles[k][d];
      EXPECT_LT(joint.dofs[size_t(d)].min_rad, value);
      EXPECT_GT(joint.dofs[size_t(d)].max_rad, value);
      shift_mm += ShiftMm(value) * joint.dofs[size_t(d)].axis;
    }
    const RigidTransform motion = kRoot.Inverse() * (*scans[k])[1].scan_from_template;
    EXPECT_LT((shift_mm - ((motion * joint.centre).lps - joint.centre.lps)).norm(), 1e-9);
  }
  ExpectSamePoses(fit, scans);
}

TEST(FitSkeleton, FourDegreesOfFreedomAreRefusedInWords) {
  const Planted hinge{NearTheGap({0, 0, 0}), {Eigen::Vector3d::UnitZ()}};
  try {
    Fit({ScanOf(hinge.At({30}))}, TibiaWith({"a", "b", "c", "d"}));
    FAIL() << "taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("three turns, then three shifts"), std::string::npos);
  }
}

TEST(FitSkeleton, ADependentBoneIsAllResidual) {
  const Planted hinge{NearTheGap({0, 0, 0}), {Eigen::Vector3d::UnitZ()}};
  const std::vector<Artifact<BoneFits>> scans = {ScanOf(hinge.At({30}), hinge.At({18}))};
  const SkeletonFit fit = Fit(scans, {.region = Region::kKnee});
  EXPECT_TRUE(fit.skeleton.joints[2].dofs.empty());
  EXPECT_EQ(fit.skeleton.joints[2].drivers, std::vector<int>{1});
  EXPECT_GT(fit.scan_residuals[0][2].norm(), RadFromDeg(17));
  ExpectSamePoses(fit, scans);
}

TEST(FitSkeleton, ADependentBoneThatIsFixedOnRequestFollowsNothing) {
  const Planted hinge{NearTheGap({0, 0, 0}), {Eigen::Vector3d::UnitZ()}};
  const std::vector<Artifact<BoneFits>> scans = {ScanOf(hinge.At({30}), hinge.At({18}))};
  const SkeletonFit fit = Fit(scans, {.region = Region::kKnee, .joints = {{"patella", {}}}});
  EXPECT_EQ(fit.skeleton.joints[1].dofs.size(), 1u) << "as the preset has it";
  EXPECT_TRUE(fit.skeleton.joints[2].dofs.empty());
  EXPECT_TRUE(fit.skeleton.joints[2].drivers.empty());
  ExpectSamePoses(fit, scans);
}

TEST(FitSkeleton, ADoubtfulFitHardlyCounts) {
  const Planted hinge{NearTheGap({0, 0, 0}), {Eigen::Vector3d::UnitZ()}};
  const RigidTransform wrong = Exp((Twist() << 1.5, 0, 0, 30, 0, 0).finished());
  const std::vector<Artifact<BoneFits>> scans = {ScanOf(hinge.At({30})), ScanOf(hinge.At({60})),
                                                 ScanOf(wrong, {}, true)};
  const SkeletonFit fit = Fit(scans, TibiaWith({"flexion"}));
  EXPECT_LT((fit.skeleton.joints[1].dofs[0].axis - Eigen::Vector3d::UnitZ()).norm(), 0.03);
  EXPECT_LT(AcrossMm(fit.skeleton.joints[1].centre, hinge.centre, {0, 0, 1}), 1.0);
  EXPECT_NEAR(DegFromRad(fit.skeleton.joints[1].dofs[0].max_rad), 65, 1.0);
  ExpectSamePoses(fit, scans);
}

TEST(FitSkeleton, LimitsSayWhatTheScansShow) {
  const double value = RadFromDeg(1);  // or 1 mm
  const ScannedRange turn = ScannedRangeOf(
      {"flexion", {1, 0, 0}, RadFromDeg(-10) - kLimitMarginRad, value + kLimitMarginRad}, false);
  EXPECT_NEAR(turn.min_rad, RadFromDeg(-10), 1e-12);
  EXPECT_NEAR(turn.max_rad, value, 1e-12);
  const double margin = ValueOfShift(kLimitMarginMm);
  const ScannedRange shift = ScannedRangeOf({"flexion_shift", {1, 0, 0}, -margin, value + margin}, true);
  EXPECT_EQ(shift.min_rad, 0) << "the template's";
  EXPECT_NEAR(ShiftMm(shift.max_rad), 1, 1e-12);
}

// A scan that is in doubt shows no motion that the joint may be posed in.
TEST(FitSkeleton, ADoubtfulFitDoesNotWidenTheLimits) {
  const Planted hinge{NearTheGap({0, 0, 0}), {Eigen::Vector3d::UnitZ()}};
  const auto limits_deg = [&](bool doubtful) {
    const SkeletonFit fit =
        Fit({ScanOf(hinge.At({30})), ScanOf(hinge.At({60})), ScanOf(hinge.At({120}), {}, doubtful)},
            TibiaWith({"flexion"}));
    const DegreeOfFreedom& flexion = fit.skeleton.joints[1].dofs[0];
    return std::pair(DegFromRad(flexion.min_rad), DegFromRad(flexion.max_rad));
  };
  EXPECT_NEAR(limits_deg(false).second, 125, 0.5);
  EXPECT_NEAR(limits_deg(true).second, 65, 0.5);
  EXPECT_NEAR(limits_deg(true).first, -5, 0.5);
}

TEST(FitSkeleton, ADoubtfulParentHardlyCounts) {
  const Planted hinge{NearTheGap({0, 0, 0}), {Eigen::Vector3d::UnitZ()}};
  BoneFits astray = *ScanOf(hinge.At({120}));
  astray[0].doubt = Doubt::kBone;
  const SkeletonFit fit =
      Fit({ScanOf(hinge.At({30})), ScanOf(hinge.At({60})), {{}, std::make_shared<BoneFits>(astray)}},
          TibiaWith({"flexion"}));
  EXPECT_NEAR(DegFromRad(fit.skeleton.joints[1].dofs[0].max_rad), 65, 0.5);
}

// Across an axis a tilt is normal in two directions, so of its length exp(-r^2 / 2) is beyond r standard
// deviations: a twentieth beyond the root of -2 log(1/20). Variances as of AxisVariances: a turn of t shows 2
// sin(t / 2) of a tilt, and a joint's own play is a degree.
TEST(FitSkeleton, AnAxisIsWithinItsBoundNineteenTimesInTwenty) {
  BoneSet set = TwoBonesAndAFollower();
  for (Bone& bone : set.bones) bone.box.extent_mm = {10, 10, 10};  // no length says where the axis lies
  const Planted hinge{NearTheGap({0, 0, 0}), {Eigen::Vector3d::UnitZ()}};
  const double spread_deg = 0.5, play_deg = 1;
  std::vector<Artifact<BoneFits>> scans;
  double squares = 0;
  for (const double bend_deg : {20.0, 45.0, 70.0}) {
    BoneFits fits = *ScanOf(hinge.At({bend_deg}));
    fits[1].covariance.topLeftCorner<3, 3>() =
        std::pow(RadFromDeg(spread_deg), 2) * Eigen::Matrix3d::Identity();
    scans.push_back({{}, std::make_shared<BoneFits>(fits)});
    squares += std::pow(2 * std::sin(RadFromDeg(bend_deg) / 2), 2);
  }
  StageContext context{SharedBackend(), {}};
  const Artifact<BoneSet> bones{{}, std::make_shared<BoneSet>(set)};
  const auto fit = FitSkeleton::Run({bones, scans}, TibiaWith({"flexion"}, Region::kCustom), context);
  const double variance_deg2 = (spread_deg * spread_deg + play_deg * play_deg) / squares;
  const double expected_deg = std::sqrt(-2 * std::log(0.05) * variance_deg2);
  EXPECT_NEAR(DegFromRad(fit.AxisWithinRad(1, 0)), expected_deg, 0.02 * expected_deg);
}

// How far a bone strays goes with its own joint and the one above.
TEST(FitSkeleton, InAChainTheDriversAreTheOwnJointAndTheParents) {
  BoneSet chain = TwoBonesAndAFollower();
  chain.bones[2].parent = 1;
  StageContext context{SharedBackend(), {}};
  const Artifact<BoneSet> bones{{}, std::make_shared<BoneSet>(chain)};
  const FitSkeleton::Options options{.region = Region::kCustom,
                                     .joints = {{"tibia", {"flexion"}}, {"patella", {"flexion"}}}};
  const SkeletonFit fit = FitSkeleton::Run({bones, {}}, options, context);
  EXPECT_EQ(fit.skeleton.joints[1].drivers, std::vector<int>{1}) << "the root has no joint";
  EXPECT_EQ(fit.skeleton.joints[2].drivers, (std::vector<int>{2, 1}));
}

TEST(FitSkeleton, WithoutMotionTheBoxDecides) {
  const SkeletonFit fit = Fit({}, TibiaWith({"flexion", "abduction", "rotation"}));
  EXPECT_TRUE(fit.skeleton.joints[1].dofs[0].axis.isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_LT((fit.skeleton.joints[1].centre.lps - NearTheGap({0, 0, 0}).lps).norm(), 0.5);
}

TEST(FitSkeleton, AnUnknownBoneIsRefused) {
  EXPECT_THROW(Fit({}, {.joints = {{"humerus", {"flexion"}}}}), InputError);
}

class AnalysePoseOf : public testing::TestWithParam<std::vector<std::string>> {};

TEST_P(AnalysePoseOf, RoundTripOnRandomPoses) {
  const Planted saddle{NearTheGap({0, 0, 0}), {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()}};
  const Skeleton skeleton =
      Fit({ScanOf(saddle.At({40, 10})), ScanOf(saddle.At({20, 30}))}, TibiaWith(GetParam())).skeleton;
  std::srand(3);
  for (int trial = 0; trial < 20; ++trial) {
    PoseVector pose;
    for (int b = 0; b < 3; ++b) pose.push_back(Exp(Twist::Random()));
    const PoseAnalysis analysis = AnalysePose(skeleton, pose);
    const PoseVector back = ForwardKinematics(skeleton, analysis.angles, analysis.root, analysis.residuals);
    for (int b = 0; b < 3; ++b) EXPECT_TRUE(back[b].Matrix().isApprox(pose[b].Matrix(), 1e-9));
  }
}

INSTANTIATE_TEST_SUITE_P(TwoAndSix, AnalysePoseOf,
                         testing::Values(std::vector<std::string>{"flexion", "abduction"}, kSix));

}  // namespace
}  // namespace kvx

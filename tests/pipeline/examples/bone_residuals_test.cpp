// A kneecap that glides as the knee bends: it has no angle of its own, so its whole motion is a residual.
#include "pipeline/examples/bone_residuals.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

enum { kFemur, kTibia, kPatella, kBones };
constexpr double kScansDeg[] = {25, 50, 80};

// It turns by 0.88 of the knee's angle, about a centre far from the origin.
Twist Glide(double knee_deg) {
  const Eigen::Vector3d turn(0.88 * RadFromDeg(knee_deg), 0, 0), centre(-300, 220, 910);
  Twist out;
  out << turn, -turn.cross(centre);
  return out;
}

SkeletonFit Knee() {
  SkeletonFit fit;
  fit.skeleton.joints = {{.child = kFemur},
                         {.child = kTibia,
                          .parent = kFemur,
                          .centre = {{-300, 200, 900}},
                          .dofs = {{.name = "flexion", .axis = Eigen::Vector3d::UnitX()}}},
                         {.child = kPatella, .parent = kFemur, .centre = {{-300, 220, 910}}, .drivers = {1}}};
  for (const double deg : kScansDeg) {
    std::vector<Twist> residuals(kBones, Twist::Zero());
    residuals[kPatella] = Glide(deg);
    fit.scan_angles.push_back(JointAngles::Constant(1, RadFromDeg(deg)));
    fit.scan_residuals.push_back(residuals);
    fit.scan_roots.push_back({});
  }
  return fit;
}

double TurnDeg(const BoneResiduals& residuals, double knee_deg) {
  const Twist twist = residuals.At(JointAngles::Constant(1, RadFromDeg(knee_deg)))[kPatella];
  return DegFromRad(twist.head<3>().norm());
}

// As much of their own in every scan as they have in common: nearly all noise.
ExampleMoments NoisyTissue() {
  ExampleMoments moments;
  Eigen::MatrixXd of_bone = Eigen::MatrixXd::Identity(3, 3);
  of_bone.array() += 0.2;
  moments.of_bones.assign(kBones, of_bone);
  return moments;
}

// Of which one scan shows nothing near a bone.
ExampleMoments NoisyTissueHiding(int bone, int scan) {
  ExampleMoments moments = NoisyTissue();
  moments.hidden = Eigen::MatrixXi::Zero(kBones, 3);
  moments.hidden(bone, scan) = 1;
  return moments;
}

TEST(BoneResiduals, AreExactAtScans) {
  const SkeletonFit fit = Knee();
  const BoneResiduals residuals(fit, NoisyTissue());
  for (const double deg : kScansDeg) {
    const Twist twist = residuals.At(JointAngles::Constant(1, RadFromDeg(deg)))[kPatella];
    EXPECT_LT((twist - Glide(deg)).norm(), 1e-6 * Glide(deg).norm()) << deg;
  }
  EXPECT_LT(TurnDeg(residuals, 0), 1e-9);
}

// Mixed as the tissue's examples are, it lags by 5 to 30 degrees here.
TEST(BoneResiduals, ABoneDoesNotStayBehindBetweenScansBecauseItsTissueIsNoisy) {
  const BoneResiduals residuals(Knee(), NoisyTissue());
  for (const double deg : {12.0, 37.0, 65.0}) EXPECT_NEAR(TurnDeg(residuals, deg), 0.88 * deg, 1) << deg;
}

TEST(BoneResiduals, AScanThatHasLostABoneDoesNotPoseIt) {
  SkeletonFit fit = Knee();
  fit.scan_residuals[2][kPatella] = (Twist() << 0, 2.7, 0, 40, -60, 20).finished();
  const BoneResiduals residuals(fit, NoisyTissueHiding(kPatella, 2));
  for (const double deg : {37.0, 65.0, 80.0}) {
    const Twist twist = residuals.At(JointAngles::Constant(1, RadFromDeg(deg)))[kPatella];
    EXPECT_NEAR(DegFromRad(twist[0]), 0.88 * deg, 4) << deg;
    EXPECT_NEAR(twist[1], 0, 1e-9) << deg;
  }
}

// Relative to a femur that was not found, where the kneecap was found says nothing.
TEST(BoneResiduals, AScanThatHasLostABonesParentDoesNotPoseItEither) {
  SkeletonFit fit = Knee();
  fit.scan_residuals[1][kPatella] = (Twist() << 0, 2.7, 0, 40, -60, 20).finished();
  EXPECT_NEAR(TurnDeg(BoneResiduals(fit, NoisyTissueHiding(kFemur, 1)), 50), 0.88 * 50, 4);
}

TEST(BoneResiduals, WithoutScansThereAreNone) {
  SkeletonFit fit = Knee();
  fit.scan_angles.clear(), fit.scan_residuals.clear(), fit.scan_roots.clear();
  EXPECT_EQ(TurnDeg(BoneResiduals(fit, {}), 30), 0);
}

}  // namespace
}  // namespace kvx

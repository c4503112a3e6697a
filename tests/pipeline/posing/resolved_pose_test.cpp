// Requests of every kind become bone poses and coefficients.
#include "pipeline/posing/resolved_pose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"

namespace kvx {
namespace {

// A chain of three bones with one hinge each, one of them dependent, and two scans with residuals.
struct Chain {
  Chain() {
    for (int bone = 0; bone < 3; ++bone) {
      Joint joint{.child = bone, .parent = bone - 1, .centre = {{0, 30.0 * bone, 5}}};
      if (bone > 0) joint.dofs = {{.name = "flexion", .axis = Eigen::Vector3d(1, 0.1, 0).normalized()}};
      fit.skeleton.joints.push_back(joint);
    }
    for (const double a : {0.5, 1.1}) {
      std::vector<Twist> residuals(3, Twist::Zero());
      residuals[1] << 0, 0.02 * a, 0.01, 0.3, -0.2 * a, 0.1;
      residuals[2] << 0, -0.01, 0.02 * a, 0.1 * a, 0.2, 0.4;
      fit.scan_angles.push_back(Eigen::Vector2d(a, 0.6 * a));
      fit.scan_residuals.push_back(residuals);
      fit.scan_roots.push_back(Exp((Twist() << 0.1, 0.2 * a, 0, 5, -3, 2 * a).finished()));
      scan_poses.push_back(
          ForwardKinematics(fit.skeleton, fit.scan_angles.back(), fit.scan_roots.back(), residuals));
    }
    space = PoseSpace(fit);
    residuals = BoneResiduals(fit, {});
  }
  ResolvedPose Resolve(const PoseRequest& request, DeformationMode mode = DeformationMode::kEvd) const {
    return PoseResolver{bones, scans, neutral, fit, scan_poses, space, residuals}.Resolve(request, mode);
  }
  std::vector<std::string> bones{"a", "b", "c"}, scans{"half", "full"};
  std::string neutral = "neutral";
  SkeletonFit fit;
  std::vector<PoseVector> scan_poses;
  PoseSpace space;
  BoneResiduals residuals;
};

void ExpectSame(const RigidTransform& a, const RigidTransform& b, double tolerance) {
  EXPECT_LT((a.Matrix() - b.Matrix()).cwiseAbs().maxCoeff(), tolerance);
}

TEST(ResolvedPose, AScansAnglesGiveItsBonesBackUpToTheRoot) {
  const Chain chain;
  for (int k = 0; k < 2; ++k) {
    const JointAngles& a = chain.fit.scan_angles[k];
    const ResolvedPose pose = chain.Resolve(AnglePose{{{"b.flexion", a[0]}, {"c.flexion", a[1]}}});
    for (int bone = 0; bone < 3; ++bone) {
      ExpectSame(chain.fit.scan_roots[k] * pose.scan_from_template[bone], chain.scan_poses[k][bone], 1e-9);
      EXPECT_NEAR(pose.coefficients(bone, k), 1, 1e-6);
      EXPECT_NEAR(pose.coefficients(bone, 1 - k), 0, 1e-6);
    }
    EXPECT_EQ(pose.extrapolation.maxCoeff(), 0);
  }
}

TEST(ResolvedPose, AScanByNameIsAsItWasRegistered) {
  const Chain chain;
  const ResolvedPose pose = chain.Resolve(ScanPose{"full"});
  for (int bone = 0; bone < 3; ++bone)
    ExpectSame(pose.scan_from_template[bone], chain.scan_poses[1][bone], 0.0 + 1e-15);
  EXPECT_TRUE(pose.coefficients.col(1).isOnes());
  EXPECT_TRUE(pose.coefficients.col(0).isZero());
}

TEST(ResolvedPose, TissueComesToRestInElasticPosesAndIsAtRestInScans) {
  const Chain chain;
  const AnglePose bent{{{"b.flexion", 0.8}}};
  const ResolvedPose elastic = chain.Resolve(bent, DeformationMode::kElastic), evd = chain.Resolve(bent);
  EXPECT_TRUE(elastic.elastic);
  EXPECT_FALSE(evd.elastic || chain.Resolve(bent, DeformationMode::kVbd).elastic);
  EXPECT_FALSE(chain.Resolve(ScanPose{"full"}, DeformationMode::kElastic).elastic);
  EXPECT_EQ(elastic.coefficients, evd.coefficients);
  EXPECT_FALSE(IsSame(elastic, evd));
}

TEST(ResolvedPose, MoreThanAFullTurnIsRefused) {
  const Chain chain;
  EXPECT_NO_THROW(chain.Resolve(AnglePose{{{"b.flexion", RadFromDeg(-360)}}}));
  for (const double angle : {RadFromDeg(361), -RadFromDeg(361), 1e300})
    EXPECT_THROW(chain.Resolve(AnglePose{{{"b.flexion", angle}}}), InputError) << angle;
}

TEST(ResolvedPose, ABoneBeyondAllMeasureIsRefused) {
  const Chain chain;
  const auto moved_by = [](double mm) {
    return BonePose{{{"b", {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, mm, 0)}}}};
  };
  EXPECT_NO_THROW(chain.Resolve(moved_by(5000)));
  for (const double mm : {2e6, -1e300}) EXPECT_THROW(chain.Resolve(moved_by(mm)), InputError) << mm;
}

TEST(ResolvedPose, TheTemplateIsTheIdentityByNameAndByAngles) {
  const Chain chain;
  for (const PoseRequest& request : {PoseRequest(ScanPose{"neutral"}), PoseRequest(AnglePose{})}) {
    const ResolvedPose pose = chain.Resolve(request);
    for (const RigidTransform& t : pose.scan_from_template) ExpectSame(t, {}, 1e-9);
    EXPECT_LT(pose.coefficients.cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(ResolvedPose, BonesLeftOutFollowTheirParent) {
  const Chain chain;
  const RigidTransform moved = Exp((Twist() << 0.3, 0, 0.1, 4, 5, 6).finished());
  const ResolvedPose pose = chain.Resolve(BonePose{{{"b", moved}}});
  ExpectSame(pose.scan_from_template[0], {}, 1e-15);
  ExpectSame(pose.scan_from_template[1], moved, 1e-15);
  ExpectSame(pose.scan_from_template[2], moved, 1e-15);
}

TEST(ResolvedPose, BonesOfAScanGiveItsExample) {
  const Chain chain;
  BonePose request;
  for (int bone = 0; bone < 3; ++bone)
    request.scan_from_template[chain.bones[bone]] = chain.scan_poses[0][bone];
  const ResolvedPose pose = chain.Resolve(request);
  EXPECT_GT(pose.coefficients.col(0).minCoeff(), 0.9);  // the angles are fitted, the residuals are not
  EXPECT_LT(pose.coefficients.col(1).cwiseAbs().maxCoeff(), 0.1);
}

TEST(ResolvedPose, VbdTakesNoExample) {
  const Chain chain;
  EXPECT_TRUE(chain.Resolve(ScanPose{"half"}, DeformationMode::kVbd).coefficients.isZero());
}

TEST(ResolvedPose, UnknownNamesSayWhatExists) {
  const Chain chain;
  const auto message = [&](const PoseRequest& request) -> std::string {
    try {
      chain.Resolve(request);
    } catch (const NotFound& error) {
      return error.what();
    }
    return "nothing was thrown";
  };
  EXPECT_THAT(message(ScanPose{"fist"}),
              testing::AllOf(testing::HasSubstr("neutral"), testing::HasSubstr("full")));
  EXPECT_THAT(message(BonePose{{{"d", {}}}}), testing::HasSubstr("a, b, c"));
  EXPECT_THAT(message(AnglePose{{{"b.twist", 0.1}}}), testing::HasSubstr("b.flexion"));
}

}  // namespace
}  // namespace kvx

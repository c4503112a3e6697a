// Tissues of a rod of bone in a ball, whose layers are known.
#include "pipeline/phantom/anatomy/tissue_intensity.h"

#include <gtest/gtest.h>

#include "tests/support/bone_in_a_ball.h"

namespace kvx::phantom {
namespace {

using testing_support::BoneInABall;
using V = Eigen::Vector3d;

TEST(TissueModel, BonesHaveMarrowUnderTheirCortex) {
  const BoneInABall body{RigidTransform{}};
  const PhantomBone& rod = body.anatomy().bones[0];
  const TissueModel tissues(body.anatomy(), 7);
  const auto below = [&](const V& surface, double depth_mm) {
    return tissues.At(surface - depth_mm * surface.normalized(), 0.1).tissue;
  };
  const V side(0, BoneInABall::kRodMm, 0), end(0, 0, 12 + BoneInABall::kRodMm);
  EXPECT_EQ(below(side, -0.2), Tissue::kDeepFat);
  EXPECT_EQ(below(side, 0.2), Tissue::kCortical);
  EXPECT_EQ(below(side, rod.cortex_shaft_mm - 0.2), Tissue::kCortical);
  EXPECT_EQ(below(side, rod.cortex_shaft_mm + 0.2), Tissue::kMarrow);
  EXPECT_EQ(below(end, rod.cortex_end_mm - 0.2), Tissue::kCortical);
  EXPECT_EQ(below(end, rod.cortex_end_mm + 0.2), Tissue::kMarrow);
}

TEST(TissueModel, TheSkinLiesBetweenFatAndAir) {
  const BoneInABall body{RigidTransform{}};
  const TissueModel tissues(body.anatomy(), 7);
  const auto at = [&](double depth_mm) {
    return tissues.At(V(BoneInABall::kRadiusMm - depth_mm, 0, 0), 0.1).tissue;
  };
  EXPECT_EQ(at(-0.2), Tissue::kAir);
  EXPECT_EQ(at(0.2), Tissue::kSkin);
  EXPECT_EQ(at(body.anatomy().skin_mm - 0.2), Tissue::kSkin);
  EXPECT_EQ(at(body.anatomy().skin_mm + 0.2), Tissue::kSubcutaneousFat);
}

}  // namespace
}  // namespace kvx::phantom

// How much of the motion is the bone's own, by its part of the trilinear weight.
#include "core/bone_border.h"

#include <gtest/gtest.h>

#include <array>

namespace kvx {
namespace {

// Of two corners of the bone, one with `part` of it.
BoneShare OfBoneWith(double part) {
  const std::array parts{0.25 * part, 0.75 * part, 1 - part};
  return ShareOfBone(parts, std::array{3, 3, kNoBone});
}

TEST(ShareOfBone, IsAllFromHalfOnAndTheTrilinearPartUpToAThird) {
  for (const auto& [part, share] :
       {std::pair(0.1, 0.1), {1.0 / 3, 1.0 / 3}, {5.0 / 12, 2.0 / 3}, {0.5, 1.0}, {0.8, 1.0}, {1.0, 1.0}}) {
    EXPECT_EQ(OfBoneWith(part).bone, 3) << part;
    EXPECT_NEAR(OfBoneWith(part).share, share, 1e-12) << part;
  }
}

TEST(ShareOfBone, IsOfTheBoneWithTheMostWeightOverAllCorners) {
  const std::array parts{0.3, 0.2, 0.2, 0.3};
  const BoneShare most = ShareOfBone(parts, std::array{5, 2, 2, kNoBone});
  EXPECT_EQ(most.bone, 2);
  EXPECT_NEAR(most.share, 0.6, 1e-12) << "4 times 0.4, less 1";
}

TEST(ShareOfBone, IsNoneWhereNoCornerIsOfABone) {
  const BoneShare none = ShareOfBone(std::array{0.5, 0.5}, std::array{kNoBone, kNoBone});
  EXPECT_EQ(none.bone, kNoBone);
  EXPECT_EQ(none.share, 0);
}

}  // namespace
}  // namespace kvx

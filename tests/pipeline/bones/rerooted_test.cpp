// The tree turned round: the same joints, another way through them.
#include "pipeline/bones/rerooted.h"

#include <gtest/gtest.h>

#include <set>

namespace kvx {
namespace {

// palm -> (thumb, index -> tip)
BoneSet Hand() {
  BoneSet bones;
  bones.bones = {{.label = 4, .name = "palm"},
                 {.label = 3, .name = "thumb", .parent = 0},
                 {.label = 2, .name = "index", .parent = 0},
                 {.label = 1, .name = "tip", .parent = 2}};
  return bones;
}

std::set<std::set<std::string>> JointsOf(const BoneSet& bones) {
  std::set<std::set<std::string>> joints;
  for (const Bone& bone : bones.bones) {
    if (bone.parent != kNoParent) joints.insert({bone.name, bones.bones[size_t(bone.parent)].name});
  }
  return joints;
}

TEST(Rerooted, HasTheSameJointsFromEveryRoot) {
  const BoneSet bones = Hand();
  for (int root = 0; root < bones.size(); ++root) {
    const Rerooted other = RootedAt(bones, root);
    ASSERT_EQ(other.bones.size(), bones.size());
    EXPECT_EQ(JointsOf(other.bones), JointsOf(bones));
    EXPECT_EQ(other.bones.bones[0].parent, kNoParent);
    for (int b = 0; b < other.bones.size(); ++b) {
      const Bone& bone = other.bones.bones[size_t(b)];
      EXPECT_LT(bone.parent, b) << "parents come first";
      EXPECT_EQ(bone.label, bones.bones[size_t(other.order[size_t(b)])].label);
    }
  }
}

TEST(Rerooted, FromTheTipTheFingerIsWalkedBackwards) {
  const Rerooted other = RootedAt(Hand(), 3);
  EXPECT_EQ(other.order, (std::vector<int>{3, 2, 0, 1}));
  EXPECT_EQ(other.bones.bones[2].parent, 1) << "the palm hangs on the index";
  EXPECT_EQ(other.bones.bones[3].parent, 2) << "the thumb still on the palm";
}

TEST(Rerooted, FitsComeBackInTheOrderTheyWereIn) {
  const Rerooted other = RootedAt(Hand(), 3);
  BoneFits fits(4);
  for (size_t b = 0; b < 4; ++b) fits[b].note = other.bones.bones[b].name;
  const BoneFits back = other.InOrder(fits);
  for (size_t b = 0; b < 4; ++b) EXPECT_EQ(back[b].note, Hand().bones[b].name);
}

TEST(Rerooted, ASmallRootIsNoPlaceToBeginAt) {
  BoneSet bones = Hand();
  bones.bones[0].voxels = 100;
  bones.bones[2].voxels = 400;
  EXPECT_EQ(RootToSearchFrom(bones), 0);
  bones.bones[2].voxels = 401;
  EXPECT_EQ(RootToSearchFrom(bones), 2);
}

}  // namespace
}  // namespace kvx

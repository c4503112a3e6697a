// Bone lists: order, refusals, presets.
#include "pipeline/bones/bone_set/bone_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"
#include "core/region_presets.h"

namespace kvx {
namespace {

using testing::HasSubstr;

void ExpectRefused(const std::vector<StudyBone>& bones, const std::string& word) {
  try {
    OrderedBones(bones);
    ADD_FAILURE() << "accepted; expected a word about: " << word;
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(word));
  }
}

TEST(BoneTree, ParentsComeBeforeChildren) {
  const auto bones =
      OrderedBones({{3, "tip", "middle"}, {2, "middle", "base"}, {7, "base", ""}, {4, "other", "base"}});
  ASSERT_EQ(bones.size(), 4u);
  EXPECT_EQ(bones[0].name, "base");
  EXPECT_EQ(bones[0].label, 7);
  for (size_t b = 0; b < bones.size(); ++b) EXPECT_LT(bones[b].parent, int(b));
}

TEST(BoneTree, RefusesWhatIsNotATree) {
  ExpectRefused({}, "no bones");
  ExpectRefused({{1, "a", ""}, {2, "b", "c"}}, "'c'");
  ExpectRefused({{1, "a", ""}, {2, "b", "c"}, {3, "c", "b"}}, "cycle");
  ExpectRefused({{1, "a", "a"}}, "cycle");
  ExpectRefused({{1, "a", ""}, {2, "b", ""}}, "root");
  ExpectRefused({{1, "a", ""}, {2, "a", "a"}}, "twice");
  ExpectRefused({{1, "a", ""}, {1, "b", "a"}}, "two bones");
  ExpectRefused({{0, "a", ""}}, "label");
  ExpectRefused({{1, "", ""}}, "name");
}

TEST(RegionPresets, AreTreesWithTheDegreesOfThePaper) {
  const auto dofs = [](Region region) {
    int count = 0;
    for (const PresetBone& bone : RegionPreset(region)) count += int(bone.dofs.size());
    return count;
  };
  EXPECT_EQ(RegionPreset(Region::kHand).size(), 20u);
  EXPECT_EQ(dofs(Region::kHand), 23);
  EXPECT_EQ(dofs(Region::kKnee), 1);
  EXPECT_TRUE(RegionPreset(Region::kCustom).empty());
  for (const Region region : {Region::kHand, Region::kKnee}) {
    std::vector<StudyBone> bones;
    for (const PresetBone& bone : RegionPreset(region))
      bones.push_back({int(bones.size()) + 1, bone.name, bone.parent});
    EXPECT_NO_THROW(OrderedBones(bones));
  }
}

}  // namespace
}  // namespace kvx

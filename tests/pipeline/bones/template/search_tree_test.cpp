// The tree turned round: the same joints, another way through them. Trees that are not those of the joints.
#include "pipeline/bones/template/search_tree.h"

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

TEST(SearchTree, HasTheSameJointsFromEveryRoot) {
  const BoneSet bones = Hand();
  for (int root = 0; root < bones.size(); ++root) {
    const SearchTree other = RootedAt(bones, root);
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

TEST(SearchTree, FromTheTipTheFingerIsWalkedBackwards) {
  const SearchTree other = RootedAt(Hand(), 3);
  EXPECT_EQ(other.order, (std::vector<int>{3, 2, 0, 1}));
  EXPECT_EQ(other.bones.bones[2].parent, 1) << "the palm hangs on the index";
  EXPECT_EQ(other.bones.bones[3].parent, 2) << "the thumb still on the palm";
}

TEST(SearchTree, FitsComeBackInTheOrderTheyWereIn) {
  const SearchTree other = RootedAt(Hand(), 3);
  BoneFits fits(4);
  for (size_t b = 0; b < 4; ++b) fits[b].note = other.bones.bones[b].name;
  const BoneFits back = other.InOrder(fits);
  for (size_t b = 0; b < 4; ++b) EXPECT_EQ(back[b].note, Hand().bones[b].name);
}

// The same with a finger of three bones and a thumb of one, each 4 voxels long, one voxel apart. `parents` in
// the order palm, thumb, first, second, last.
BoneSet InARow(const std::vector<int>& parents) {
  Grid grid;
  grid.size = {20, 8, 3};
  grid.spacing_mm.setConstant(3);
  BoneSet bones;
  bones.labels = LabelMap(grid);
  const std::vector<std::string> names{"palm", "thumb", "first", "second", "last"};
  const std::vector<Eigen::Vector2i> starts{{0, 1}, {0, 5}, {5, 1}, {10, 1}, {15, 1}};
  for (size_t b = 0; b < names.size(); ++b) {
    bones.bones.push_back({.label = int(b) + 1, .name = names[b], .parent = parents[b], .voxels = 4});
    for (int i = 0; i < 4; ++i) bones.labels(starts[b].x() + i, starts[b].y(), 1) = uint16_t(b + 1);
  }
  return bones;
}

TEST(SearchTree, OfJointsThatMeetIsTheStudysOwn) {
  EXPECT_FALSE(TreeToSearch(InARow({kNoParent, 0, 0, 2, 3})));
}

TEST(SearchTree, BonesThatHangOnOneFarAwayHangOnTheNearest) {
  const BoneSet chained = InARow({kNoParent, 0, 0, 2, 3});
  const auto of_star = TreeToSearch(InARow({kNoParent, 0, 0, 0, 0})),
             of_list = TreeToSearch(InARow({kNoParent, 4, 0, 2, 3}));
  ASSERT_TRUE(of_star && of_list);
  EXPECT_EQ(JointsOf(of_star->bones), JointsOf(chained));
  EXPECT_EQ(of_star->bones.bones[0].name, "palm");
  EXPECT_EQ(JointsOf(of_list->bones), JointsOf(chained));
}

// Of two knees that face each other the patellae come nearest, 24 mm.
TEST(SearchTree, AnotherLimbHangsByTheLargestBones) {
  Grid grid;
  grid.size = {30, 12, 3};
  grid.spacing_mm.setConstant(3);
  BoneSet bones;
  bones.labels = LabelMap(grid);
  const auto add = [&](const char* name, int parent, Eigen::Vector2i first, Eigen::Vector2i size) {
    const int label = bones.size() + 1;
    bones.bones.push_back({.label = label, .name = name, .parent = parent, .voxels = size_t(size.prod())});
    for (int j = 0; j < size.y(); ++j)
      for (int i = 0; i < size.x(); ++i) bones.labels(first.x() + i, first.y() + j, 1) = uint16_t(label);
  };
  add("femur", kNoParent, {1, 6}, {5, 6});
  add("tibia", 0, {1, 1}, {5, 4});
  add("patella", 1, {7, 4}, {1, 3});
  add("femur_r", 0, {18, 6}, {5, 6});
  add("tibia_r", 3, {18, 1}, {5, 4});
  add("patella_r", 4, {16, 4}, {1, 3});
  const auto tree = TreeToSearch(bones);
  ASSERT_TRUE(tree);
  EXPECT_TRUE(JointsOf(tree->bones).contains({"femur", "femur_r"}));
  EXPECT_FALSE(JointsOf(tree->bones).contains({"patella", "patella_r"}));
}

TEST(SearchTree, ASmallRootIsNoPlaceToBeginAt) {
  BoneSet bones = InARow({kNoParent, 0, 0, 2, 3});
  bones.bones[0].voxels = 100;
  bones.bones[2].voxels = 400;
  EXPECT_FALSE(TreeToSearch(bones));
  bones.bones[2].voxels = 401;
  const auto tree = TreeToSearch(bones);
  ASSERT_TRUE(tree);
  EXPECT_EQ(tree->bones.bones[0].name, "first");
  EXPECT_EQ(JointsOf(tree->bones), JointsOf(bones));
}

}  // namespace
}  // namespace kvx

// Specks of drawn label maps go; pieces of a bone stay; what a bone encloses is bone.
#include "pipeline/segmentation/mend_labels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

// Of `label`, from one corner to the other.
void Fill(LabelMap& map, const Eigen::Vector3i& low, const Eigen::Vector3i& high, int label) {
  for (int k = low.z(); k < high.z(); ++k) {
    for (int j = low.y(); j < high.y(); ++j) {
      for (int i = low.x(); i < high.x(); ++i) map(i, j, k) = uint16_t(label);
    }
  }
}

// Two bars side by side, of 800 voxels each.
LabelMap TwoBars() {
  LabelMap map(testing_support::ObliqueGrid({60, 30, 20}));
  Fill(map, {5, 5, 5}, {55, 9, 9}, 3);
  Fill(map, {5, 9, 5}, {55, 13, 9}, 7);
  return map;
}

TEST(StrayVoxels, AreSpecksApartFromTheirLabel) {
  LabelMap map = TwoBars();
  EXPECT_THAT(StrayVoxels(map), IsEmpty());
  map(0, 0, 0) = 3, map(58, 28, 18) = 3;
  Fill(map, {20, 20, 10}, {22, 22, 11}, 7);
  map(30, 11, 7) = 3;  // in the other bar
  EXPECT_THAT(StrayVoxels(map), ElementsAre(Pair(3, SizeIs(3)), Pair(7, SizeIs(4))));
}

TEST(StrayVoxels, WhatTouchesByACornerBelongsToIt) {
  LabelMap map = TwoBars();
  map(4, 4, 4) = 3, map(3, 3, 3) = 3;
  EXPECT_THAT(StrayVoxels(map), IsEmpty());
}

TEST(StrayVoxels, LargePiecesAreBonesOfOneLabel) {
  LabelMap map = TwoBars();
  Fill(map, {5, 20, 5}, {10, 22, 7}, 3);  // a fortieth: a carpal bone of a block
  EXPECT_THAT(StrayVoxels(map), IsEmpty());
}

TEST(StrayVoxels, OfASmallBoneFewVoxelsAreMany) {
  LabelMap map(testing_support::ObliqueGrid({30, 30, 20}));
  Fill(map, {5, 5, 5}, {8, 8, 10}, 2);  // 45 voxels
  Fill(map, {20, 20, 10}, {23, 21, 11}, 2);
  EXPECT_THAT(StrayVoxels(map), ElementsAre(Pair(2, SizeIs(3))));
  Fill(map, {20, 20, 10}, {24, 21, 11}, 2);
  EXPECT_THAT(StrayVoxels(map), IsEmpty()) << "four voxels are a twelfth of it";
}

TEST(StrayVoxels, DustIsNotTakenApart) {
  LabelMap map(testing_support::ObliqueGrid({30, 30, 20}));
  for (int k = 0; k < 20; k += 2) {
    for (int j = 0; j < 30; j += 2) {
      for (int i = 0; i < 30; i += 2) map(i, j, k) = 1;
    }
  }
  EXPECT_THAT(StrayVoxels(map), IsEmpty());
}

TEST(EnclosedVoxels, AreThoseWithoutAWayOut) {
  LabelMap map = TwoBars();
  map(20, 7, 7) = 0, map(21, 7, 7) = 0;
  map(30, 7, 7) = 0, map(30, 8, 7) = 0;  // beside the other bar
  map(40, 7, 7) = 0, map(40, 7, 8) = 0;  // open
  EXPECT_THAT(EnclosedVoxels(map), ElementsAre(Pair(3, SizeIs(2))));
}

TEST(EnclosedVoxels, ATubeThatTheViewCutsIsOpen) {
  LabelMap map(testing_support::ObliqueGrid({20, 12, 10}));
  Fill(map, {0, 3, 2}, {20, 9, 8}, 5);
  Fill(map, {0, 5, 4}, {20, 7, 6}, 0);
  EXPECT_THAT(EnclosedVoxels(map), IsEmpty()) << "it may be a vertebra's canal";
  Fill(map, {0, 5, 4}, {1, 7, 6}, 5);
  Fill(map, {19, 5, 4}, {20, 7, 6}, 5);
  EXPECT_THAT(EnclosedVoxels(map), ElementsAre(Pair(5, SizeIs(18 * 4))));
}

TEST(MendLabels, GivesTheMapBackThatWasSpoilt) {
  const LabelMap clean = TwoBars();
  LabelMap map = clean;
  map(1, 1, 1) = 3, map(58, 28, 18) = 7;  // specks
  map(30, 11, 7) = 3;                     // one within the other bar
  map(15, 6, 6) = 0;                      // a hole
  const MendedLabels mended = MendLabels(map);
  EXPECT_EQ(mended.labels.values, clean.values);
  EXPECT_THAT(mended.strays, ElementsAre(Pair(3, SizeIs(2)), Pair(7, SizeIs(1))));
  EXPECT_THAT(mended.filled, ElementsAre(Pair(3, SizeIs(1)), Pair(7, SizeIs(1))));
  EXPECT_EQ(MendLabels(clean).labels.values, clean.values);
}

}  // namespace
}  // namespace kvx

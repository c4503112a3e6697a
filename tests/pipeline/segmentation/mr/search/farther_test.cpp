// A rod of marrow in a dark shell, found half; a farther search finds the other half and a block of fat.
#include "pipeline/segmentation/mr/search/farther.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace kvx {
namespace {

constexpr double kMarrow = 200, kClearRise = 0.1;
const Eigen::Vector3i kAxis(0, 9, 8);

Grid GridOfScan() {
  Grid grid;
  grid.size = {30, 18, 16};
  grid.origin = {{7, -3, 5}};
  return grid;
}

// By the largest coordinate: marrow within 2 of the axis, the shell at 3, from 3 to 26 along i.
int FromAxis(const Eigen::Vector3i& p) { return (p - kAxis).tail<2>().cwiseAbs().maxCoeff(); }
bool InRod(const Eigen::Vector3i& p) { return p.x() >= 3 && p.x() <= 26 && FromAxis(p) <= 3; }
bool InMarrow(const Eigen::Vector3i& p) { return p.x() > 3 && p.x() < 26 && FromAxis(p) <= 2; }
bool InFat(const Eigen::Vector3i& p) { return p.x() > 5 && p.x() < 11 && p.y() > 12 && p.y() < 16; }

Volume RodInFat() {
  Volume scan(GridOfScan(), 190.0f);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3i p = scan.grid.Ijk(v);
    if (InRod(p)) scan.values[v] = InMarrow(p) ? 200.0f : 60.0f;
  }
  return scan;
}

template <class Inside>
FoundBone Found(const VoxelBox& box, float lean, Inside&& inside) {
  const Grid part = GridOf(box, GridOfScan());
  FoundBone bone{1, box, Mask(part), Image<float>(part, lean), false, Mask(part)};
  ForEachVoxel(box, GridOfScan(), [&](const Eigen::Vector3i& p, size_t at, size_t) {
    const Eigen::Vector3i in_scan = p + box.low;
    bone.mask.values[at] = inside(in_scan);
    bone.marrow.values[at] = inside(in_scan) && InMarrow(in_scan);
  });
  return bone;
}

FoundBone RodUpTo(int end) {
  return Found({{1, 4, 3}, {end + 3, 15, 14}}, 0.5f,
               [=](const Eigen::Vector3i& p) { return InRod(p) && p.x() < end; });
}

FoundBone HalfOfTheRod() { return RodUpTo(14); }

int Count(const FoundBone& bone) {
  return int(std::count(bone.mask.values.begin(), bone.mask.values.end(), 1));
}

TEST(WithEnds, AnEndInCortexIsAddedAndFatIsNot) {
  const FoundBone farther =
      Found({{0, 2, 2}, {30, 18, 16}}, 0.25f, [](const Eigen::Vector3i& p) { return InRod(p) || InFat(p); });
  const FoundBone whole = WithEnds(HalfOfTheRod(), farther, RodInFat(), kMarrow, kClearRise);
  EXPECT_EQ(whole.box.low, Eigen::Vector3i(0, 2, 2));
  EXPECT_EQ(whole.box.high, Eigen::Vector3i(30, 18, 16));
  ForEachVoxel(whole.box, GridOfScan(), [&](const Eigen::Vector3i& p, size_t at, size_t) {
    const Eigen::Vector3i in_scan = p + whole.box.low;
    ASSERT_EQ(whole.mask.values[at] != 0, InRod(in_scan)) << in_scan.transpose();
    ASSERT_EQ(whole.marrow.values[at] != 0, InMarrow(in_scan)) << in_scan.transpose();
    if (InRod(in_scan)) {
      ASSERT_EQ(whole.lean.values[at], in_scan.x() < 14 ? 0.5f : 0.25f);
    }
  });
}

TEST(WithEnds, WhatIsNoClearerThanAskedStaysOut) {
  const FoundBone half = HalfOfTheRod();
  const FoundBone farther = Found({{0, 2, 2}, {30, 18, 16}}, 0.25f, InRod);
  const FoundBone same = WithEnds(half, farther, RodInFat(), kMarrow, 0.8);
  EXPECT_EQ(Count(same), Count(half));
}

// The end's surface rises by 0.3, which is the most that a face says. Of 24 slices of the rod 7 of 17 are
// less than half a bone, 13 of 11 more.
TEST(WithEnds, WhatIsLargeForAnEndHasToBeClearer) {
  const FoundBone farther = Found({{0, 2, 2}, {30, 18, 16}}, 0.25f, InRod);
  EXPECT_EQ(Count(WithEnds(RodUpTo(20), farther, RodInFat(), kMarrow, 0.25)), Count(farther));
  EXPECT_EQ(Count(WithEnds(RodUpTo(14), farther, RodInFat(), kMarrow, 0.25)), Count(RodUpTo(14)));
  EXPECT_EQ(Count(WithEnds(RodUpTo(14), farther, RodInFat(), kMarrow, 0.15)), Count(farther));
}

TEST(WithEnds, OfNothingFoundIsWhatEndsInCortex) {
  const VoxelBox box{{0, 2, 2}, {30, 18, 16}};
  const FoundBone nothing = Found(box, 0.0f, [](const Eigen::Vector3i&) { return false; });
  const FoundBone farther = Found(box, 0.25f, InRod);
  EXPECT_EQ(WithEnds(nothing, farther, RodInFat(), kMarrow, kClearRise).mask.values, farther.mask.values);
}

}  // namespace
}  // namespace kvx

// Bars of bone that are one piece, with a joint whose place is known.
#include "pipeline/segmentation/ct/part_bones.h"

#include <gtest/gtest.h>

#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

constexpr int kLength = 40, kWidth = 11, kJoint = 27;

// One bar along i, all of it given to bone 1. Strokes of both bones lie near its low end and its high end.
struct Bar {
  Volume hu;
  LabelMap strokes, found;

  Bar() {
    Grid grid;
    grid.size = {kLength + 4, kWidth + 4, kWidth + 4};
    grid.spacing_mm = {1.0, 1.1, 0.9};
    grid.origin = {{3, -8, 21}};
    hu = Volume(grid, 40);
    strokes = LabelMap(grid);
    found = LabelMap(grid);
    for (size_t v = 0; v < hu.values.size(); ++v) {
      if (!InBar(grid.Ijk(v))) continue;
      hu.values[v] = 400;
      found.values[v] = 1;
    }
    for (int i = 4; i < 8; ++i) strokes(i, 7, 7) = 1;
    for (int i = 36; i < 40; ++i) strokes(i, 7, 7) = found(i, 7, 7) = 2;
  }
  static bool InBar(const Eigen::Vector3i& p) {
    return p.minCoeff() >= 2 && p.x() < kLength + 2 && p.y() < kWidth + 2 && p.z() < kWidth + 2;
  }
  // Voxels of the bar more than `margin` from the joint that have the other bone's label.
  size_t Wrong(const LabelMap& parted, int margin) const {
    size_t wrong = 0;
    for (size_t v = 0; v < parted.values.size(); ++v) {
      const int beyond = parted.grid.Ijk(v).x() - kJoint;
      if (found.values[v] == 0 || std::abs(beyond) <= margin) continue;
      wrong += parted.values[v] != (beyond < 0 ? 1 : 2);
    }
    return wrong;
  }
};

// Half way between the strokes would be at 22.
TEST(PartedBones, MeetInAValleyOfTheDensity) {
  Bar bar;
  for (size_t v = 0; v < bar.hu.values.size(); ++v) {
    if (bar.found.values[v] != 0 && bar.hu.grid.Ijk(v).x() == kJoint) bar.hu.values[v] = 250;
  }
  EXPECT_EQ(bar.Wrong(PartedBones(bar.hu, bar.strokes, bar.found), 0), 0u);
  const LabelMap in_blocks = PartedBones(bar.hu, bar.strokes, bar.found, 1000);
  EXPECT_EQ(bar.Wrong(in_blocks, 1), 0u);
}

// The 605 voxels between half way and the valley are nearer to the other strokes, and all say the same.
TEST(PartedBones, MeetInAShallowValleyFarFromStrokes) {
  Bar bar;
  for (size_t v = 0; v < bar.hu.values.size(); ++v) {
    if (bar.found.values[v] != 0 && bar.hu.grid.Ijk(v).x() == kJoint) bar.hu.values[v] = 385;
  }
  EXPECT_EQ(bar.Wrong(PartedBones(bar.hu, bar.strokes, bar.found), 0), 0u);
}

TEST(PartedBones, MeetInANeck) {
  Bar bar;
  for (size_t v = 0; v < bar.hu.values.size(); ++v) {
    const Eigen::Vector3i p = bar.hu.grid.Ijk(v);
    if (p.x() == kJoint && (p.tail<2>().array() - 7).abs().maxCoeff() > 1)
      bar.found.values[v] = 0, bar.hu.values[v] = 40;
  }
  EXPECT_EQ(bar.Wrong(PartedBones(bar.hu, bar.strokes, bar.found), 0), 0u);
}

// A dense neck would be the shorter seam.
TEST(PartedBones, DoNotMeetAcrossCortex) {
  constexpr int kNeck = 17;
  Bar bar;
  for (size_t v = 0; v < bar.hu.values.size(); ++v) {
    if (bar.found.values[v] == 0) continue;
    const Eigen::Vector3i p = bar.hu.grid.Ijk(v);
    const bool in_rod = (p.tail<2>().array() - 7).abs().maxCoeff() <= 2;
    if (in_rod && p.x() > 8 && p.x() < kJoint - 1) bar.hu.values[v] = 800;
    if (p.x() == kJoint) bar.hu.values[v] = 340;
    if (p.x() == kNeck && !in_rod) bar.found.values[v] = 0, bar.hu.values[v] = 40;
  }
  EXPECT_EQ(bar.Wrong(PartedBones(bar.hu, bar.strokes, bar.found), 0), 0u);
}

TEST(PartedBones, KeepTheirStrokesAndWhatNoStrokeGetsTo) {
  Bar bar;
  bar.strokes(37, 9, 9) = 1;  // a stroke of the first bone deep in the second
  bar.found(0, 0, 0) = 2;
  const LabelMap parted = PartedBones(bar.hu, bar.strokes, bar.found);
  EXPECT_EQ(parted(37, 9, 9), 1);
  EXPECT_EQ(parted(38, 7, 7), 2);
  EXPECT_EQ(parted(0, 0, 0), 2);
  for (size_t v = 0; v < parted.values.size(); ++v)
    EXPECT_EQ(parted.values[v] == 0, bar.found.values[v] == 0);
}

TEST(PartedBones, AreNoneWithoutBones) {
  const Bar bar;
  const LabelMap parted = PartedBones(bar.hu, bar.strokes, LabelMap(bar.hu.grid));
  EXPECT_EQ(std::ranges::count(parted.values, 0), std::ptrdiff_t(parted.values.size()));
}

}  // namespace
}  // namespace kvx

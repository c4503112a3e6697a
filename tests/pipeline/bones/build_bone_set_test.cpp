// Boxes and bone sets of drawn label maps.
#include "pipeline/bones/build_bone_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"
#include "pipeline/bones/bone_set/oriented_box.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/drawn_box.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {
using namespace testing_support;

TEST(OrientedBox, OfARotatedBoxOnAnObliqueGrid) {
  const Grid grid = ObliqueGrid({60, 50, 40});
  const Eigen::Vector3d centre = MiddleOf(grid), along = kAxes.col(0);
  const OrientedBox box = FitOrientedBox(DrawnBox(grid, centre, 5), 5, {PointMm{centre - 40 * along}});
  EXPECT_GT(box.axes.col(0).dot(along), std::cos(RadFromDeg(1.5)));
  EXPECT_GT(std::abs(box.axes.col(1).dot(kAxes.col(1))), std::cos(RadFromDeg(3)));
  EXPECT_NEAR(box.axes.determinant(), 1, 1e-9);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(box.extent_mm[a], 2 * kHalf[a], 1.5) << "axis " << a;
  EXPECT_LT((box.origin.lps - (centre - kHalf[0] * along)).norm(), 1.2);
}

TEST(OrientedBox, TheBaseIsTheEndTowardsTheParent) {
  const Grid grid = ObliqueGrid({60, 50, 40});
  const Eigen::Vector3d centre = MiddleOf(grid), along = kAxes.col(0);
  const LabelMap labels = DrawnBox(grid, centre, 5);
  const OrientedBox there = FitOrientedBox(labels, 5, {PointMm{centre + 40 * along}});
  EXPECT_LT(there.axes.col(0).dot(along), -0.99);
  EXPECT_LT((there.origin.lps - (centre + kHalf[0] * along)).norm(), 1.2);
  EXPECT_THROW(FitOrientedBox(labels, 6, {PointMm{centre}}), InputError);
}

struct Built {
  ScratchFolder folder;
  std::filesystem::path path = folder.path() / "labels.nii.gz";
  Artifact<Scan> scan{{}, std::make_shared<Scan>()};
  Grid grid = ObliqueGrid({60, 50, 40});

  explicit Built(int first = 1, int second = 2) {
    auto value = std::make_shared<Scan>();
    value->volume = Volume(grid);
    scan.value = value;
    const Eigen::Vector3d middle = MiddleOf(grid);
    // On another, coarser grid than the scan's; 255 is a label that no study lists.
    const Grid other = Coarsened(grid, 2);
    LabelMap map = DrawnBox(other, middle - 14.5 * kAxes.col(0), first);
    map = DrawnBox(other, middle + 14.5 * kAxes.col(0), second, map);
    map.values[0] = 255;
    WriteLabels(path, map);
  }
  BoneSet Run(const BuildBoneSet::Options& options) {
    StageContext context{SharedBackend(), {}};
    const BuildBoneSet::Inputs inputs{scan, {}, path};
    return BuildBoneSet::Run(inputs, options, context);
  }
};

TEST(BuildBoneSet, ResamplesLabelsAndMeasuresBones) {
  Built built;
  const BoneSet bones = built.Run({.bones = {{2, "tip", "base"}, {1, "base", ""}}});
  ASSERT_EQ(bones.size(), 2);
  EXPECT_EQ(bones.bones[0].name, "base");
  EXPECT_EQ(bones.bones[1].parent, 0);
  EXPECT_TRUE(bones.labels.grid == built.grid);
  EXPECT_THAT(bones.labels.values, testing::Each(testing::Le(2)));
  const Eigen::Vector3d tip = MiddleOf(built.grid) + 14.5 * kAxes.col(0);
  EXPECT_LT((bones.bones[1].centroid.lps - tip).norm(), 0.7);
  const double box_voxels = 8 * kHalf.prod() / built.grid.spacing_mm.prod();
  EXPECT_NEAR(double(bones.bones[1].voxels), box_voxels, 0.15 * box_voxels);
  EXPECT_GT(bones.bones[1].box.axes.col(0).dot(kAxes.col(0)), 0.99);
}

TEST(BuildBoneSet, TakesThePresetsNamesInTheirOrder) {
  Built built;
  const BoneSet bones = built.Run({.region = Region::kKnee});
  ASSERT_EQ(bones.size(), 2);
  EXPECT_EQ(bones.bones[0].name, "femur");
  EXPECT_EQ(bones.bones[1].name, "tibia");
}

TEST(BuildBoneSet, ABoneWhoseParentIsNotInTheMapHangsOnTheNextOne) {
  Built built(1, 3);
  const BoneSet bones = built.Run({.region = Region::kKnee});
  ASSERT_EQ(bones.size(), 2);
  EXPECT_EQ(bones.bones[1].name, "fibula");
  EXPECT_EQ(bones.bones[1].parent, 0) << "the femur, where there is no tibia";
}

// A voxel elsewhere would make the box as long as the view.
TEST(BuildBoneSet, StrayVoxelsDoNotCount) {
  Built built;
  const BuildBoneSet::Options options{.bones = {{1, "base", ""}, {2, "tip", "base"}}};
  const BoneSet clean = built.Run(options);
  LabelMap map = ReadLabels(built.path);
  map(1, 1, 1) = 2, map(28, 23, 18) = 1;
  WriteLabels(built.path, map);
  const BoneSet with = built.Run(options);
  EXPECT_EQ(with.labels.values, clean.labels.values);
  for (int b = 0; b < 2; ++b) {
    EXPECT_EQ(with.bones[b].voxels, clean.bones[b].voxels);
    EXPECT_EQ(with.bones[b].box.extent_mm, clean.bones[b].box.extent_mm);
    EXPECT_EQ(with.mending.stray_voxels[b], 1u);
    EXPECT_EQ(clean.mending.stray_voxels[b], 0u);
  }
}

TEST(BuildBoneSet, MarrowWithALabelOfItsOwnIsBone) {
  Built built;
  const BuildBoneSet::Options options{.bones = {{1, "base", ""}, {2, "tip", "base"}}};
  const BoneSet clean = built.Run(options);
  const LabelMap given = ReadLabels(built.path);
  LabelMap map = given;
  const size_t row = size_t(map.grid.size.x()), slice = row * size_t(map.grid.size.y());
  size_t marrow = 0;
  for (size_t v = slice; v + slice < map.values.size(); ++v) {
    bool within = given.values[v] == 1;
    for (const size_t step : {size_t(1), row, slice})
      within = within && given.values[v - step] == 1 && given.values[v + step] == 1;
    if (within) map.values[v] = 101, ++marrow;
  }
  ASSERT_GT(marrow, 0u);
  map(1, 1, 1) = 101;
  WriteLabels(built.path, map);
  const BoneSet with = built.Run(options);
  EXPECT_EQ(with.labels.values, clean.labels.values);
  EXPECT_EQ(with.mending.enclosed_voxels[0], 8 * marrow) << "on the template's voxels, half as wide";
  EXPECT_THAT(with.mending.unused_labels, testing::ElementsAre(101, 255));
}

std::string RefusalOf(Built& built, const BuildBoneSet::Options& options) {
  return testing_support::RefusalOf<InputError>([&] { built.Run(options); });
}

TEST(BuildBoneSet, AMapThatDoesNotTellItsBonesIsRefusedWithWhatToDo) {
  Built no_root(2, 3);
  EXPECT_THAT(RefusalOf(no_root, {.region = Region::kKnee}), testing::HasSubstr("femur, has no voxels"));
  Built elsewhere;
  auto moved = std::make_shared<Scan>();
  Grid far = elsewhere.grid;
  far.origin.lps += Eigen::Vector3d::Constant(1000);
  moved->volume = Volume(far);
  elsewhere.scan.value = moved;
  EXPECT_THAT(RefusalOf(elsewhere, {.region = Region::kKnee}), testing::HasSubstr("its place in the world"));
}

TEST(BuildBoneSet, RefusesPointsForBones) {
  Built built;
  LabelMap points(built.grid);
  points(3, 4, 5) = 1, points(6, 7, 5) = 2;
  WriteLabels(built.path, points);
  EXPECT_THAT(RefusalOf(built, {.region = Region::kKnee}), testing::HasSubstr("label whole bones"));
}

// All numbers of the list are among its greys.
TEST(BuildBoneSet, RefusesAScanForALabelMap) {
  Built built;
  LabelMap scan(built.grid);
  for (size_t v = 0; v < scan.values.size(); ++v) scan.values[v] = uint16_t(v * 2654435761u >> 7 & 255);
  WriteLabels(built.path, scan);
  EXPECT_THAT(RefusalOf(built, {.bones = {{1, "base", ""}, {2, "tip", "base"}}}),
              testing::HasSubstr("greys as a scan does"));
}

TEST(BuildBoneSet, RefusesAListedLabelWithoutVoxels) {
  Built built;
  EXPECT_THROW(built.Run({.bones = {{1, "base", ""}, {9, "lost", "base"}}}), InputError);
  EXPECT_THROW(built.Run({.region = Region::kCustom}), InputError);
}

}  // namespace
}  // namespace kvx

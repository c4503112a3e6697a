// A block of dense bone in muscle, pierced by a tube, or with a hollow.
#include "pipeline/segmentation/ct/canal.h"

#include <gtest/gtest.h>

#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

constexpr float kMuscleHu = 50, kBoneHu = 250, kCordHu = 20, kFatHu = -90;
using Voxel = Eigen::Vector3i;
const VoxelBox kBone{{6, 6, 6}, {26, 26, 20}}, kTube{{12, 12, 6}, {20, 20, 20}},
    kHollow{{12, 12, 8}, {20, 20, 18}};

struct Body {
  Volume scan;
  LabelMap labels, strokes;
};

// The bone's label has what is in `part` of it, too. `slices`: of the view.
Body Pierced(const VoxelBox& part, float hu, int slices = 26) {
  const Grid grid = testing_support::PlainGrid({32, 32, slices}, {1.5, 1.5, 2}, {0, 0, 0});
  Body body{Volume(grid, kMuscleHu), LabelMap(grid), LabelMap(grid)};
  const VoxelBox bone{kBone.low.cwiseMin(part.low), kBone.high.cwiseMax(part.high).cwiseMin(grid.size)};
  ForEachVoxel(bone, [&](const Voxel& p) {
    body.labels(p.x(), p.y(), p.z()) = 3;
    body.scan(p.x(), p.y(), p.z()) = part.Contains(p) ? hu : kBoneHu;
  });
  return body;
}

bool HasCanal(const Body& body) {
  return HoldsCanal(body.scan, body.labels, body.strokes, 3, BoxOf(body.labels, 3));
}

TEST(HoldsCanal, ATubeThatLeadsOutOfTheBoneIsOne) {
  Body body = Pierced(kTube, kCordHu);
  EXPECT_TRUE(HasCanal(body));
  for (int k = 8; k < 11; ++k) body.strokes(15, 15, k) = 3;
  EXPECT_FALSE(HasCanal(body)) << "its strokes say that it is bone";
  Body left_out = Pierced(kTube, kCordHu);
  ForEachVoxel(kTube, [&](const Voxel& p) { left_out.labels(p.x(), p.y(), p.z()) = 0; });
  EXPECT_FALSE(HasCanal(left_out));
}

TEST(HoldsCanal, WhatTheBoneEnclosesIsMarrow) {
  EXPECT_FALSE(HasCanal(Pierced(kHollow, kCordHu)));
  EXPECT_FALSE(HasCanal(Pierced(kHollow, kFatHu)));
}

TEST(HoldsCanal, ANarrowGapIsNone) { EXPECT_FALSE(HasCanal(Pierced({{14, 14, 6}, {17, 17, 20}}, kCordHu))); }

TEST(HoldsCanal, ATubeThatTheViewCutsTwiceIsOneButForFat) {
  const VoxelBox through{{12, 12, 0}, {20, 20, 14}};
  EXPECT_TRUE(HasCanal(Pierced(through, kCordHu, 14)));
  EXPECT_FALSE(HasCanal(Pierced(through, kFatHu, 14))) << "a shaft";
  EXPECT_FALSE(HasCanal(Pierced({{12, 12, 0}, {20, 20, 12}}, kCordHu, 14))) << "cut once";
}

}  // namespace
}  // namespace kvx

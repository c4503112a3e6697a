// A hollow ball whose marrow looks like muscle, found on large voxels and then on smaller ones.
#include "pipeline/segmentation/ct/finer_border.h"

#include <gtest/gtest.h>

#include <random>

#include "pipeline/scans/coarser.h"
#include "pipeline/segmentation/grow_bones.h"
#include "tests/support/dice.h"

namespace kvx {
namespace {

using testing_support::Dice;

struct Body {
  Volume scan;
  LabelMap truth, strokes;
};

// Muscle of 50 HU; a ball in the middle with a shell of 500 HU, a twelfth of its radius thick; noise.
Body MakeBody(const Eigen::Vector3i& size, double radius_mm) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = {0.5, 0.6, 0.6};
  Body body{Volume(grid), LabelMap(grid), LabelMap(grid)};
  const Eigen::Vector3d middle_mm = 0.5 * size.cast<double>().cwiseProduct(grid.spacing_mm);
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 20);
  for (size_t v = 0; v < body.scan.values.size(); ++v) {
    const Eigen::Vector3d mm = grid.Ijk(v).cast<double>().cwiseProduct(grid.spacing_mm) - middle_mm;
    const double depth_mm = radius_mm - mm.norm();
    const bool shell = depth_mm > 0 && depth_mm < radius_mm / 12;
    body.scan.values[v] = (shell ? 500.0f : 50.0f) + noise(random);
    body.truth.values[v] = depth_mm > 0;
    const bool line = std::abs(mm.y()) < 0.4 && std::abs(mm.z()) < 0.4;
    if (line && depth_mm > radius_mm / 4) body.strokes.values[v] = 1;
    if (line && depth_mm < -radius_mm / 4) body.strokes.values[v] = 255;
  }
  return body;
}

// The ball on blocks, moved by a block: what was found is wrong by one large voxel.
FoundBone MovedByABlock(const Body& body, const Eigen::Vector3i& block) {
  const BlockedBox all{{{0, 0, 0}, body.truth.grid.size}, block};
  Volume truth(body.truth.grid);
  for (size_t v = 0; v < truth.values.size(); ++v) truth.values[v] = body.truth.values[v];
  const Volume means = Coarser(truth, all);
  FoundBone found{1, all.box, Mask(means.grid), Image<float>(means.grid), false};
  for (size_t v = 0; v + 1 < means.values.size(); ++v) {
    found.mask.values[v + 1] = means.values[v] > 0.5f;
    found.lean.values[v + 1] = means.values[v] > 0.5f ? 1 : -1;
  }
  return found;
}

LabelMap OnScan(const FoundBone& found, const Grid& scan) {
  LabelMap labels(scan);
  ForEachVoxel(found.box, scan, [&](const auto&, size_t part, size_t whole) {
    labels.values[whole] = found.mask.values[part];
  });
  return labels;
}

TEST(FinerBorder, LiesWhereTheDensityFalls) {
  const Body body = MakeBody({64, 60, 56}, 12);
  const FoundBone found = MovedByABlock(body, {2, 2, 2});
  const FinerBorder finer{body.scan, body.strokes, 18, 1.13};
  const FoundBone border = finer.Of(found, {2, 2, 2}, {1, 1, 1});
  EXPECT_GT(Dice(OnScan(border, body.scan.grid), body.truth, 1), 0.98);
  EXPECT_LT(GridOf(border.box, body.scan.grid).VoxelCount(), body.scan.values.size());
}

TEST(FinerBorder, StrokesKeepTheirSides) {
  Body body = MakeBody({64, 60, 56}, 12);
  const FoundBone found = MovedByABlock(body, {2, 2, 2});
  for (int i = 30; i < 34; ++i) body.strokes(i, 30, 6) = 1, body.strokes(i, 30, 12) = 255;
  const FoundBone border = FinerBorder{body.scan, body.strokes, 18, 1.13}.Of(found, {2, 2, 2}, {1, 1, 1});
  const LabelMap labels = OnScan(border, body.scan.grid);
  for (int i = 30; i < 34; ++i) {
    EXPECT_EQ(labels(i, 30, 12), 0);
    EXPECT_EQ(labels(i, 30, 6), 1);
  }
}

// So large that it is found on blocks first.
TEST(CtBones, LargeOnesAreFoundAsWellAsSmallOnes) {
  const Body body = MakeBody({150, 140, 130}, 28);
  const GrownBones grown = GrowBones(body.scan, body.strokes, true, {});
  EXPECT_GT(Dice(grown.labels, body.truth, 1), 0.97);
}

}  // namespace
}  // namespace kvx

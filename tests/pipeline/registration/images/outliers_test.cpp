// Flat images, so that what they disagree in is known on paper.
#include "pipeline/registration/images/outliers.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace kvx {
namespace {

constexpr float kWeight = 0.5f, kScan = 7;

// Template and scan lie on the same grid; the template shows `off` more from voxel `from` of the first axis
// on.
BlockLevel Flat(const Eigen::Vector3i& size, int template_voxels, float off, int from) {
  BlockLevel level;
  level.grid.size = size;
  level.template_voxels = template_voxels;
  level.scan = Volume(level.grid, kScan);
  level.weight.assign(level.grid.VoxelCount(), kWeight);
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v)
    level.intensity.push_back(kScan + (level.grid.Ijk(v).x() < from ? 0 : off));
  return level;
}

// Weights along the first axis, through the middle of the others.
std::vector<float> Row(const BlockLevel& level) {
  std::vector<float> out;
  for (int i = 0; i < level.grid.size.x(); ++i)
    out.push_back(level.weight[level.grid.Index(i, level.grid.size.y() / 2, level.grid.size.z() / 2)]);
  return out;
}

std::vector<BlockLevel> Counted(float off) {
  std::vector<BlockLevel> levels = {Flat({32, 16, 16}, 1, off, 16), Flat({16, 8, 8}, 2, off, 8)};
  std::vector<Eigen::Vector3f> place;
  for (size_t v = 0; v < levels[0].grid.VoxelCount(); ++v)
    place.push_back(levels[0].grid.Ijk(v).cast<float>());
  CountOutliersLess(place, levels);
  return levels;
}

TEST(CountOutliersLess, LeavesWhatTheNoiseExplains) {
  for (const BlockLevel& level : Counted(1.4f))  // squared and weighted 0.98
    for (const float weight : level.weight) EXPECT_EQ(weight, kWeight);
}

TEST(CountOutliersLess, DividesByTheMeanOverTheCellsBeside) {
  const float beyond = kWeight * 4 * 4;
  const std::vector<BlockLevel> levels = Counted(4);
  const std::vector<float> fine = Row(levels[0]), coarse = Row(levels[1]);
  for (int i = 0; i < 32; ++i) {
    // Cells of two voxels; of the three in reach those from the eighth on disagree.
    const int disagree = std::clamp(i / 2 - 8 + 2, 0, 3);
    const float expected = kWeight / std::max(1.0f, beyond * float(disagree) / 3);
    EXPECT_NEAR(fine[size_t(i)], expected, 1e-6) << i;
    EXPECT_NEAR(coarse[size_t(i / 2)], fine[size_t(i / 2 * 2)], 1e-6) << i;
  }
}

}  // namespace
}  // namespace kvx

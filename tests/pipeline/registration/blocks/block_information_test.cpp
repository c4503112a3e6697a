// Which levels are judged by mutual information, and what a better one is worth.
#include "pipeline/registration/blocks/block_information.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

bool AppliesWith(int template_voxels) {
  BlockLevel level;
  level.grid.size = {2, 2, 2};
  level.template_voxels = template_voxels;
  level.intensity.assign(8, 1.0f), level.weight.assign(8, 1.0f);
  level.active = {0};
  return BlockInformation(level).Applies();
}

// The paper: MI for blocks of about 32 voxels, squares for those of about 16. The ball has 24 voxels of its
// level.
TEST(BlockInformation, AppliesToBallsOfThirtyTwoVoxelsOfTheTemplateAndMore) {
  EXPECT_FALSE(AppliesWith(1));
  EXPECT_TRUE(AppliesWith(2));
  EXPECT_TRUE(AppliesWith(4));
}

TEST(BlockInformation, AGainIsThatOfAllSamplesTogether) {
  const BlockInformation::Value before{.normalised = 0.2, .samples = 1000, .entropy_nats = 1.5},
      after{.normalised = 0.3, .samples = 900, .entropy_nats = 1.4};
  EXPECT_NEAR(BlockInformation::GainNats(before, after), 150, 1e-9);
}

}  // namespace
}  // namespace kvx

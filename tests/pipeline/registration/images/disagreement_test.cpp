// Flat images, so that what they disagree in is known on paper.
#include "pipeline/registration/images/disagreement.h"

#include <gtest/gtest.h>

#include "pipeline/registration/images/usual_residual.h"
#include "tests/support/in_place.h"

namespace kvx {
namespace {

using testing_support::InPlace;

constexpr float kWeight = 0.5f, kScan = 7;

// Template and scan lie on the same grid; the template shows `off` more than the scan from voxel `from` of
// the first axis on.
BlockLevel Flat(float off, int from = 0) {
  BlockLevel level;
  level.grid.size = {48, 16, 16};
  level.scan = Volume(level.grid, kScan);
  level.weight.assign(level.grid.VoxelCount(), kWeight);
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v)
    level.intensity.push_back(kScan + (level.grid.Ijk(v).x() < from ? 0 : off));
  return level;
}

TEST(DisagreementAround, IsTheWeightedSquareOverTheUsualOne) {
  const BlockLevel level = Flat(2);
  const Volume out = DisagreementAround(level, InPlace(level.grid));
  EXPECT_EQ(out.grid.size, Eigen::Vector3i(24, 8, 8));
  for (const float value : out.values) EXPECT_NEAR(value, kWeight * 2 * 2 / kUsualResidual, 1e-4);
}

// Of eight voxels that share a measurement each has an eighth of its weight, and differs as much.
TEST(DisagreementAround, IsTheSameHoweverManyVoxelsShareAMeasurement) {
  BlockLevel level = Flat(2);
  level.voxels_a_measurement = 8;
  for (float& weight : level.weight) weight /= 8;
  const Volume out = DisagreementAround(level, InPlace(level.grid));
  for (const float value : out.values) EXPECT_NEAR(value, kWeight * 2 * 2 / kUsualResidual, 1e-4);
}

TEST(DisagreementAround, IsThereWhereItIsAndFadesWithinSixCells) {
  const BlockLevel level = Flat(2, 24);
  const Volume out = DisagreementAround(level, InPlace(level.grid));
  const double there = kWeight * 2 * 2 / kUsualResidual;
  EXPECT_NEAR(out(20, 4, 4), there, 1e-3 * there);
  EXPECT_NEAR(out(11, 4, 4) + out(12, 4, 4), there, 1e-3 * there) << "either side of the edge";
  EXPECT_EQ(out(4, 4, 4), 0);
}

TEST(DisagreementAround, IsNotDilutedByVoxelsThatDoNotCount) {
  BlockLevel level = Flat(2);
  std::vector<Eigen::Vector3f> place = InPlace(level.grid);
  for (size_t v = 0; v < place.size(); ++v) {
    const int i = level.grid.Ijk(v).x();
    if (i < 20) place[v].x() += 1000;  // beyond the scan
    if (i >= 28) level.weight[v] = 0;
  }
  const Volume out = DisagreementAround(level, place);
  for (const int i : {8, 10, 12, 14}) EXPECT_NEAR(out(i, 4, 4), kWeight * 2 * 2 / kUsualResidual, 1e-3) << i;
  EXPECT_EQ(out(0, 4, 4), 0) << "nothing near counts";
}

}  // namespace
}  // namespace kvx

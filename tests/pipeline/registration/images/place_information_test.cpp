// On a linear ramp the slope is known everywhere, whatever the grid.
#include "pipeline/registration/images/place_information.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "pipeline/registration/images/usual_residual.h"
#include "tests/support/in_place.h"

namespace kvx {
namespace {

using testing_support::InPlace;

const Eigen::Vector3d kSlopePerMm(3, -2, 1);
constexpr float kWeight = 0.25f;

// Template and scan lie on grids of their own and show the same ramp, but for `off` in the template.
BlockLevel Ramp(float off) {
  BlockLevel level;
  level.grid.size = {12, 10, 8};
  level.grid.spacing_mm = {1.0, 1.5, 2.0};
  Grid scan;
  scan.size = {30, 30, 30};
  scan.spacing_mm = {1.2, 0.9, 1.1};
  scan.origin.lps = {-12, -10, -13};
  scan.direction = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 2).normalized()).toRotationMatrix();
  level.scan = Volume(scan);
  for (size_t v = 0; v < scan.VoxelCount(); ++v)
    level.scan.values[v] = float(kSlopePerMm.dot(scan.ToMm(PointVox{scan.Ijk(v).cast<double>()}).lps));
  for (size_t v = 0; v < level.grid.VoxelCount(); ++v) {
    const Eigen::Vector3d at = level.grid.ToMm(PointVox{level.grid.Ijk(v).cast<double>()}).lps;
    level.intensity.push_back(float(kSlopePerMm.dot(at)) + off);
    level.weight.push_back(kWeight);
  }
  return level;
}

Eigen::Matrix3f AtMiddle(const BlockLevel& level) {
  const std::vector<Eigen::Vector3f> place = InPlace(level.grid);
  return PlaceInformation(level, place)[Coarsened(level.grid, 2).Index(2, 2, 2)];
}

TEST(PlaceInformation, IsTheSlopeSquaredPerVarianceInTheScansFrame) {
  const Eigen::Matrix3f expected = (kWeight * kSlopePerMm * kSlopePerMm.transpose()).cast<float>();
  EXPECT_LT((AtMiddle(Ramp(0)) - expected).norm(), 1e-3 * expected.norm());
}

TEST(PlaceInformation, FallsWhereTheImagesDisagree) {
  const float off = 2;
  const double doubt = kWeight * off * off / kUsualResidual;
  const Eigen::Matrix3f sure = AtMiddle(Ramp(0)), unsure = AtMiddle(Ramp(off));
  EXPECT_LT((unsure * doubt - sure).norm(), 1e-3 * sure.norm());
}

TEST(PlaceInformation, IsNoneOutsideTheScanAndWhereNothingCounts) {
  BlockLevel level = Ramp(0);
  std::vector<Eigen::Vector3f> place = InPlace(level.grid);
  for (Eigen::Vector3f& p : place) p.x() += 1000;
  EXPECT_EQ(PlaceInformation(level, place)[0], Eigen::Matrix3f::Zero());
  std::fill(level.weight.begin(), level.weight.end(), 0.0f);
  EXPECT_EQ(AtMiddle(level), Eigen::Matrix3f::Zero());
}

}  // namespace
}  // namespace kvx

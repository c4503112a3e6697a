// What a registration says of how sure it is, against the errors that it has.
#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/registration/result/confidence.h"
#include "tests/support/limb.h"

namespace kvx {
namespace {
using namespace testing_support;
using namespace testing_support::limb;

TEST(Confidence, IsThatAVoxelsPlaceIsRightToHalfAVoxel) {
  Grid grid;
  grid.size = {5, 1, 1};
  grid.spacing_mm = {1, 2, 4};  // as wide as 2 mm on average
  Mask steps(grid);
  steps.values = {20, 2, 200, kPlaceErrorUnknown, kPlaceErrorInDoubt};
  const Mask percent = ConfidencePercent(steps);
  EXPECT_EQ(percent.values[0], 70) << "1 - exp(-1.2) where what is stated is half a voxel";
  EXPECT_EQ(percent.values[1], 100);
  EXPECT_EQ(percent.values[2], 6) << "1 - exp(-1.2 / 10^1.3)";
  EXPECT_EQ(percent.values[3], 0);
  EXPECT_EQ(percent.values[4], 0);
  Mask body(grid, 1);
  body.values[1] = 0;
  const ConfidenceSummary summary = Summarise(steps, body);
  EXPECT_DOUBLE_EQ(summary.mean_percent, (70 + 6) / 4.0);
  EXPECT_DOUBLE_EQ(summary.unsure_fraction, 0.75);
}

// Mean over soft tissue that `use` picks.
template <class Value, class Use>
double MeanOf(const Image<Value>& map, Use use) {
  double sum = 0, count = 0;
  for (size_t v = 0; v < map.values.size(); ++v) {
    const Eigen::Vector3d x = map.grid.ToMm(PointVox{map.grid.Ijk(v).template cast<double>()}).lps;
    if (!InBody(x) || FromAxis(x) < kBoneRadius + 4 || !use(x)) continue;
    sum += map.values[v], count += 1;
  }
  return sum / count;
}

TEST(RegisterScan, IsSureWhereTheImagesSaySoAndNotWhereTheScanEnds) {
  const RegisteredScan result =
      Register(Render(LimbGrid(), Identity, 1), Render(LimbGrid({48, 48, 30}), TemplateFromBumped, 2));
  const Mask percent = ConfidencePercent(result.place_error_steps);
  EXPECT_GT(MeanOf(percent, [](const auto& x) { return x.z() < 36; }), 70);
  EXPECT_EQ(MeanOf(percent, [](const auto& x) { return x.z() > 30 * kSpacing + 3; }), 0);
  EXPECT_GT(result.confidence.unsure_fraction, 0.1);
  EXPECT_LT(result.confidence.unsure_fraction, 0.6);
}

// As beside an implant.
TEST(RegisterScan, IsLessSureWhereTheScanShowsNoneOfTheTissue) {
  Scan other = Render(LimbGrid(), TemplateFromWideBump, 2);
  const Eigen::Vector3d middle = kCentre + Eigen::Vector3d(0, 16, -12);
  const auto from_void = [&](const auto& x) { return (x - middle).norm(); };
  for (size_t v = 0; v < other.volume.values.size(); ++v) {
    const Grid& grid = other.volume.grid;
    if (from_void(grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps) < 7) other.volume.values[v] = 5;
  }
  const Mask percent = ConfidencePercent(Register(Render(LimbGrid(), Identity, 1), other).place_error_steps);
  EXPECT_LT(MeanOf(percent, [&](const auto& x) { return from_void(x) < 6; }) + 10,
            MeanOf(percent, [&](const auto& x) { return from_void(x) > 16 && x.z() > 20 && x.z() < 52; }));
}

// The stated error beside the true one: two of three within it, nineteen of twenty within twice, on average
// over anatomies; in a world as smooth as this one it may be more, but not all.
TEST(RegisterScan, SaysInMmHowFarOffItMayBe) {
  const RegisteredScan result =
      Register(Render(LimbGrid(), Identity, 1), Render(LimbGrid({48, 48, 30}), TemplateFromBumped, 2));
  const Volume error_mm = PlaceErrorMm(result.place_error_steps);
  double within = 0, within_twice = 0, count = 0;
  for (size_t v = 0; v < error_mm.values.size(); ++v) {
    const Eigen::Vector3d x = error_mm.grid.ToMm(PointVox{error_mm.grid.Ijk(v).cast<double>()}).lps;
    const double stated_mm = error_mm.values[v];
    if (!InBody(x) || x.z() > 30 * kSpacing + 3) {
      EXPECT_TRUE(std::isnan(stated_mm));
    }
    if (!InBody(x) || FromAxis(x) < kBoneRadius + 4 || std::isnan(stated_mm)) continue;
    const double off_mm = (result.scan_from_template.values[v].cast<double>() - Bump(x)).norm();
    within += off_mm < stated_mm, within_twice += off_mm < 2 * stated_mm, count += 1;
  }
  EXPECT_GT(within / count, 0.5);
  EXPECT_LT(within / count, 0.99);
  EXPECT_GT(within_twice / count, 0.85);
}

}  // namespace
}  // namespace kvx

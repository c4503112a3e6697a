// Candidate scores: closed form on a linear ramp, and the CPU twin.
#include "kernels/bone_scores.h"

#include <gtest/gtest.h>

#include <random>

#include "kernels/reference/bone_scores.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

std::vector<BoneSample> RandomSamples(const LinearRamp& ramp, const Eigen::Vector3d& centre_mm, double gain,
                                      double bias) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-2.5, 2.5);
  std::vector<BoneSample> samples;
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d x(place(random), place(random), place(random));
    BoneSample sample;
    sample << x.cast<float>(), float(gain * ramp.At(PointMm{centre_mm + x}) + bias);
    samples.push_back(sample);
  }
  return samples;
}

VoxFromSample Place(const Grid& grid, const Eigen::Vector3d& centre_mm) {
  VoxFromSample out;
  out.leftCols<3>() = grid.VoxFromMm().cast<float>();
  out.col(3) = grid.ToVox(PointMm{centre_mm}).ijk.cast<float>();
  return out;
}

Eigen::Vector3d CentreOf(const Grid& grid) {
  return grid.ToMm(PointVox{0.5 * (grid.size.array() - 1).cast<double>().matrix()}).lps;
}

TEST(BoneScores, ALinearRampCorrelatesFullyWhateverGainAndBias) {
  const Grid grid = ObliqueGrid();
  const Eigen::Vector3d centre = CentreOf(grid);
  LinearRamp ramp;
  ramp.offset = -ramp.gradient_per_mm.dot(centre);  // centred, as scans are
  const DeviceScan scan(SharedBackend(), ramp.On(grid));
  const BoneScores scores(SharedBackend());
  for (const double gain : {1.0, 0.2, -3.0}) {
    const auto samples = RandomSamples(ramp, centre, gain, 4.0);
    const std::vector<VoxFromSample> there{Place(grid, centre)};
    const auto sums = scores(scan, samples, there);
    EXPECT_EQ(sums[0].count, 200);
    EXPECT_NEAR(Correlation(sums[0]), gain > 0 ? 1.0 : -1.0, 1e-4);
  }
}

TEST(BoneScores, AStepLooksAtAnEvenPartOfTheSamples) {
  const Grid grid = ObliqueGrid();
  const Eigen::Vector3d centre = CentreOf(grid);
  LinearRamp ramp;
  ramp.offset = -ramp.gradient_per_mm.dot(centre);
  auto samples = RandomSamples(ramp, centre, 1, 0);
  samples.resize(197);                                                    // not a whole number of blocks
  for (size_t n = 0; n < samples.size(); ++n) samples[n].w() = float(n);  // where it stands in the list
  const DeviceScan scan(SharedBackend(), ramp.On(grid));
  const std::vector<VoxFromSample> there{Place(grid, centre)};
  EXPECT_EQ(SamplesAtStep(197, 1), 197u);
  for (const int step : {1, 2, 3, 5}) {
    const CorrelationSums sums = BoneScores(SharedBackend())(scan, samples, there, step)[0];
    EXPECT_EQ(sums.count, float(SamplesAtStep(197, step))) << "step " << step;
    EXPECT_NEAR(sums.count, 197.0 / step, 16) << "step " << step;
    EXPECT_NEAR(sums.t / sums.count, 98, 12) << "the part leans to one end of the list, step " << step;
  }
}

// A scan of one voxel's thickness: no neighbours there, and nothing is read beyond its end.
TEST(BoneScores, ThinScansAgreeWithTheTwin) {
  for (const int axis : {0, 1, 2}) {
    Grid grid = ObliqueGrid();
    grid.size[axis] = 1;
    Volume noise(grid);
    std::mt19937 random(5);
    std::normal_distribution<float> value;
    for (float& v : noise.values) v = value(random);
    std::vector<BoneSample> samples;
    for (size_t v = 0; v < noise.values.size(); v += 3) {
      const Eigen::Vector3d x =
          grid.Ijk(v).cast<double>() - 0.5 * (grid.size.array() - 1).cast<double>().matrix();
      samples.emplace_back(float(x.x()), float(x.y()), float(x.z()), value(random));
    }
    VoxFromSample there = VoxFromSample::Zero();
    there.leftCols<3>().setIdentity();
    there.col(3) = (0.5f * (grid.size.array() - 1).cast<float>()).matrix();
    const std::vector<VoxFromSample> candidates{there};
    const auto device =
        BoneScores(SharedBackend())(DeviceScan(SharedBackend(), noise), samples, candidates)[0];
    const auto twin = reference::BoneScores(noise, samples, candidates)[0];
    EXPECT_EQ(device.count, twin.count) << "axis " << axis;
    EXPECT_NEAR(device.ts, twin.ts, 1e-2) << "axis " << axis;
  }
}

TEST(BoneScores, OutsideTheScanNothingCounts) {
  const LinearRamp ramp;
  const Grid grid = ObliqueGrid();
  const Eigen::Vector3d far = CentreOf(grid) + Eigen::Vector3d(500, 0, 0);
  const auto samples = RandomSamples(ramp, far, 1, 0);
  const std::vector<VoxFromSample> there{Place(grid, far)};
  const auto sums = BoneScores(SharedBackend())(DeviceScan(SharedBackend(), ramp.On(grid)), samples, there);
  EXPECT_EQ(sums[0].count, 0);
  EXPECT_EQ(Correlation(sums[0]), 0);
}

TEST(BoneScores, AgreesWithItsTwin) {
  const Grid grid = ObliqueGrid();
  Volume noise(grid);
  std::mt19937 random(3);
  std::normal_distribution<float> value;
  for (float& v : noise.values) v = value(random);
  const auto samples = RandomSamples(LinearRamp{.offset = 0}, CentreOf(grid), 0.1, 0);
  std::vector<VoxFromSample> candidates;
  for (int c = 0; c < 150; ++c) {  // some lie partly outside
    candidates.push_back(
        Place(grid, CentreOf(grid) + 4.0 * Eigen::Vector3d(value(random), value(random), value(random))));
  }
  const auto device = BoneScores(SharedBackend())(DeviceScan(SharedBackend(), noise), samples, candidates);
  const auto twin = reference::BoneScores(noise, samples, candidates);
  for (size_t c = 0; c < candidates.size(); ++c) {
    ASSERT_NEAR(device[c].count, twin[c].count, 1) << "a sample may fall on the border";
    if (device[c].count != twin[c].count) continue;
    EXPECT_NEAR(device[c].ts, twin[c].ts, 2e-2) << "candidate " << c;
    EXPECT_NEAR(Correlation(device[c]), Correlation(twin[c]), 1e-3) << "candidate " << c;
  }
}

}  // namespace
}  // namespace kvx

// SSD, CC and MI against values written down on paper; the mask, the overlap and the intensity scales.
#include "pipeline/measures/measures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "pipeline/measures/similarity.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

Volume Noise(const Grid& grid, int seed) {
  std::mt19937 random(seed);
  Volume out(grid);
  for (float& value : out.values) value = float(random() % 256);
  return out;
}

DisplacementField NoMotion(const Grid& grid) { return DisplacementField(grid, Eigen::Vector3f::Zero()); }

TEST(Similarity, FourPairsByHand) {
  // Bins (0,0) (0,1) (1,1) (1,1): p = 1/4, 1/4, 1/2; H(a) = ln 2, H(b) = ln 4 - 3/4 ln 3, H(a,b) = 3/2 ln 2.
  const std::vector<IntensityPair> pairs{{0, 1}, {2, 5}, {4, 6}, {7, 4}};
  const Measures m = Similarity(pairs);
  EXPECT_NEAR(m.ssd, std::sqrt((1 + 9 + 4 + 9) / 4.0), 1e-12);
  EXPECT_NEAR(m.cc, 10.0 / std::sqrt(26.75 * 14.0), 1e-12);
  EXPECT_NEAR(m.mi, std::log(2) + (std::log(4) - 0.75 * std::log(3)) - 1.5 * std::log(2), 1e-12);
}

TEST(Similarity, IndependentNoiseSharesNothing) {
  std::mt19937 random(5);
  std::vector<IntensityPair> pairs(400000);
  for (IntensityPair& pair : pairs) pair = {float(random() % 256), float(random() % 256)};
  const Measures m = Similarity(pairs);
  EXPECT_NEAR(m.cc, 0, 0.01);
  EXPECT_NEAR(m.mi, 63.0 * 63.0 / (2 * 400000.0), 1e-3) << "the known bias (bins - 1)^2 / 2n, no more";
}

TEST(Similarity, WithoutOverlapTheWorstValuesComeBack) {
  EXPECT_EQ(Similarity({}), (Measures{.ssd = 255, .cc = 0, .mi = 0}));
}

TEST(ByteScale, ThreeKindsOfIntensities) {
  Grid grid;
  grid.size = {4, 1, 1};
  Volume bytes(grid), ct(grid), mr(grid);
  bytes.values = {0, 128, 200, 255}, ct.values = {-1024, 40, 250, 3000}, mr.values = {100, 600, 700, 1100};
  EXPECT_FLOAT_EQ(ByteScaleOf(bytes)(128), 128);
  EXPECT_FLOAT_EQ(ByteScaleOf(ct)(-1024), 0);
  EXPECT_FLOAT_EQ(ByteScaleOf(ct)(250), 127.5f);
  EXPECT_FLOAT_EQ(ByteScaleOf(ct)(3000), 255);
  EXPECT_FLOAT_EQ(ByteScaleOf(mr)(100), 0);
  EXPECT_FLOAT_EQ(ByteScaleOf(mr)(600), 127.5f);
}

TEST(ByteScale, FloatsUpToOneAreNoBytes) {
  Volume bytes = Noise(ObliqueGrid(), 4), floats = bytes;
  for (float& value : floats.values) value /= 255;
  EXPECT_NEAR(ByteScaleOf(floats)(0.5f), 127.5, 0.01);
  EXPECT_FLOAT_EQ(ByteScaleOf(bytes)(0.5f), 0.5f);
}

// As of absorption per micrometre, or of diffusion in m2/s.
TEST(ByteScale, GreysMayBeOfAnySize) {
  Volume image(ObliqueGrid());
  for (const float size : {1e-12f, 1e-6f, 1.0f, 1e6f, 1e20f}) {
    for (size_t v = 0; v < image.values.size(); ++v) image.values[v] = size * float(v % 11) / 10;
    EXPECT_NEAR(ByteScaleOf(image)(0.3f * size), 0.3 * 255, 0.01) << size;
  }
  for (const float grey : {0.0f, 1e-12f, -5e5f}) {
    std::ranges::fill(image.values, grey);
    const float byte = ByteScaleOf(image)(grey);
    EXPECT_TRUE(byte >= 0 && byte <= 255) << grey << " everywhere";
  }
}

TEST(ByteScale, AFewVoxelsFarBelowZeroMakeNoCt) {
  Volume mr = Noise(ObliqueGrid(), 5);
  for (float& value : mr.values) value *= 100;
  mr.values[7] = -600;
  EXPECT_FLOAT_EQ(ByteScaleOf(mr)(-600), 0);
  EXPECT_NEAR(ByteScaleOf(mr)(12450), 127.5, 0.01) << "half way from -600 to 25500";
}

TEST(ByteScale, OneVoxelFarFromAllOthersChangesNothing) {
  const Volume bytes = Noise(ObliqueGrid(), 5);  // each value some ten times
  for (const float gain : {1.0f, 40.0f, 1 / 255.0f}) {
    Volume image = bytes;
    for (float& value : image.values) value *= gain;
    const ByteScale scale = ByteScaleOf(image);
    for (const float stray : {65535.0f, -32768.0f}) {
      image.values[7] = stray;
      EXPECT_EQ(ByteScaleOf(image).offset, scale.offset) << gain << ' ' << stray;
      EXPECT_EQ(ByteScaleOf(image).factor, scale.factor) << gain << ' ' << stray;
    }
  }
}

TEST(Measures, AnImageAndItself) {
  // Bytes in equal numbers: 64 bins, 1/64 each, so MI = entropy = ln 64.
  Grid grid;
  grid.size = {16, 16, 8};
  Volume image(grid);
  for (size_t v = 0; v < image.values.size(); ++v) image.values[v] = float(v % 256);
  const Measures m = Measure(SharedBackend(), {image, image}, Mask(grid, 1), NoMotion(grid));
  EXPECT_NEAR(m.ssd, 0, 1e-4);
  EXPECT_NEAR(m.cc, 1, 1e-9);
  EXPECT_NEAR(m.mi, std::log(64), 1e-9);
}

TEST(Measures, ALinearChangeOfIntensityKeepsTheCorrelation) {
  const Grid grid = ObliqueGrid();
  const Volume image = Noise(grid, 2);
  Volume darker = image;
  for (float& value : darker.values) value = 20 + 0.5f * value;
  const Measures m = Measure(SharedBackend(), {image, darker}, Mask(grid, 1), NoMotion(grid));
  EXPECT_NEAR(m.cc, 1, 1e-6);
  EXPECT_GT(m.ssd, 10);
}

TEST(Measures, OnlyTheMaskCounts) {
  const Grid grid = ObliqueGrid();
  const Volume image = Noise(grid, 3);
  Volume other = image;
  Mask mask(grid, 0);
  for (int k = 2; k < 9; ++k) mask(5, 6, k) = mask(8, 3, k) = 1;
  for (size_t v = 0; v < other.values.size(); ++v) {
    if (!mask.values[v]) other.values[v] = 255 - other.values[v];
  }
  EXPECT_NEAR(Measure(SharedBackend(), {image, other}, mask, NoMotion(grid)).ssd, 0, 1e-2);
}

TEST(Measures, ABrightVoxelOutsideTheBodyDoesNotCount) {
  const Grid grid = ObliqueGrid();
  Volume image = Noise(grid, 3), other = Noise(grid, 4);
  for (size_t v = 0; v < image.values.size(); ++v)
    image.values[v] *= 16, other.values[v] = 0.25f * other.values[v] + 12 * image.values[v] / 16;
  Mask mask(grid, 1);
  mask.values[7] = 0;
  const Measures before = Measure(SharedBackend(), {image, other}, mask, NoMotion(grid));
  EXPECT_GT(before.mi, 1);
  image.values[7] = 65535;
  EXPECT_EQ(Measure(SharedBackend(), {image, other}, mask, NoMotion(grid)), before);
}

TEST(Measures, TheScanIsLookedUpWhereTheFieldPoints) {
  const LinearRamp ramp;
  const Grid grid = ObliqueGrid();
  const RigidTransform motion = Exp((Twist() << 0.05, 0.1, -0.08, 0.9, -0.4, 0.7).finished());
  Volume posed(grid);  // template(v) = ramp(T v): carried by T it agrees with the ramp, without T it does not
  for (size_t v = 0; v < posed.values.size(); ++v) {
    posed.values[v] = float(ramp.At(motion * grid.ToMm(PointVox{grid.Ijk(v).cast<double>()})));
  }
  const Volume scan = ramp.On(grid);
  const Mask all(grid, 1);
  EXPECT_LT(Measure(SharedBackend(), {posed, scan}, all, FieldOf(motion, grid)).ssd, 0.01);
  EXPECT_GT(Measure(SharedBackend(), {posed, scan}, all, FieldOf(motion.Inverse(), grid)).ssd, 0.3);
  EXPECT_GT(Measure(SharedBackend(), {posed, scan}, all, NoMotion(grid)).ssd, 0.15);
  const RigidTransform away{Eigen::Quaterniond::Identity(), {1000, 0, 0}};
  EXPECT_EQ(Measure(SharedBackend(), {posed, scan}, all, FieldOf(away, grid)).ssd, 255);
}

TEST(Measures, TwiceTheSameDigits) {
  const Grid grid = ObliqueGrid();
  const auto once = [&] {
    return Measure(SharedBackend(), {Noise(grid, 1), Noise(grid, 2)}, Mask(grid, 1),
                   FieldOf(Exp((Twist() << 0.1, 0, 0, 1, 2, 0).finished()), grid));
  };
  EXPECT_EQ(once(), once());
}

}  // namespace
}  // namespace kvx

// Curves between the greys of two sequences, against curves that are known.
#include "pipeline/scans/contrast_map.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace kvx {
namespace {

template <class Curve>
GreyPairs Through(Curve curve, double noise = 0) {
  GreyPairs greys;
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 1);
  for (int n = 0; n <= 5000; ++n) {
    const float value = 0.04f * float(n);  // 0 .. 200
    greys.Add(value, float(curve(value) + noise * normal(random)));
  }
  return greys;
}

TEST(ContrastMap, AStraightLineUpwardsNeedsNone) {
  const GreyPairs greys = Through([](double x) { return 1.3 * x + 20; }, 5);
  EXPECT_FALSE(FitContrast(greys));
}

TEST(ContrastMap, InvertedAndBentContrastsAreFollowed) {
  const auto inverted = [](double x) { return 220 - 0.8 * x; };
  const auto bent = [](double x) { return 0.02 * x * (200 - x); };
  for (const std::function<double(double)>& curve : {std::function<double(double)>(inverted), {bent}}) {
    const GreyPairs greys = Through(curve, 3);
    const auto map = FitContrast(greys);
    ASSERT_TRUE(map);
    for (const float x : {10.0f, 60.0f, 100.0f, 155.0f, 190.0f}) EXPECT_NEAR((*map)(x), curve(x), 4) << x;
  }
}

TEST(ContrastMap, ReachesAsFarTowardsTheBrightAsTowardsTheDark) {
  const GreyPairs greys = Through([](double x) { return 220 - 0.8 * x; });  // of 0 to 200, all as often
  const auto map = FitContrast(greys);
  ASSERT_TRUE(map);
  const float most = map->low + map->step * float(map->at_knot.size() - 1);
  EXPECT_GT(map->low, 0);
  EXPECT_NEAR(200 - most, map->low, 0.05);
}

TEST(ContrastMap, UnrelatedImagesHaveNone) {
  const GreyPairs greys = Through([](double) { return 100; }, 30);
  EXPECT_FALSE(FitContrast(greys));
}

// Of half the places the scan shows any grey whatever.
GreyPairs Misplaced(GreyPairs greys) {
  std::mt19937 random(2);
  for (size_t n = 0; n < greys.in_scan.size(); n += 2)
    greys.in_scan[n] = greys.in_scan[random() % greys.in_scan.size()];
  return greys;
}

// A parabola leaves a line a sixteenth of its variance, and misplaced places a sixty-fourth more than that.
TEST(ContrastMap, ABendIsToldByWhatSurelyLiesRight) {
  const GreyPairs bent = Through([](double x) { return x * x / 200; }), all = Misplaced(bent);
  EXPECT_FALSE(FitContrast(bent));
  EXPECT_FALSE(FitContrast(all));
  EXPECT_FALSE(FitContrast(all, {}));
  const auto map = FitContrast(all, bent);
  ASSERT_TRUE(map);
  EXPECT_GT((*map)(180) - (*map)(140), 3 * ((*map)(60) - (*map)(20)));
}

// As a coil's shadow does, or bones that lie a little beside their places: most is left by both.
TEST(ContrastMap, NorIsABendThatExplainsLittleOfWhatALineLeaves) {
  const auto slightly = [](double x) { return x + 0.001 * x * x; };
  const GreyPairs shaded = Through(slightly, 40), quiet = Through(slightly, 1);
  EXPECT_FALSE(FitContrast(Misplaced(shaded), shaded));
  EXPECT_FALSE(FitContrast(Misplaced(quiet), quiet)) << "there a line is enough";
  const GreyPairs line = Through([](double x) { return 1.3 * x + 20; }, 5);
  EXPECT_FALSE(FitContrast(Misplaced(line), line));
}

// A line explains nine tenths of it, as of scans that differ in nothing but noise.
TEST(ContrastMap, TissueThatHasGoneDarkIsABend) {
  const GreyPairs greys = Through([](double x) { return x < 80 ? 0.3 * x : 0.9 * x; }, 10), none;
  EXPECT_FALSE(FitContrast(greys));
  const auto map = FitContrast(greys, none);
  ASSERT_TRUE(map);
  EXPECT_NEAR((*map)(40), 12, 3);
  EXPECT_NEAR((*map)(150), 135, 3);
  EXPECT_FALSE(FitContrast(Through([](double x) { return 0.9 * x; }, 18), none)) << "but noise is none";
}

TEST(ContrastMap, FlatOrEmptyImagesHaveNone) {
  GreyPairs flat;
  for (int n = 0; n < 100; ++n) flat.Add(7, 7);
  EXPECT_FALSE(FitContrast(flat));
  const GreyPairs none, all = Through([](double x) { return 220 - x; });
  EXPECT_FALSE(FitContrast(none, none));
  EXPECT_FALSE(FitContrast(none, all));
  EXPECT_TRUE(FitContrast(all, none));
}

}  // namespace
}  // namespace kvx

// Curves between the greys of two sequences, against curves that are known.
#include "pipeline/scans/contrast_map.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace kvx {
namespace {

struct Greys {
  std::vector<float> in_template, in_scan;
};

template <class Curve>
Greys Through(Curve curve, double noise = 0) {
  Greys greys;
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 1);
  for (int n = 0; n <= 5000; ++n) {
    const float value = 0.04f * float(n);  // 0 .. 200
    greys.in_template.push_back(value);
    greys.in_scan.push_back(float(curve(value) + noise * normal(random)));
  }
  return greys;
}

TEST(ContrastMap, AStraightLineUpwardsNeedsNone) {
  const Greys greys = Through([](double x) { return 1.3 * x + 20; }, 5);
  EXPECT_FALSE(FitContrast(greys.in_template, greys.in_scan));
}

TEST(ContrastMap, InvertedAndBentContrastsAreFollowed) {
  const auto inverted = [](double x) { return 220 - 0.8 * x; };
  const auto bent = [](double x) { return 0.02 * x * (200 - x); };
  for (const std::function<double(double)>& curve : {std::function<double(double)>(inverted), {bent}}) {
    const Greys greys = Through(curve, 3);
    const auto map = FitContrast(greys.in_template, greys.in_scan);
    ASSERT_TRUE(map);
    for (const float x : {10.0f, 60.0f, 100.0f, 155.0f, 190.0f}) EXPECT_NEAR((*map)(x), curve(x), 4) << x;
  }
}

TEST(ContrastMap, ReachesAsFarTowardsTheBrightAsTowardsTheDark) {
  const Greys greys = Through([](double x) { return 220 - 0.8 * x; });  // of 0 to 200, all as often
  const auto map = FitContrast(greys.in_template, greys.in_scan);
  ASSERT_TRUE(map);
  const float most = map->low + map->step * float(map->at_knot.size() - 1);
  EXPECT_GT(map->low, 0);
  EXPECT_NEAR(200 - most, map->low, 0.05);
}

TEST(ContrastMap, UnrelatedImagesHaveNone) {
  const Greys greys = Through([](double) { return 100; }, 30);
  EXPECT_FALSE(FitContrast(greys.in_template, greys.in_scan));
}

TEST(ContrastMap, FlatOrEmptyImagesHaveNone) {
  EXPECT_FALSE(FitContrast({}, {}));
  const std::vector<float> flat(100, 7.0f);
  EXPECT_FALSE(FitContrast(flat, flat));
}

}  // namespace
}  // namespace kvx

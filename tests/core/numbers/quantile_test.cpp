// Ranks that can be counted by hand, with the smaller values before them.
#include "core/numbers/quantile.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

TEST(Median, IsTheMiddleOneOrTheUpperOfTwo) {
  std::vector<double> odd{5, 1, 3}, even{4, 1, 3, 2}, one{7};
  EXPECT_EQ(TakeMedian(odd), 3);
  EXPECT_EQ(TakeMedian(even), 3);
  EXPECT_EQ(TakeMedian(one), 7);
  EXPECT_LE(std::max(even[0], even[1]), 2) << "the smaller half first";
}

TEST(Quantile, IsTheValueOfThatRank) {
  std::vector<float> ten{9, 3, 7, 1, 5, 0, 8, 2, 6, 4};
  for (const auto& [fraction, value] :
       {std::pair(0.0, 0), {0.05, 0}, {0.1, 1}, {0.55, 5}, {0.99, 9}, {1.0, 9}})
    EXPECT_EQ(TakeQuantile(ten, fraction), float(value)) << fraction;
}

TEST(Sample, IsAllOfFewValuesAndEveryNthOfMany) {
  const std::vector<int> few{3, 1, 2};
  EXPECT_EQ(SampleOf<int>(few), few);
  std::vector<int> many(2500000);
  for (size_t v = 0; v < many.size(); ++v) many[v] = int(v);
  const std::vector<int> sample = SampleOf<int>(many);
  ASSERT_EQ(sample.size(), 833334u);
  EXPECT_EQ(sample[1], 3);
}

}  // namespace
}  // namespace kvx

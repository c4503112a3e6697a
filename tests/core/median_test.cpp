// The upper middle one, with the smaller half before it.
#include "core/median.h"

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

}  // namespace
}  // namespace kvx

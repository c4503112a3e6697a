#include "core/value_range.h"

#include <gtest/gtest.h>

#include <vector>

namespace kvx {
namespace {

TEST(ValueRange, IsOfAllValuesAndOfNoneEmpty) {
  std::vector<float> values(1001, 2.0f);
  values[17] = -3.5f, values[1000] = 7.25f;
  const ValueRange range = ValueRangeOf(values);
  EXPECT_EQ(range.least, -3.5f);
  EXPECT_EQ(range.most, 7.25f);
  EXPECT_GT(ValueRangeOf({}).least, ValueRangeOf({}).most);
}

}  // namespace
}  // namespace kvx

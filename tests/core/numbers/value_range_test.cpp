// Which grey is the darkest and which the brightest, of values written down.
#include "core/numbers/value_range.h"

#include <gtest/gtest.h>

#include <limits>
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

// Sixteen values are compared at a time, and threads share them out.
TEST(ValueRange, FindsBothEndsWhereverTheyLie) {
  for (const size_t count : {1u, 15u, 16u, 17u, 33u, 16383u, 16400u, 40000u}) {
    for (const size_t at : {size_t(0), count / 3, count / 2, count - 1}) {
      std::vector<float> values(count, 2.0f);
      values[at] = -3.5f;
      EXPECT_EQ(ValueRangeOf(values).least, -3.5f) << at << " of " << count;
      values[at] = 7.25f;
      EXPECT_EQ(ValueRangeOf(values).most, 7.25f) << at << " of " << count;
    }
  }
}

TEST(ValueRange, LeavesOutWhatIsNoNumber) {
  std::vector<float> values(50, std::numeric_limits<float>::quiet_NaN());
  EXPECT_GT(ValueRangeOf(values).least, ValueRangeOf(values).most);
  values[20] = 4, values[21] = 5;
  EXPECT_EQ(ValueRangeOf(values).least, 4);
  EXPECT_EQ(ValueRangeOf(values).most, 5);
}

// 0 to 9999 in turn: of ten thousand values, ten at either end are strays.
std::vector<float> Ramp() {
  std::vector<float> values(10000);
  for (size_t v = 0; v < values.size(); ++v) values[v] = float(v * 7919 % values.size());
  return values;
}

TEST(UsualRange, LeavesOutAThousandthAtEitherEnd) {
  const ValueRange range = UsualRangeOf(Ramp());
  EXPECT_EQ(range.least, 10);
  EXPECT_EQ(range.most, 9990);
}

TEST(UsualRange, OfFewValuesOrOfNearlyOneAloneIsTheWhole) {
  const std::vector<float> few{3, 1, 2};
  EXPECT_EQ(UsualRangeOf(few).least, 1);
  EXPECT_EQ(UsualRangeOf(few).most, 3);
  std::vector<float> flat(10000, 4.0f);
  flat[5] = 9;
  EXPECT_EQ(UsualRangeOf(flat).least, 4);
  EXPECT_EQ(UsualRangeOf(flat).most, 9);
  EXPECT_GT(UsualRangeOf({}).least, UsualRangeOf({}).most);
}

TEST(PlausibleRange, EndsOneWidthBeyondTheUsualRange) {
  std::vector<float> values = Ramp();
  EXPECT_EQ(PlausibleRangeOf(values).least, 0);
  EXPECT_EQ(PlausibleRangeOf(values).most, 9999);
  values[3] = 1e6f, values[4] = -1e6f;
  EXPECT_NEAR(PlausibleRangeOf(values).least, 10 - 9980, 5);
  EXPECT_NEAR(PlausibleRangeOf(values).most, 9990 + 9980, 5);
}

TEST(RangeWithoutStrays, IsThatOfAllOtherValues) {
  std::vector<float> values = Ramp();
  const ValueRange before = RangeWithoutStraysOf(values);
  EXPECT_EQ(before.least, 0);
  EXPECT_EQ(before.most, 9999);
  values[3] = 1e6f, values[4] = -1e6f;
  EXPECT_EQ(RangeWithoutStraysOf(values).least, before.least);
  EXPECT_EQ(RangeWithoutStraysOf(values).most, before.most);
}

}  // namespace
}  // namespace kvx

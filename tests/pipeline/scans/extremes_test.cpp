// What is far from nearly all other greys is pulled in, and all else left as it is.
#include "pipeline/scans/extremes.h"

#include <gtest/gtest.h>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// 0 to 99 in equal numbers.
Volume Even() {
  Volume out(ObliqueGrid({20, 20, 20}));
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = float(v % 100);
  return out;
}

TEST(Extremes, CountAsOneRangeBeyondTheOthers) {
  const Volume even = Even();
  EXPECT_EQ(&*WithoutExtremes(even, false), &even) << "no copy";
  Volume scan = Even();
  scan.values[3] = 65535, scan.values[4] = -1e6f;
  Volume expected = Even();
  expected.values[3] = 99 + 99, expected.values[4] = -99;
  EXPECT_EQ(WithoutExtremes(scan, false)->values, expected.values);
}

TEST(Extremes, MetalInCtIsDenseBoneHoweverMuchThereIs) {
  Volume ct = Even();
  for (size_t v = 0; v < ct.values.size(); ++v)
    if (v % 10 == 0) ct.values[v] = v % 20 == 0 ? 20000.0f : 3000.0f;
  const OwnOrLent<Volume> pulled_in = WithoutExtremes(ct, true);
  EXPECT_EQ(pulled_in->values[20], kMostTissueHu);
  EXPECT_EQ(pulled_in->values[10], 3000) << "bone, as far as one can tell";
  EXPECT_EQ(WithoutExtremes(ct, false)->values, ct.values) << "of other images nobody knows";
}

}  // namespace
}  // namespace kvx

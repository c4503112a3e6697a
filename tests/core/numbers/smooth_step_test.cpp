#include "core/numbers/smooth_step.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

TEST(SmoothStep, IsHeldBeyondItsEndsAndHalfHalfWay) {
  EXPECT_EQ(SmoothStep(2, 6, 1), 0);
  EXPECT_EQ(SmoothStep(2, 6, 7), 1);
  EXPECT_EQ(SmoothStep(2, 6, 4), 0.5);
  EXPECT_DOUBLE_EQ(SmoothStep(2, 6, 3), 3.0 / 16 - 2.0 / 64);
}

// By a hundredth of a way in it has risen by less than a thousandth: no kink.
TEST(SmoothStep, HasNoSlopeAtItsEnds) {
  EXPECT_LT(SmoothStep(0, 1, 0.01), 0.001);
  EXPECT_GT(SmoothStep(0, 1, 0.99), 0.999);
}

}  // namespace
}  // namespace kvx

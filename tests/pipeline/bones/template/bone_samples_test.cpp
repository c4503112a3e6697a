// Evidence of a match, from correlation and what the scan saw.
#include "pipeline/bones/template/bone_samples.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kvx {
namespace {

// n/2 log 1/(1 - r^2), and Fisher's z: atanh 0.55 = 0.61838.
TEST(EvidenceNats, GrowsWithTheMatchAndTheNumberOfSamples) {
  EXPECT_EQ(EvidenceNats(0, 1, 20), 0);
  EXPECT_NEAR(EvidenceNats(0.6, 1, 20), -10 * std::log(0.64), 1e-9);
  EXPECT_NEAR(EvidenceNats(0.6, 0.5, 20), -5 * std::log(0.64), 1e-9);
}

TEST(WeakMatchNats, IsWhatAPoseMatchesLessThanBonesDo) {
  EXPECT_NEAR(WeakMatchNats(0, 1, 20), -10 * 0.61838 * 0.61838, 1e-3);
  EXPECT_NEAR(WeakMatchNats(-0.55, 1, 20), 4 * WeakMatchNats(0, 1, 20), 1e-9);
  EXPECT_LT(WeakMatchNats(0.1, 1, 20), WeakMatchNats(0.5, 1, 20));
  EXPECT_EQ(WeakMatchNats(0.6, 1, 20), 0);
}

TEST(WeakMatchNats, WhatTheScanDoesNotShowSaysNothing) { EXPECT_EQ(WeakMatchNats(0, 0, 20), 0); }

}  // namespace
}  // namespace kvx

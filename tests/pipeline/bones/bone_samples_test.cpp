// What a match says for a pose.
#include "pipeline/bones/bone_samples.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kvx {
namespace {

TEST(EvidenceNats, IsTheLikelihoodRatioOfABoneThatMatches) {
  EXPECT_NEAR(EvidenceNats(0.8, 1, 20), -10 * std::log(1 - 0.64), 1e-12);
  EXPECT_NEAR(EvidenceNats(0.8, 0.5, 20), -5 * std::log(1 - 0.64), 1e-12);
}

// With Fisher's z, atanh 0.55 = 0.61838.
TEST(EvidenceNats, SpeaksAgainstAPoseThatMatchesLessThanBonesDo) {
  EXPECT_NEAR(EvidenceNats(0, 1, 20), -10 * 0.61838 * 0.61838, 1e-3);
  EXPECT_LT(EvidenceNats(-0.3, 1, 20), EvidenceNats(0, 1, 20));
  EXPECT_LT(EvidenceNats(0.1, 1, 20), EvidenceNats(0.5, 1, 20));
}

TEST(EvidenceNats, WhatTheScanDoesNotShowSpeaksNeitherForNorAgainst) {
  EXPECT_EQ(EvidenceNats(0, 0, 20), 0);
  EXPECT_EQ(EvidenceNats(0.9, 0, 20), 0);
}

}  // namespace
}  // namespace kvx

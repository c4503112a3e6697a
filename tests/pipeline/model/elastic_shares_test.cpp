// Shares written on paper: what is unexplained is a known part of what elastic tissue does.
#include "pipeline/model/elastic_shares.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {
using Eigen::Vector3f;

VoxelWeights AllOf(uint8_t bone) { return {{bone, 0, 0, 0}, {1, 0, 0, 0}}; }

// Places along a line: elastic tissue moves them further and further, the scan by `share` of that, and by
// something across it that is nobody's.
void AddLine(ElasticShares& shares, size_t scan, uint8_t bone, float share, float times = 1) {
  for (int n = 1; n <= 20; ++n) {
    const Vector3f elastic = times * Vector3f(0.1f * float(n), 0, 0);
    shares.Add(scan, AllOf(bone), share * elastic + times * Vector3f(0, n % 2 ? 0.5f : -0.5f, 0), elastic);
  }
}

TEST(ElasticShares, AreWhatScansBearOut) {
  ElasticShares shares(2, 2, 0);
  for (const size_t scan : {0u, 1u}) AddLine(shares, scan, 0, 0.6f), AddLine(shares, scan, 1, 0.6f);
  EXPECT_NEAR(shares.Learned()[0], 0.6, 1e-5);
  EXPECT_NEAR(shares.Learned()[1], 0.6, 1e-5);
}

TEST(ElasticShares, AreOfEachBoneWhereItTells) {
  ElasticShares shares(3, 1, 0);
  AddLine(shares, 0, 0, 0.9f), AddLine(shares, 0, 1, 0.1f);
  const Eigen::VectorXd learned = shares.Learned();
  EXPECT_NEAR(learned[0], 0.9, 0.05);
  EXPECT_NEAR(learned[1], 0.1, 0.05);
  EXPECT_NEAR(learned[2], 0.5, 1e-5) << "as all together";
}

// The second scan moves ten times as far and says the contrary.
TEST(ElasticShares, AllScansCountAlike) {
  ElasticShares shares(1, 2, 0);
  AddLine(shares, 0, 0, 1), AddLine(shares, 1, 0, 0.2f, 10);
  const double e = 28.7, first = e / (e + 5), second = 0.2 * e / (0.04 * e + 5);  // e: elastic, squared
  EXPECT_NEAR(shares.Learned()[0], (first + second) / (first + 5 * second), 2e-3);
}

TEST(ElasticShares, StayBetweenNothingAndAll) {
  ElasticShares less(1, 1, 0), more(1, 1, 0);
  AddLine(less, 0, 0, -0.7f), AddLine(more, 0, 0, 1.8f);
  EXPECT_EQ(less.Learned()[0], 0);
  EXPECT_EQ(more.Learned()[0], 1);
}

TEST(ElasticShares, WithoutEvidenceTissueIsElastic) {
  EXPECT_EQ(ElasticShares(2, 0, 0).Learned(), Eigen::VectorXd::Ones(2));
  ElasticShares still(2, 1, 0);
  still.Add(0, AllOf(1), Vector3f(1, 2, 3), Vector3f::Zero());
  EXPECT_EQ(still.Learned(), Eigen::VectorXd::Ones(2));
}

// What the other scans explain whole leaves nothing to elastic tissue.
TEST(ElasticShares, NothingUnexplainedIsEvidenceToo) {
  ElasticShares shares(1, 1, 0);
  for (int n = 0; n < 5; ++n) shares.Add(0, AllOf(0), Vector3f::Zero(), Vector3f(1, float(n), 0));
  EXPECT_EQ(shares.Learned()[0], 0);
}

// Scans of the template's own pose: elastic tissue moves by noise alone.
TEST(ElasticShares, WhatMovesLessThanNoiseTellsNothing) {
  for (const double noise_mm : {0.0, 0.1}) {
    ElasticShares shares(1, 1, noise_mm);
    for (int n = 0; n < 40; ++n)
      shares.Add(0, AllOf(0), 0.02f * Vector3f(0, n % 2 ? 1 : -1, 0), Vector3f(0.02f, 0, 0));
    EXPECT_NEAR(shares.Learned()[0], noise_mm > 0 ? 0.96 : 0, 0.01);
  }
}

}  // namespace
}  // namespace kvx

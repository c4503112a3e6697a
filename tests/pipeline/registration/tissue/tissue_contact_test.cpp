// Two blocks of tissue, one pushed into the other: what is found can be worked out on paper.
#include "pipeline/registration/tissue/tissue_contact.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {

constexpr int kWide = 10, kThick = 6, kApart = 6;  // voxels: blocks at z 0..5 and 12..17, air between
constexpr float kSpacingMm = 2;

struct TwoBlocks {
  TwoBlocks() {
    air.grid.size = {kWide, kWide, 2 * kThick + kApart + 4};
    air.grid.spacing_mm = Eigen::Vector3d::Constant(kSpacingMm);
    air.values.assign(air.grid.VoxelCount(), 1);
    lattice.size = air.grid.size;
    lattice.rest_spacing_mm = air.grid.spacing_mm;
    for (size_t v = 0; v < air.values.size(); ++v) {
      const int z = air.grid.Ijk(v).z();
      const bool tissue = z < kThick || (z >= kThick + kApart && z < 2 * kThick + kApart);
      air.values[v] = !tissue;
      const bool bone = z == 0 || z == 2 * kThick + kApart - 1;
      lattice.kinds.push_back(!tissue ? NodeKind::kAbsent : bone ? NodeKind::kFixed : NodeKind::kFree);
      lattice.joined.push_back(uint8_t(tissue ? 3 | (tissue && z != kThick - 1 ? 4 : 0) : 0));
      lattice.positions_mm.push_back(kSpacingMm * air.grid.Ijk(v).cast<float>());
    }
  }
  // The upper block goes down until it is `overlap_mm` inside the lower one.
  void PushTogether(float overlap_mm) {
    for (size_t v = 0; v < air.values.size(); ++v) {
      if (Upper(v)) lattice.positions_mm[v].z() -= kApart * kSpacingMm + overlap_mm;
    }
  }
  bool Upper(size_t v) const { return air.grid.Ijk(v).z() >= kThick + kApart; }
  bool Tissue(size_t v) const { return lattice.kinds[v] != NodeKind::kAbsent; }

  Mask air;
  ElasticLattice lattice;
};

bool Inner(const TwoBlocks& blocks, size_t v) {
  const Eigen::Vector3i p = blocks.air.grid.Ijk(v);
  return p.x() >= 4 && p.x() < kWide - 4 && p.y() >= 4 && p.y() < kWide - 4;
}

TEST(TissueContact, TissueAtRestDoesNotMeet) {
  const TwoBlocks blocks;
  EXPECT_TRUE(TissueContact(blocks.air).Find(blocks.lattice, 1).empty());
}

TEST(TissueContact, BlocksThatJustTouchDoNotMeet) {
  TwoBlocks blocks;
  blocks.PushTogether(-0.1f);
  EXPECT_TRUE(TissueContact(blocks.air).Find(blocks.lattice, 1).empty());
}

TEST(TissueContact, TissueTornFarApartAndNoTissueMeetNothing) {
  TwoBlocks blocks;
  blocks.lattice.positions_mm[0] = {1e7f, -1e7f, 1e7f};
  EXPECT_TRUE(TissueContact(blocks.air).Find(blocks.lattice, 1).empty());
  blocks.lattice.positions_mm[0].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(TissueContact(blocks.air).Find(blocks.lattice, 1).empty());
  blocks.lattice.kinds.assign(blocks.lattice.kinds.size(), NodeKind::kAbsent);
  EXPECT_TRUE(TissueContact(blocks.air).Find(blocks.lattice, 1).empty());
}

TEST(TissueContact, SqueezedTissueDeepBelowTheSkinMeetsNothing) {
  constexpr int kEdge = 24;
  constexpr float kSqueezed = 0.2f;  // along x; it keeps its volume
  Mask air;
  air.grid.size = Eigen::Vector3i::Constant(kEdge + 4);
  air.grid.spacing_mm = Eigen::Vector3d::Constant(kSpacingMm);
  ElasticLattice lattice;
  lattice.size = air.grid.size;
  lattice.rest_spacing_mm = air.grid.spacing_mm;
  const auto depth = [&](size_t v) {  // in voxels; 0 in air
    const Eigen::Array3i p = air.grid.Ijk(v).array();
    return std::max(0, std::min((p - 1).minCoeff(), (kEdge + 2 - p).minCoeff()));
  };
  for (size_t v = 0; v < air.grid.VoxelCount(); ++v) {
    air.values.push_back(depth(v) == 0);
    lattice.kinds.push_back(depth(v) ? NodeKind::kFree : NodeKind::kAbsent);
    lattice.joined.push_back(7);
    Eigen::Vector3f mm = kSpacingMm * air.grid.Ijk(v).cast<float>();
    mm.x() *= kSqueezed, mm.y() /= std::sqrt(kSqueezed), mm.z() /= std::sqrt(kSqueezed);
    lattice.positions_mm.push_back(mm);
  }
  for (const ContactPush& push : TissueContact(air).Find(lattice, 1)) EXPECT_LE(depth(push.node), 3);
}

TEST(TissueContact, EachSideGoesHalfOfTheWayOutOfTheOther) {
  TwoBlocks blocks;
  constexpr float kOverlapMm = 3;
  blocks.PushTogether(kOverlapMm);
  int inner = 0;
  for (const ContactPush& push : TissueContact(blocks.air).Find(blocks.lattice, 1)) {
    if (!Inner(blocks, push.node)) continue;  // beside the blocks' edges the way out is aslant
    ++inner;
    const int z = blocks.air.grid.Ijk(push.node).z();
    const float depth_mm =
        kSpacingMm * (0.5f + float(blocks.Upper(push.node) ? z - kThick - kApart : kThick - 1 - z));
    EXPECT_NEAR(push.mm, 0.5f * (kOverlapMm - depth_mm), 0.01f);
    EXPECT_NEAR(push.normal.z(), blocks.Upper(push.node) ? 1 : -1, 0.01f);
  }
  EXPECT_GT(inner, 0);
}

TEST(TissueContact, RelaxedTissueHardlyOverlaps) {
  TwoBlocks blocks;
  constexpr float kOverlapMm = 3;
  blocks.PushTogether(kOverlapMm);
  const TissueContact contact(blocks.air);
  RelaxInContact(ElasticSweeps(testing_support::SharedBackend()), contact, 1, 40, {}, blocks.lattice);
  float low = 1e9f, high = -1e9f;  // the upper block's lowest and the lower one's highest node
  for (size_t v = 0; v < blocks.air.values.size(); ++v) {
    if (!blocks.Tissue(v) || !Inner(blocks, v)) continue;
    const float z = blocks.lattice.positions_mm[v].z();
    if (blocks.Upper(v))
      low = std::min(low, z);
    else
      high = std::max(high, z);
  }
  const float overlap_mm = kSpacingMm - (low - high);  // surfaces are half a voxel beyond the nodes
  EXPECT_LT(overlap_mm, 0.5f * kOverlapMm);
}

TEST(TissueContact, WhatIsHeldElsewhereStaysAsFirmlyHeld) {
  TwoBlocks with, without;
  const std::vector<Eigen::Matrix3f> holds(with.lattice.kinds.size(), 1e6f * Eigen::Matrix3f::Identity());
  const std::vector<Eigen::Vector3f> held = with.lattice.positions_mm;
  with.lattice.holds = holds, with.lattice.held_mm = held;
  RelaxInContact(ElasticSweeps(testing_support::SharedBackend()), TissueContact(with.air), 1, 10, {},
                 with.lattice);
  for (size_t v = 0; v < held.size(); ++v)
    EXPECT_LT((with.lattice.positions_mm[v] - without.lattice.positions_mm[v]).norm(), 1e-3f);
}

}  // namespace
}  // namespace kvx

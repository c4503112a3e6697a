// Whether a scan belongs, from what is doubted of its bones.
#include "pipeline/model/scan_verdict.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

BoneSet OneOfHalfOfTheVoxels() {
  BoneSet set;
  for (const size_t voxels : {600, 1, 599}) set.bones.push_back({.voxels = voxels});
  return set;
}

BoneFits InDoubt(std::initializer_list<Doubt> doubts) {
  BoneFits fits;
  for (const Doubt doubt : doubts) fits.push_back({.doubt = doubt, .note = "why"});
  return fits;
}

TEST(ScanVerdict, HalfOfTheBonesMayBeInDoubt) {
  const auto none = Doubt::kNone, bone = Doubt::kBone;
  EXPECT_EQ(VerdictOf(OneOfHalfOfTheVoxels(), InDoubt({none, none, none})).kind, ScanVerdict::Kind::kBelongs);
  EXPECT_EQ(VerdictOf(OneOfHalfOfTheVoxels(), InDoubt({bone, none, none})).kind, ScanVerdict::Kind::kBelongs);
  EXPECT_EQ(VerdictOf(OneOfHalfOfTheVoxels(), InDoubt({none, bone, bone})).note, "");
  const ScanVerdict lost = VerdictOf(OneOfHalfOfTheVoxels(), InDoubt({bone, bone, none}));
  EXPECT_EQ(lost.kind, ScanVerdict::Kind::kLost);
  EXPECT_NE(lost.note.find("initial poses"), std::string::npos);
}

TEST(ScanVerdict, WhatIsDoubtedOfTheScanComesFirst) {
  BoneFits fits = InDoubt({Doubt::kBone, Doubt::kBone, Doubt::kNone});
  DoubtAll(Doubt::kMirrored, "flipped", fits);
  EXPECT_EQ(VerdictOf(OneOfHalfOfTheVoxels(), fits).kind, ScanVerdict::Kind::kMirrored);
  EXPECT_EQ(VerdictOf(OneOfHalfOfTheVoxels(), fits).note, "flipped");
  DoubtAll(Doubt::kAnotherSize, "larger", fits);
  EXPECT_EQ(NameOf(VerdictOf(OneOfHalfOfTheVoxels(), fits).kind), "another_size");
}

}  // namespace
}  // namespace kvx

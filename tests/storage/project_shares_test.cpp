// A project has at most as many places as it leaves free.
#include "storage/project_shares.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/failing_new.h"

namespace kvx {
namespace {

const std::string kLongName = "a project whose name needs memory of its own";

// How many the project gets, one after the other; they are held in `places`.
int TakeAll(ProjectShares& shares, const std::string& project, std::vector<ProjectShares::Place>& places) {
  int count = 0;
  while (auto place = shares.TryTake(project)) {
    places.push_back(std::move(place));
    ++count;
  }
  return count;
}

TEST(ProjectShares, OneAloneHasHalfAndTheNextHalfOfTheRest) {
  ProjectShares shares(64, true);
  std::vector<ProjectShares::Place> places;
  EXPECT_EQ(TakeAll(shares, "a", places), 32);
  EXPECT_EQ(TakeAll(shares, "b", places), 16);
  EXPECT_EQ(TakeAll(shares, "c", places), 8);
  EXPECT_EQ(TakeAll(shares, "a", places), 0);
  EXPECT_EQ(shares.Taken(), 56);
  places.clear();
  EXPECT_EQ(shares.Taken(), 0);
  EXPECT_EQ(TakeAll(shares, "b", places), 32) << "what was given back is there for all";
}

TEST(ProjectShares, TheLastPlaceIsForWhoeverHasNone) {
  ProjectShares shares(2, true);
  const auto first = shares.TryTake("a");
  EXPECT_TRUE(first);
  EXPECT_FALSE(shares.TryTake("a"));
  const auto second = shares.TryTake("b");
  EXPECT_TRUE(second);
  EXPECT_FALSE(shares.TryTake("c"));
}

TEST(ProjectShares, NoPlaceIsLostForWantOfMemory) {
  ProjectShares shares(4, true);
  EXPECT_GT(testing_support::TimesWithoutMemory([&] { shares.TryTake(kLongName); }), 1);
  EXPECT_EQ(shares.Taken(), 0);
  std::vector<ProjectShares::Place> places;
  EXPECT_EQ(TakeAll(shares, kLongName, places), 2);
}

TEST(ProjectShares, WithNobodyToShareWithAllAreForOne) {
  ProjectShares shares(4, false);
  std::vector<ProjectShares::Place> places;
  EXPECT_EQ(TakeAll(shares, "default", places), 4);
}

}  // namespace
}  // namespace kvx

// What is lent is handed on where it lies; what was made goes along.
#include "core/host/own_or_lent.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace kvx {
namespace {

OwnOrLent<std::vector<int>> Sorted(const std::vector<int>& values) {
  if (std::is_sorted(values.begin(), values.end())) return values;
  std::vector<int> out = values;
  std::sort(out.begin(), out.end());
  return out;
}

TEST(OwnOrLent, WhatIsLentIsNotCopied) {
  const std::vector<int> sorted{1, 2, 3};
  const OwnOrLent<std::vector<int>> same = Sorted(sorted);
  EXPECT_TRUE(same.lent());
  EXPECT_EQ(&*same, &sorted);
  EXPECT_EQ(Sorted(sorted).Taken(), sorted);
  EXPECT_EQ(sorted.size(), 3u) << "taken from whoever lent it";
}

TEST(OwnOrLent, WhatWasMadeOutlivesWhatItWasMadeOf) {
  OwnOrLent<std::vector<int>> made = Sorted({3, 1, 2});
  EXPECT_FALSE(made.lent());
  const OwnOrLent<std::vector<int>> moved = std::move(made);
  EXPECT_EQ(*moved, (std::vector{1, 2, 3}));
  EXPECT_EQ(moved->size(), 3u);
}

}  // namespace
}  // namespace kvx

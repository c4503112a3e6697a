// How long something is tried again: by the clock, not by the pauses alone.
#include "cli/patience.h"

#include <gtest/gtest.h>

#include <thread>

namespace kvx {
namespace {

using std::chrono::milliseconds;

// Tries that last 300 ms each, with pauses of 200 ms and more between them: after two of them 500 ms are
// over, while the pauses alone are 200.
TEST(Patience, WhatTheTriesTakeCounts) {
  Patience patience(milliseconds(400));
  int pauses = 0;
  while (patience.Pause()) {
    ++pauses;
    std::this_thread::sleep_for(milliseconds(300));
  }
  EXPECT_EQ(pauses, 1);
}

TEST(Patience, BeginsWithTheFirstPauseHoweverLateThatIs) {
  Patience patience(milliseconds(100));
  std::this_thread::sleep_for(milliseconds(150));
  EXPECT_TRUE(patience.Pause());
}

TEST(Patience, PausesGrowAndEndWithIt) {
  Patience patience(milliseconds(250));
  EXPECT_EQ(patience.Next(), milliseconds(200));
  EXPECT_EQ(patience.Next(std::chrono::seconds(60)), std::chrono::seconds(60));
  const auto before = Patience::Clock::now();
  EXPECT_TRUE(patience.Pause(std::chrono::seconds(60)));
  EXPECT_LT(Patience::Clock::now() - before, std::chrono::seconds(30));
  EXPECT_EQ(patience.Next(), milliseconds(400));
  EXPECT_FALSE(patience.Pause());
}

}  // namespace
}  // namespace kvx

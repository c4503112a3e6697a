// How long something is tried again: by the clock, not by the pauses alone. The clock is the test's own.
#include "cli/service/patience.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

using std::chrono::milliseconds;

class WithAClock : public testing::Test {
 protected:
  Patience For(milliseconds limit) {
    return Patience(limit, {[this] { return now_; }, [this](milliseconds pause) { now_ += pause; }});
  }
  // What a pause took.
  milliseconds Paused(Patience& patience, milliseconds at_least = {}) {
    const auto before = now_;
    EXPECT_TRUE(patience.Pause(at_least));
    return std::chrono::duration_cast<milliseconds>(now_ - before);
  }
  Patience::Clock::time_point now_{std::chrono::hours(1)};
};

// Tries that last 300 ms each, with pauses of 200 ms and more between them: after two of them 500 ms are
// over, while the pauses alone are 200.
TEST_F(WithAClock, WhatTheTriesTakeCounts) {
  Patience patience = For(milliseconds(400));
  int pauses = 0;
  while (patience.Pause()) {
    ++pauses;
    now_ += milliseconds(300);
  }
  EXPECT_EQ(pauses, 1);
}

TEST_F(WithAClock, BeginsWithTheFirstPauseHoweverLateThatIs) {
  Patience patience = For(milliseconds(100));
  now_ += std::chrono::hours(7);
  EXPECT_EQ(Paused(patience), milliseconds(100));
  EXPECT_FALSE(patience.Pause());
}

TEST_F(WithAClock, PausesGrowToFiveSeconds) {
  Patience patience = For(std::chrono::minutes(2));
  for (const int pause_ms : {200, 400, 800, 1600, 3200, 5000, 5000}) {
    EXPECT_EQ(patience.Next(), milliseconds(pause_ms));
    EXPECT_EQ(Paused(patience), milliseconds(pause_ms));
  }
}

TEST_F(WithAClock, APauseThatIsAskedForEndsWithIt) {
  Patience patience = For(milliseconds(250));
  EXPECT_EQ(patience.Next(std::chrono::seconds(60)), std::chrono::seconds(60));
  EXPECT_EQ(Paused(patience, std::chrono::seconds(60)), milliseconds(250));
  EXPECT_EQ(patience.Next(), milliseconds(400));
  EXPECT_FALSE(patience.Pause());
}

// Ctrl-C is looked for between sleeps, which are short however long the pause is.
TEST_F(WithAClock, LooksGetRarerToTwoSecondsButSleepsStayShort) {
  milliseconds longest{0};
  GrowingPause pause({[this] { return now_; },
                      [&](milliseconds sleep) {
                        now_ += sleep;
                        longest = std::max(longest, sleep);
                      }});
  for (const int pause_ms : {100, 200, 400, 800, 1600, 2000, 2000}) {
    const auto before = now_;
    pause.Wait();
    EXPECT_EQ(now_ - before, milliseconds(pause_ms));
  }
  EXPECT_LE(longest, milliseconds(50));
}

// By the machine's own clock, unless told.
TEST(Patience, NoPatienceIsOverAtOnce) { EXPECT_FALSE(Patience(milliseconds(0)).Pause()); }

}  // namespace
}  // namespace kvx

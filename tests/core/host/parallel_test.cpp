// Every index once, whatever the number of threads; failures come back.
#include "core/host/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/support/scarce_memory.h"

namespace kvx {
namespace {

TEST(ParallelFor, VisitsEveryIndexOnce) {
  for (const int threads : {0, 1, 3, 64}) {
    std::vector<int> visits(1000, 0);
    ParallelFor(
        visits.size(), [&](size_t i) { ++visits[i]; }, threads);
    EXPECT_EQ(visits, std::vector<int>(1000, 1)) << threads;
  }
}

TEST(ParallelFor, RunsOnNoMoreThreadsThanTheLeastLimit) {
  const auto threads_of_a_loop = [] {
    std::mutex mutex;
    std::set<std::thread::id> seen;
    ParallelFor(200, [&](size_t) {
      const std::lock_guard lock(mutex);
      seen.insert(std::this_thread::get_id());
    });
    return seen;
  };
  const auto limit = LimitThreads(1);
  EXPECT_EQ(threads_of_a_loop(), std::set{std::this_thread::get_id()});
  const auto wider = LimitThreads(8);
  EXPECT_EQ(threads_of_a_loop().size(), 1u) << "the least limit counts";
}

// A thread that waits for an inner loop must not begin another turn of the outer one.
TEST(ParallelFor, ALoopInsideALockedTurnDoesNotLockItselfOut) {
  std::mutex mutex;
  std::atomic<int> turns = 0;
  ParallelFor(64, [&](size_t) {
    const std::lock_guard lock(mutex);
    ParallelFor(64, [&](size_t) { ++turns; });
  });
  EXPECT_EQ(turns, 64 * 64);
}

TEST(ParallelFor, AFailureLeavesLoopsInsideOtherTurnsWhole) {
  std::atomic<bool> other = false, failed = false;
  std::atomic<int> inside = 0;
  const auto wait_for = [](const std::atomic<bool>& flag) {  // in vain where there is one thread
    for (int n = 0; n < 1000 && !flag; ++n) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  const auto turn = [&](size_t i) {
    if (i == 0) {
      wait_for(other);
      failed = true;
      throw std::runtime_error("first");
    }
    other = true;
    wait_for(failed);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // until all know of it
    ParallelFor(64, [&](size_t) { ++inside; });
  };
  EXPECT_THROW(ParallelFor(2, turn), std::runtime_error);
  EXPECT_EQ(inside, other ? 64 : 0);
}

// How many of two turns of a loop ran, each of which waits for the other.
int TurnsThatMeet() {
  std::atomic<int> begun = 0;
  int met = 0;
  std::mutex mutex;
  ParallelFor(
      2,
      [&](size_t) {
        ++begun;
        for (int n = 0; n < 1000 && begun < 2; ++n) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        const std::lock_guard lock(mutex);
        met += begun == 2;
      },
      2);
  return met;
}

TEST(ParallelFor, GoesOnWhereThereIsNoThread) {
  if (!KVX_MEMORY_CAN_BE_SCARCE) GTEST_SKIP();
  const auto loop = [] {
    testing_support::GetNoMoreMemoryThan(6 << 20);  // no room for a stack
    std::vector<int> visits(1000, 0);
    ParallelFor(
        visits.size(), [&](size_t i) { ++visits[i]; }, 2);
    std::exit(visits == std::vector<int>(1000, 1) ? 2 : 3);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(loop(), testing::ExitedWithCode(2), "");
}

TEST(StartThreads, LoopsOfAllThreadsNeedNoneAfterwards) {
  if (!KVX_MEMORY_CAN_BE_SCARCE || std::thread::hardware_concurrency() < 2) GTEST_SKIP();
  const auto loops = [] {
    StartThreads();
    testing_support::GetNoMoreMemoryThan(6 << 20);
    std::exit(TurnsThatMeet());
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(loops(), testing::ExitedWithCode(2), "");
}

TEST(ParallelCollect, KeepsTheOrderOfPartsAndWithinThem) {
  const auto numbers = ParallelCollect<size_t>(50, [](std::vector<size_t>& list, size_t part) {
    for (size_t n = 0; n < part % 3; ++n) list.push_back(10 * part + n);
  });
  std::vector<size_t> expected;
  for (size_t part = 0; part < 50; ++part) {
    for (size_t n = 0; n < part % 3; ++n) expected.push_back(10 * part + n);
  }
  EXPECT_EQ(numbers, expected);
  EXPECT_TRUE(ParallelCollect<int>(0, [](std::vector<int>&, size_t) {}).empty());
}

TEST(SideBySide, BothAreDone) {
  std::thread::id first, second;
  SideBySide([&] { first = std::this_thread::get_id(); }, [&] { second = std::this_thread::get_id(); });
  EXPECT_EQ(first, std::this_thread::get_id());
  EXPECT_NE(second, std::thread::id());
}

TEST(SideBySide, OneAfterTheOtherOnOneThread) {
  const auto limit = LimitThreads(1);
  std::vector<std::thread::id> threads;
  const auto note = [&] { threads.push_back(std::this_thread::get_id()); };
  SideBySide(note, note);
  EXPECT_EQ(threads, std::vector<std::thread::id>(2, std::this_thread::get_id()));
}

// As where a container may have no more threads.
TEST(SideBySide, OneAfterTheOtherWhereThereIsNoThread) {
  if (!KVX_MEMORY_CAN_BE_SCARCE) GTEST_SKIP();
  const auto both = [] {
    testing_support::GetNoMoreMemoryThan(1 << 20);
    int done = 0;
    SideBySide([&] { ++done; }, [&] { ++done; });
    std::exit(done);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(both(), testing::ExitedWithCode(2), "");
}

TEST(SideBySide, LoopsInsideCoverTheirCounts) {
  std::vector<int> first(10007, 0), second(10007, 0);
  SideBySide([&] { ParallelEach(first.size(), [&](size_t n) { ++first[n]; }); },
             [&] { ParallelEach(second.size(), [&](size_t n) { ++second[n]; }); });
  EXPECT_EQ(first, std::vector<int>(first.size(), 1));
  EXPECT_EQ(second, first);
}

TEST(SideBySide, AFailureIsThrownWhenBothHaveEnded) {
  std::atomic<bool> ended = false;
  const auto slow = [&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ended = true;
  };
  const auto fail = [] { throw std::runtime_error("first"); };
  EXPECT_THROW(SideBySide(fail, slow), std::runtime_error);
  EXPECT_TRUE(ended);
  EXPECT_THROW(SideBySide([] {}, fail), std::runtime_error);
  const auto fail_otherwise = [] { throw std::logic_error("second"); };
  EXPECT_THROW(SideBySide(fail, fail_otherwise), std::runtime_error);
}

TEST(ParallelCopy, EveryByteArrivesAndNoneBeyond) {
  constexpr size_t kBlock = 1 << 20;
  for (const size_t bytes : {size_t(0), size_t(1), kBlock - 1, kBlock, kBlock + 1, 3 * kBlock + 17}) {
    std::vector<uint8_t> from(bytes), to(bytes + 1, 77);
    for (size_t i = 0; i < bytes; ++i) from[i] = uint8_t(i * 31 >> 3);
    ParallelCopy(to.data(), from.data(), bytes);
    EXPECT_EQ(to.back(), 77);
    to.pop_back();
    EXPECT_EQ(to, from) << bytes;
  }
}

TEST(Filled, HoldsTheValueFromTheFirstToTheLast) {
  for (const size_t count : {size_t(0), size_t(5), size_t(1 << 20) + 3, size_t(3 << 20) + 1})
    EXPECT_EQ(Filled(count, 7.5f), std::vector<float>(count, 7.5f)) << count;
}

TEST(ParallelFor, NothingToDoIsDone) {
  ParallelFor(0, [](size_t) { FAIL(); });
  ParallelRanges(0, [](size_t, size_t) { FAIL(); });
}

TEST(ParallelEach, CallsEachOnce) {
  for (const size_t count : {0, 1, 7, 10007}) {
    std::vector<int> calls(count, 0);
    ParallelEach(count, [&](size_t n) { ++calls[n]; });
    EXPECT_EQ(calls, std::vector<int>(count, 1)) << count;
  }
}

TEST(ParallelFor, AFailureIsThrownOnTheCallersThread) {
  const auto fail = [](size_t i) {
    if (i == 7) throw std::runtime_error("seven");
  };
  EXPECT_THROW(ParallelFor(100, fail), std::runtime_error);
}

TEST(ParallelRanges, CoverTheCountWithoutOverlap) {
  std::vector<int> visits(1001, 0);
  ParallelEach(visits.size(), [&](size_t i) { ++visits[i]; });
  EXPECT_EQ(visits, std::vector<int>(1001, 1));
}

TEST(ParallelSum, AddsUpEveryIndexOnce) {
  for (const size_t count : {size_t(0), size_t(1), size_t(15), size_t(16), size_t(1001)}) {
    const auto add = [](size_t& sum, size_t index) { sum += index + 1; };
    EXPECT_EQ(ParallelSum<size_t>(count, add), count * (count + 1) / 2);
  }
}

}  // namespace
}  // namespace kvx

// Who waits goes before who comes back.
#include "core/host/fair_mutex.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace kvx {
namespace {
using namespace std::chrono_literals;

// Whether one who waits, while the holder gives the lock away and asks for it again at once, goes first.
bool GoesBeforeTheHolder() {
  FairMutex mutex;
  std::atomic<bool> asks = false;
  bool waiter_was_in = false;  // guarded by the lock
  mutex.lock();
  std::thread waiter([&] {
    asks = true;
    const std::lock_guard lock(mutex);
    waiter_was_in = true;
  });
  while (!asks) std::this_thread::yield();
  std::this_thread::sleep_for(5ms);
  mutex.unlock();
  mutex.lock();
  const bool first = waiter_was_in;
  mutex.unlock();
  waiter.join();
  return first;
}

TEST(FairMutex, IsGrantedInTheOrderInWhichItWasAskedFor) {
  int first = 0;
  for (int round = 0; round < 20; ++round) first += GoesBeforeTheHolder();
  EXPECT_GT(first, 10) << "a busy machine may hold up the waiter before it asks, but not each time";
}

TEST(FairMutex, KeepsOthersOut) {
  FairMutex mutex;
  int count = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int n = 0; n < 500; ++n) {
        const std::lock_guard lock(mutex);
        ++count;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(count, 2000);
}

}  // namespace
}  // namespace kvx

// The gate lets in as many as it has slots, in order, and turns away the rest.
#include "server/posing_gate.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "core/errors.h"

namespace kvx {
namespace {

void WaitFor(PosingGate& gate, int waiting) {
  while (gate.waiting() != waiting) std::this_thread::yield();
}

TEST(PosingGate, FirstComeFirstServedAndNeverMoreThanItsSlots) {
  PosingGate gate(2, 10);
  std::atomic<int> inside{0}, most{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 20; ++i) {
        const PosingGate::Pass pass(gate, {});
        const int now = ++inside;
        int before = most;
        while (now > before && !most.compare_exchange_weak(before, now)) {
        }
        --inside;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_LE(most, 2);
  EXPECT_GE(most, 1);
}

TEST(PosingGate, TooManyWaitersAreTurnedAway) {
  PosingGate gate(1, 1);
  std::optional<PosingGate::Pass> held(std::in_place, gate, nullptr);
  std::thread waiter([&] { const PosingGate::Pass pass(gate, {}); });
  WaitFor(gate, 1);
  EXPECT_THROW(PosingGate::Pass(gate, {}), Unavailable);
  held.reset();
  waiter.join();
  EXPECT_NO_THROW(PosingGate::Pass(gate, {}));
}

TEST(PosingGate, WhoeverHasGoneLeavesTheQueue) {
  PosingGate gate(1, 5);
  std::optional<PosingGate::Pass> held(std::in_place, gate, nullptr);
  std::atomic<bool> gone{false}, second_in{false};
  std::thread first([&] { EXPECT_THROW(PosingGate::Pass(gate, [&] { return gone.load(); }), Cancelled); });
  WaitFor(gate, 1);
  std::thread second([&] {
    const PosingGate::Pass pass(gate, {});
    second_in = true;
  });
  WaitFor(gate, 2);
  gone = true;
  first.join();
  EXPECT_FALSE(second_in);
  held.reset();
  second.join();
  EXPECT_TRUE(second_in);
}

}  // namespace
}  // namespace kvx

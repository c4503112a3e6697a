// The gate lets in as many as it has slots, in order, projects by turns, and turns away the rest.
#include "server/turns/posing_gate.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "core/errors.h"
#include "tests/support/failing_new.h"

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
  std::optional<PosingGate::Pass> held(std::in_place, gate, Asker());
  std::thread waiter([&] { const PosingGate::Pass pass(gate, {}); });
  WaitFor(gate, 1);
  EXPECT_THROW(PosingGate::Pass(gate, {}), Unavailable);
  held.reset();
  waiter.join();
  EXPECT_NO_THROW(PosingGate::Pass(gate, {}));
}

TEST(PosingGate, WhoeverHasGoneLeavesTheQueue) {
  PosingGate gate(1, 5);
  std::optional<PosingGate::Pass> held(std::in_place, gate, Asker());
  std::atomic<bool> gone{false}, second_in{false};
  std::thread first([&] {
    EXPECT_THROW(PosingGate::Pass(gate, {"", [&] { return gone.load(); }}), Cancelled);
  });
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

TEST(PosingGate, AllWhoHaveGoneLeaveAtOnceAndTheirPlacesAreFree) {
  PosingGate gate(1, 16);
  std::optional<PosingGate::Pass> held(std::in_place, gate, Asker());
  std::atomic<bool> gone{false};
  std::vector<std::thread> threads;
  for (int i = 0; i < 16; ++i) {
    threads.emplace_back([&] {
      EXPECT_THROW(PosingGate::Pass(gate, {"", [&] { return gone.load(); }}), Cancelled);
    });
  }
  WaitFor(gate, 16);
  EXPECT_THROW(PosingGate::Pass(gate, {}), Unavailable);
  gone = true;
  for (std::thread& thread : threads) thread.join();  // nobody else's pass has ended
  EXPECT_EQ(gate.waiting(), 0);
  std::thread newcomer([&] { const PosingGate::Pass pass(gate, {}); });
  WaitFor(gate, 1);
  held.reset();
  newcomer.join();
}

// On a thread of its own, which notes the project in `order` once it is inside: one slot, so one at a time.
std::thread Wait(PosingGate& gate, const std::string& project, std::vector<std::string>& order) {
  const int before = gate.waiting();
  std::thread thread([&gate, project, &order] {
    const PosingGate::Pass pass(gate, {project, {}});
    order.push_back(project);
  });
  WaitFor(gate, before + 1);
  return thread;
}

TEST(PosingGate, WhoeverAsksForMuchLeavesOthersPlacesAndTheirTurn) {
  PosingGate gate(1, 4);
  std::vector<std::string> order;
  std::vector<std::thread> threads;
  {
    const PosingGate::Pass pass(gate, {"greedy", {}});
    for (int i = 0; i < 4; ++i) threads.push_back(Wait(gate, "greedy", order));
    EXPECT_THROW(PosingGate::Pass(gate, {"greedy", {}}), Unavailable);
    for (const char* project : {"b", "b", "c"}) threads.push_back(Wait(gate, project, order));
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(order, (std::vector<std::string>{"b", "c", "greedy", "b", "greedy", "greedy", "greedy"}));
}

TEST(PosingGate, NoPlaceIsLostForWantOfMemory) {
  PosingGate gate(1, 4);
  const Asker asker{"a project whose name needs memory of its own", {}};
  EXPECT_GT(testing_support::TimesWithoutMemory([&] { PosingGate::Pass(gate, asker); }), 2);
  EXPECT_EQ(gate.waiting(), 0);
}

}  // namespace
}  // namespace kvx

// Threads come with connections, up to the limit; then a queue, then a word of refusal.
#include "server/bounded_pool.h"

#include <gtest/gtest.h>

#include <future>

namespace kvx {
namespace {

TEST(BoundedPool, ServesWaitsAndTurnsAway) {
  BoundedPool pool(3, 2);
  std::promise<void> open;
  const auto opened = open.get_future().share();
  std::atomic<int> served{0}, turned_away{0};
  const auto connection = [&] {
    if (BoundedPool::TurningAway()) {
      ++turned_away;
      return;
    }
    opened.wait();
    ++served;
  };
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(pool.enqueue(connection));
  for (int i = 0; i < 1000 && turned_away < 5; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(turned_away, 5) << "three are served, two wait";
  open.set_value();
  pool.shutdown();
  EXPECT_EQ(served, 5);
}

TEST(BoundedPool, OneThreadServesConnectionsThatComeOneByOne) {
  BoundedPool pool(1, 1);
  for (int i = 0; i < 20; ++i) {
    std::promise<bool> done;
    EXPECT_TRUE(pool.enqueue([&] { done.set_value(!BoundedPool::TurningAway()); }));
    EXPECT_TRUE(done.get_future().get());
  }
  pool.shutdown();
}

}  // namespace
}  // namespace kvx

// Threads come with connections, up to the limit; then a queue, then a word of refusal.
#include "server/http/bounded_pool.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <future>
#include <new>

namespace kvx {
namespace {

// A system that gives no more threads, played by stacks for which no address is left.
class NoMoreThreads {
 public:
  NoMoreThreads() {
    ::pthread_getattr_default_np(&before_);
    pthread_attr_t huge = before_;
    EXPECT_EQ(::pthread_attr_setstacksize(&huge, size_t(1) << 47), 0);
    EXPECT_EQ(::pthread_setattr_default_np(&huge), 0);
  }
  ~NoMoreThreads() { ::pthread_setattr_default_np(&before_); }

 private:
  pthread_attr_t before_;
};

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

TEST(BoundedPool, AConnectionThatFailsEndsAlone) {
  BoundedPool pool(1, 2);
  std::promise<void> done;
  EXPECT_TRUE(pool.enqueue([] { throw std::bad_alloc(); }));
  EXPECT_TRUE(pool.enqueue([&] { done.set_value(); }));
  done.get_future().wait();
  pool.shutdown();
}

TEST(BoundedPool, WantOfMemoryEndsNotWhoAccepts) {
  std::promise<void> done;
  BoundedPool pool(1, 1, [](size_t) { throw std::bad_alloc(); });
  EXPECT_TRUE(pool.enqueue([&] { done.set_value(); }));
  pool.on_idle();
  done.get_future().wait();
}  // without a shutdown, as where the thread that accepts fails otherwise

TEST(BoundedPool, ConnectionsWaitForTheThreadsThatAreThereWhereThereAreNoMore) {
  BoundedPool pool(3, 2);
  std::promise<void> open;
  const auto opened = open.get_future().share();
  std::atomic<int> served{0};
  const auto connection = [&] {
    opened.wait();
    ++served;
  };
  EXPECT_TRUE(pool.enqueue(connection));
  {
    const NoMoreThreads here;
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(pool.enqueue(connection));
  }
  open.set_value();
  pool.shutdown();
  EXPECT_EQ(served, 4);
}

TEST(BoundedPool, WithoutAnyThreadAConnectionIsNotTaken) {
  BoundedPool pool(3, 2);
  std::atomic<int> served{0};
  {
    const NoMoreThreads here;
    EXPECT_FALSE(pool.enqueue([&] { ++served; }));
  }
  EXPECT_TRUE(pool.enqueue([&] { ++served; })) << "there are threads again";
  pool.shutdown();
  EXPECT_EQ(served, 1);
}

}  // namespace
}  // namespace kvx

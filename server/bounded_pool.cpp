// A queue of connections, not of requests: a connection keeps its thread while it lives.
#include "server/bounded_pool.h"

namespace kvx {
namespace {
thread_local bool turning_away_here = false;
thread_local const std::atomic<size_t>* waiting_here = nullptr;
constexpr size_t kTurnedAwayLimit = 64;
}  // namespace

bool BoundedPool::TurningAway() { return turning_away_here; }

bool BoundedPool::OthersWait() { return waiting_here && *waiting_here > 0; }

BoundedPool::BoundedPool(int threads, size_t queue_limit) {
  served_.limit = queue_limit;
  turned_away_.limit = kTurnedAwayLimit;
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Serve(served_, false); });
  threads_.emplace_back([this] { Serve(turned_away_, true); });
}

bool BoundedPool::Push(Lane& lane, std::function<void()>& connection) {
  if (lane.waiting.size() >= lane.limit) return false;
  lane.waiting.push_back(std::move(connection));
  lane.arrived.notify_one();
  return true;
}

bool BoundedPool::enqueue(std::function<void()> connection) {
  const std::lock_guard lock(mutex_);
  if (!Push(served_, connection)) return Push(turned_away_, connection);
  waiting_ = served_.waiting.size();
  return true;
}

void BoundedPool::Serve(Lane& lane, bool turning_away) {
  turning_away_here = turning_away;
  waiting_here = &waiting_;
  std::unique_lock lock(mutex_);
  while (true) {
    lane.arrived.wait(lock, [&] { return stopping_ || !lane.waiting.empty(); });
    if (lane.waiting.empty()) return;
    auto connection = std::move(lane.waiting.front());
    lane.waiting.pop_front();
    waiting_ = served_.waiting.size();
    lock.unlock();
    connection();
    lock.lock();
  }
}

void BoundedPool::shutdown() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  served_.arrived.notify_all();
  turned_away_.arrived.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

}  // namespace kvx

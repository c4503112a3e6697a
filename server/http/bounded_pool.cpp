// A queue of connections, not of requests: a connection keeps its thread while it lives.
#include "server/http/bounded_pool.h"

#include <algorithm>
#include <limits>
#include <new>
#include <system_error>

namespace kvx {
namespace {
thread_local bool turning_away_here = false;
thread_local const std::atomic<size_t>* waiting_here = nullptr;
constexpr size_t kTurnedAwayLimit = 64, kTurnedAwayThreads = 4;
constexpr auto kLookAtEnd = std::chrono::milliseconds(100);
constexpr auto kIdleLife = std::chrono::seconds(10);
}  // namespace

bool BoundedPool::TurningAway() { return turning_away_here; }

bool BoundedPool::OthersWait() { return waiting_here && *waiting_here > 0; }

BoundedPool::BoundedPool(int most_threads, size_t queue_limit, std::function<void(size_t waiting)> look)
    : look_(std::move(look)) {
  served_.limit = queue_limit;
  served_.most_threads = size_t(most_threads);
  turned_away_.limit = kTurnedAwayLimit;
  turned_away_.most_threads = kTurnedAwayThreads;
}

BoundedPool::~BoundedPool() {
  if (!stopping_) shutdown();
}

bool BoundedPool::Start(Lane& lane, bool turning_away) try {
  ended_.reserve(threads_.size() + 1);  // so that threads need no memory to end
  threads_.emplace_back([this, &lane, turning_away] { Serve(lane, turning_away); });
  ++lane.threads;
  return true;
} catch (const std::system_error&) {
  return false;
} catch (const std::bad_alloc&) {
  return false;
}

bool BoundedPool::Push(Lane& lane, std::function<void()>& connection, bool turning_away) {
  const size_t free = lane.threads - lane.busy, room = lane.most_threads - lane.threads;
  if (lane.waiting.size() >= free + room + lane.limit) return false;
  const bool wants_thread = lane.waiting.size() >= free && room > 0;
  if (wants_thread && !Start(lane, turning_away) && lane.threads == 0) return false;
  lane.waiting.push_back(std::move(connection));
  lane.arrived.notify_one();
  return true;
}

// What leaves here ends the thread that accepts.
bool BoundedPool::enqueue(std::function<void()> connection) try {
  JoinEnded();
  const bool room = [&] {
    const std::lock_guard lock(mutex_);
    if (!Push(served_, connection, false)) return Push(turned_away_, connection, true);
    CountWaiting();
    return true;
  }();
  on_idle();
  return room;
} catch (const std::bad_alloc&) {
  return false;
}

void BoundedPool::Look(size_t waiting) const try {
  if (look_) look_(waiting);
} catch (const std::bad_alloc&) {  // the next look is soon
}

void BoundedPool::on_idle() { Look(waiting_); }

void BoundedPool::Serve(Lane& lane, bool turning_away) {
  turning_away_here = turning_away;
  waiting_here = &waiting_;
  std::unique_lock lock(mutex_);
  while (true) {
    lane.arrived.wait_for(lock, kIdleLife, [&] { return stopping_ || !lane.waiting.empty(); });
    if (lane.waiting.empty()) break;  // stopping, or nothing to do for a while
    auto connection = std::move(lane.waiting.front());
    lane.waiting.pop_front();
    ++lane.busy;
    CountWaiting();
    lock.unlock();
    try {
      connection();
    } catch (...) {  // no memory left to answer with: others may have more
    }
    lock.lock();
    --lane.busy;
  }
  --lane.threads;
  ended_.push_back(std::this_thread::get_id());
  thread_ended_.notify_all();
}

void BoundedPool::CountWaiting() {
  const size_t free = served_.threads - served_.busy;
  waiting_ = served_.waiting.size() > free ? served_.waiting.size() - free : 0;
}

void BoundedPool::JoinEnded() {
  std::list<std::thread> done;
  {
    const std::lock_guard lock(mutex_);
    for (const std::thread::id id : ended_) {
      const auto found = std::ranges::find(threads_, id, &std::thread::get_id);
      if (found != threads_.end()) done.splice(done.end(), threads_, found);
    }
    ended_.clear();
  }
  for (std::thread& thread : done) thread.join();
}

void BoundedPool::AwaitEnd() {
  std::unique_lock lock(mutex_);
  const auto ended = [&] { return served_.threads + turned_away_.threads == 0; };
  while (look_ && !thread_ended_.wait_for(lock, kLookAtEnd, ended)) {
    lock.unlock();
    Look(std::numeric_limits<size_t>::max());
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
  AwaitEnd();
  for (std::thread& thread : threads_) thread.join();
}

}  // namespace kvx

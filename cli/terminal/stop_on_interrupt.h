// Signals set a flag; this thread turns it into a stop of whatever runs.
#pragma once
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "cli/terminal/interrupt.h"

namespace kvx {

class StopOnInterrupt {
 public:
  enum class Stops { kOnce, kUntilItEnds };  // until it ends: what begins just after a stop is stopped too

  explicit StopOnInterrupt(std::function<void()> stop, Stops stops = Stops::kOnce)
      : thread_([this, stop = std::move(stop), stops] { Watch(stop, stops); }) {}
  ~StopOnInterrupt() {
    {
      const std::lock_guard lock(mutex_);
      done_ = true;
    }
    ended_.notify_one();
    thread_.join();
  }
  StopOnInterrupt(const StopOnInterrupt&) = delete;
  StopOnInterrupt& operator=(const StopOnInterrupt&) = delete;

 private:
  void Watch(const std::function<void()>& stop, Stops stops) {
    constexpr std::chrono::milliseconds kLook{100};
    std::unique_lock lock(mutex_);
    while (!ended_.wait_for(lock, kLook, [this] { return done_; })) {
      if (!InterruptRequested()) continue;
      lock.unlock();
      stop();
      if (stops == Stops::kOnce) return;
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable ended_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace kvx

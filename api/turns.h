// At most so many of a kind of work at the same time; some may wait for their turn, the rest is told to come back.
#pragma once
#include <condition_variable>
#include <mutex>

#include "core/errors.h"

namespace kvx {

class Turns {
 public:
  Turns(int at_once, int waiting) : free_(at_once), most_waiting_(waiting) {}
  int waiting() {
    const std::lock_guard lock(mutex_);
    return waiting_;
  }

  class Held {
   public:
    explicit Held(Turns& turns) : turns_(turns) { turns_.Enter(); }
    ~Held() { turns_.Leave(); }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;

   private:
    Turns& turns_;
  };

 private:
  void Enter() {
    std::unique_lock lock(mutex_);
    if (free_ == 0 && waiting_ == most_waiting_) throw Unavailable("the service computes all it can; try again shortly");
    if (free_ == 0) {
      ++waiting_;
      left_.wait(lock, [this] { return free_ > 0; });
      --waiting_;
    }
    --free_;
  }
  void Leave() {
    {
      const std::lock_guard lock(mutex_);
      ++free_;
    }
    left_.notify_one();
  }
  std::mutex mutex_;
  std::condition_variable left_;
  int free_, most_waiting_, waiting_ = 0;
};

}  // namespace kvx

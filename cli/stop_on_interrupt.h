// Signals set a flag; this thread turns it into a stop of whatever runs.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "cli/interrupt.h"

namespace kvx {

class StopOnInterrupt {
 public:
  explicit StopOnInterrupt(std::function<void()> stop)
      : thread_([this, stop = std::move(stop)] {
          while (!done_ && !InterruptRequested()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
          if (!done_) stop();
        }) {}
  ~StopOnInterrupt() {
    done_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> done_{false};
  std::thread thread_;
};

}  // namespace kvx

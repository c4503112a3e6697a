// How long a service that has no time, or does not answer, is asked again, and how often how far it is.
#pragma once
#include <chrono>
#include <functional>

namespace kvx {

// Pauses that grow. It ends by the clock, from the first pause on: what the tries take counts too, and each
// thing that is tried is tried twice at least.
class Patience {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kUsual{120'000};

  struct Time {
    std::function<Clock::time_point()> now;
    std::function<void(std::chrono::milliseconds)> sleep;
  };

  explicit Patience(std::chrono::milliseconds limit = kUsual);  // by the machine's clock
  Patience(std::chrono::milliseconds limit, Time time) : limit_(limit), time_(std::move(time)) {}
  // How long the next pause is: `at_least` so long, if there is time.
  std::chrono::milliseconds Next(std::chrono::milliseconds at_least = {}) const;
  // False, at once: no more patience. Throws Cancelled on Ctrl-C.
  bool Pause(std::chrono::milliseconds at_least = {});

 private:
  std::chrono::milliseconds limit_, pause_{200};
  Clock::time_point began_{};  // none yet: never paused
  Time time_;
};

// Between two looks at what goes on by itself: pauses that grow, to two seconds.
class GrowingPause {
 public:
  GrowingPause();  // by the machine's clock
  explicit GrowingPause(Patience::Time time) : time_(std::move(time)) {}
  void Wait();  // throws Cancelled on Ctrl-C, at once

 private:
  std::chrono::milliseconds pause_{100};
  Patience::Time time_;
};

}  // namespace kvx

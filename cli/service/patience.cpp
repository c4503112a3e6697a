// Ctrl-C is looked at twenty times a second.
#include "cli/service/patience.h"

#include <algorithm>
#include <thread>

#include "cli/terminal/interrupt.h"

namespace kvx {
namespace {

Patience::Time MachineTime() {
  return {Patience::Clock::now, [](std::chrono::milliseconds pause) { std::this_thread::sleep_for(pause); }};
}

void SleepUntil(Patience::Clock::time_point until, const Patience::Time& time) {
  constexpr std::chrono::milliseconds kLook{50};
  while (time.now() < until) {
    ThrowIfInterrupted();
    time.sleep(kLook);
  }
}

}  // namespace

Patience::Patience(std::chrono::milliseconds limit) : Patience(limit, MachineTime()) {}

std::chrono::milliseconds Patience::Next(std::chrono::milliseconds at_least) const {
  return std::max(pause_, at_least);
}

bool Patience::Pause(std::chrono::milliseconds at_least) {
  constexpr std::chrono::milliseconds kLongest{5000};
  if (began_ == Clock::time_point{}) began_ = time_.now();
  const auto end = began_ + limit_;
  if (time_.now() >= end) return false;
  SleepUntil(std::min(time_.now() + Next(at_least), end), time_);
  pause_ = std::min(pause_ * 2, kLongest);
  return true;
}

GrowingPause::GrowingPause() : GrowingPause(MachineTime()) {}

void GrowingPause::Wait() {
  constexpr std::chrono::milliseconds kLongest{2000};
  ThrowIfInterrupted();
  SleepUntil(time_.now() + pause_, time_);
  pause_ = std::min(pause_ * 2, kLongest);
}

}  // namespace kvx

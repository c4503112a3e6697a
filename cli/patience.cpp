// Ctrl-C is looked at twenty times a second.
#include "cli/patience.h"

#include <algorithm>
#include <thread>

#include "cli/interrupt.h"

namespace kvx {

Patience::Patience(std::chrono::milliseconds limit)
    : Patience(limit,
               {Clock::now, [](std::chrono::milliseconds pause) { std::this_thread::sleep_for(pause); }}) {}

std::chrono::milliseconds Patience::Next(std::chrono::milliseconds at_least) const {
  return std::max(pause_, at_least);
}

bool Patience::Pause(std::chrono::milliseconds at_least) {
  constexpr std::chrono::milliseconds kLook{50}, kLongest{5000};
  if (began_ == Clock::time_point{}) began_ = time_.now();
  const auto end = began_ + limit_;
  if (time_.now() >= end) return false;
  const auto until = std::min(time_.now() + Next(at_least), end);
  while (time_.now() < until) {
    ThrowIfInterrupted();
    time_.sleep(kLook);
  }
  pause_ = std::min(pause_ * 2, kLongest);
  return true;
}

}  // namespace kvx

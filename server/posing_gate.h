// How many requests may compute at the same time, and how many may wait for it.
#pragma once
#include <condition_variable>
#include <functional>
#include <mutex>

namespace kvx {

class PosingGate {
 public:
  PosingGate(int slots, int most_waiting) : free_(slots), most_waiting_(most_waiting) {}

  // Held while somebody poses. First come, first served.
  class Pass {
   public:
    // Waits for a slot. Throws Unavailable when too many wait already,
    // Cancelled when `abandoned` says that nobody listens.
    Pass(PosingGate& gate, const std::function<bool()>& abandoned);
    ~Pass();
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;

   private:
    PosingGate& gate_;
  };

  int waiting() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  int free_, waiting_ = 0;
  const int most_waiting_;
  uint64_t next_ticket_ = 0, now_serving_ = 0;
};

}  // namespace kvx

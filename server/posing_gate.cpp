// Tickets keep the order. Whoever gives up passes its turn on when it comes.
#include "server/posing_gate.h"

#include <chrono>

#include "core/errors.h"

namespace kvx {
namespace {
constexpr auto kLookEvery = std::chrono::milliseconds(50);
}

PosingGate::Pass::Pass(PosingGate& gate, const std::function<bool()>& abandoned) : gate_(gate) {
  std::unique_lock lock(gate.mutex_);
  if (gate.free_ == 0 && gate.waiting_ >= gate.most_waiting_)
    throw Unavailable("too much is asked for at once; ask again in a moment");
  const uint64_t ticket = gate.next_ticket_++;
  ++gate.waiting_;
  bool gone = false;
  while (gate.now_serving_ != ticket || gate.free_ == 0) {
    gate.changed_.wait_for(lock, kLookEvery);
    if (gone || !abandoned) continue;
    lock.unlock();
    gone = abandoned();
    lock.lock();
    if (gone && gate.now_serving_ == ticket) break;  // its turn: no slot is needed to leave
  }
  --gate.waiting_;
  ++gate.now_serving_;
  gate.changed_.notify_all();
  if (gone) throw Cancelled();
  --gate.free_;
}

PosingGate::Pass::~Pass() {
  {
    const std::lock_guard lock(gate_.mutex_);
    ++gate_.free_;
  }
  gate_.changed_.notify_all();
}

int PosingGate::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_;
}

}  // namespace kvx

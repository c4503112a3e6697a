// Whoever gives up leaves the line, wherever it stands.
#include "server/turns/posing_gate.h"

#include <chrono>

#include "core/errors.h"

namespace kvx {
namespace {
constexpr auto kLookEvery = std::chrono::milliseconds(50);
}

PosingGate::Pass::Pass(PosingGate& gate, const Asker& asker) : gate_(gate) {
  std::unique_lock lock(gate.mutex_);
  const ProjectShares::Place place = gate.places_.TryTake(asker.project);
  if (!place && (gate.free_ == 0 || gate.line_.Waiting() > 0))
    throw Unavailable("too much is asked for at once; ask again in a moment");
  const ProjectLine::Place mine = gate.line_.Join(asker.project);
  while (!gate.MayPass(mine)) {
    gate.changed_.wait_for(lock, kLookEvery);
    lock.unlock();
    const bool gone = asker.HasGone();
    lock.lock();
    if (!gone) continue;
    gate.line_.Leave(mine);
    gate.changed_.notify_all();
    throw Cancelled();
  }
  gate.line_.Serve(mine);
  --gate.free_;
  gate.changed_.notify_all();  // there may be another slot
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
  return line_.Waiting();
}

}  // namespace kvx

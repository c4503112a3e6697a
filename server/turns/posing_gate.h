// How many requests may compute at the same time, and how many may wait for it. Projects take turns.
#pragma once
#include <condition_variable>
#include <mutex>

#include "core/host/asker.h"
#include "server/turns/project_line.h"
#include "storage/project_shares.h"

namespace kvx {

class PosingGate {
 public:
  // Of one project alone `most_waiting`, of others half of what is left.
  PosingGate(int slots, int most_waiting) : free_(slots), places_(2 * most_waiting, true) {}

  // Held while somebody poses. Of one project, first come, first served.
  class Pass {
   public:
    // Waits for a slot. Throws Unavailable when too many wait already,
    // Cancelled, at once, when nobody listens any more.
    Pass(PosingGate& gate, const Asker& asker);
    ~Pass();
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;

   private:
    PosingGate& gate_;
  };

  int waiting() const;

 private:
  bool MayPass(ProjectLine::Place place) const { return free_ > 0 && line_.IsNext(place); }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  int free_;
  ProjectShares places_;
  ProjectLine line_;
};

}  // namespace kvx

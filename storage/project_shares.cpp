#include "storage/project_shares.h"

namespace kvx {

struct ProjectShares::Held {
  ~Held() {
    if (shares) shares->GiveBack(who);
  }
  ProjectShares* shares = nullptr;  // null: nothing counts yet
  Takers::iterator who{};
};

// Nothing counts before all memory is there: a place that nobody holds would be lost for ever.
ProjectShares::Place ProjectShares::TryTake(const std::string& project) {
  const auto held = std::make_shared<Held>();  // outside the lock, which its end may take
  const std::lock_guard lock(mutex_);
  const auto found = taken_by_.find(project);
  const int own = found == taken_by_.end() ? 0 : found->second;
  if (free_ <= 0 || (shared_ && own >= free_)) return nullptr;
  held->who = taken_by_.try_emplace(project, 0).first;
  held->shares = this;
  --free_;
  ++taken_;
  ++held->who->second;
  return held;
}

void ProjectShares::GiveBack(Takers::iterator who) {
  const std::lock_guard lock(mutex_);
  ++free_;
  --taken_;
  if (--who->second == 0) taken_by_.erase(who);
}

int ProjectShares::Taken() const {
  const std::lock_guard lock(mutex_);
  return taken_;
}

}  // namespace kvx

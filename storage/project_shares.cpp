#include "storage/project_shares.h"

namespace kvx {

ProjectShares::Place ProjectShares::TryTake(const std::string& project) {
  const std::lock_guard lock(mutex_);
  const auto found = taken_by_.find(project);
  const int own = found == taken_by_.end() ? 0 : found->second;
  if (free_ <= 0 || (shared_ && own >= free_)) return nullptr;
  --free_;
  ++taken_;
  ++taken_by_[project];
  return Place(this, [project](ProjectShares* shares) { shares->GiveBack(project); });
}

void ProjectShares::GiveBack(const std::string& project) {
  const std::lock_guard lock(mutex_);
  ++free_;
  --taken_;
  const auto found = taken_by_.find(project);
  if (--found->second == 0) taken_by_.erase(found);
}

int ProjectShares::Taken() const {
  const std::lock_guard lock(mutex_);
  return taken_;
}

}  // namespace kvx

// One line for all; who is next depends on the projects in it.
#include "server/project_turns.h"

#include <algorithm>

#include "core/errors.h"

namespace kvx {

int ProjectTurns::WaitingOf(const std::string& project) const {
  return int(std::ranges::count(line_, project));
}

int ProjectTurns::Waiting(const std::string& project) const {
  const std::lock_guard lock(mutex_);
  return WaitingOf(project);
}

ProjectTurns::Line::const_iterator ProjectTurns::Next() const {
  auto next = line_.end();
  if (free_ == 0) return next;
  const auto served = [&](const std::string& project) {
    const auto found = last_served_.find(project);
    return found == last_served_.end() ? 0 : found->second;
  };
  for (auto each = line_.begin(); each != line_.end(); ++each) {
    if (served_now_.contains(*each)) continue;
    if (next == line_.end() || served(*each) < served(*next)) next = each;
  }
  return next;
}

ProjectTurns::Turn::Turn(ProjectTurns& turns, const std::string& project) : turns_(turns), project_(project) {
  std::unique_lock lock(turns.mutex_);
  if (turns.WaitingOf(project) >= turns.most_waiting_of_project_) {
    throw Unavailable(
        "uploads of a project are looked at one after the other, and too many of yours wait; send this one "
        "again in a moment");
  }
  turns.line_.push_back(project);
  const Line::const_iterator mine = std::prev(turns.line_.end());
  turns.changed_.wait(lock, [&] { return turns.Next() == mine; });
  turns.line_.erase(mine);
  --turns.free_;
  turns.served_now_.insert(project);
  turns.last_served_[project] = ++turns.count_;
  turns.changed_.notify_all();  // there may be another place
}

ProjectTurns::Turn::~Turn() {
  const std::lock_guard lock(turns_.mutex_);
  ++turns_.free_;
  turns_.served_now_.erase(project_);
  turns_.changed_.notify_all();
}

}  // namespace kvx

// One line for all; whose project has a place is kept out.
#include "server/turns/project_turns.h"

#include "core/errors.h"

namespace kvx {

int ProjectTurns::Waiting(const std::string& project) const {
  const std::lock_guard lock(mutex_);
  return line_.WaitingOf(project);
}

ProjectTurns::Turn::Turn(ProjectTurns& turns, const std::string& project) : turns_(turns), project_(project) {
  std::unique_lock lock(turns.mutex_);
  if (turns.line_.WaitingOf(project) >= turns.most_waiting_of_project_) {
    throw Unavailable(
        "uploads of a project are looked at one after the other, and too many of yours wait; send this one "
        "again in a moment");
  }
  std::set<std::string> own{project};  // whose turn has come may lack memory no more
  const ProjectLine::Place mine = turns.line_.Join(project);
  turns.changed_.wait(lock, [&] { return turns.free_ > 0 && turns.line_.IsNext(mine, turns.served_now_); });
  turns.line_.Serve(mine);
  --turns.free_;
  turns.served_now_.insert(own.extract(own.begin()));
  turns.changed_.notify_all();  // there may be another place
}

ProjectTurns::Turn::~Turn() {
  const std::lock_guard lock(turns_.mutex_);
  ++turns_.free_;
  turns_.served_now_.erase(project_);
  turns_.changed_.notify_all();
}

}  // namespace kvx

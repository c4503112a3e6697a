// Places that projects share: each has at most one at a time, and those who wait take turns by project.
#pragma once
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>

#include "server/turns/project_line.h"

namespace kvx {

class ProjectTurns {
 public:
  ProjectTurns(int places, int most_waiting_of_project)
      : free_(places), most_waiting_of_project_(most_waiting_of_project) {}

  // Held while somebody uses a place.
  class Turn {
   public:
    // Waits for a place. Throws Unavailable when too many of the project wait already.
    Turn(ProjectTurns& turns, const std::string& project);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    ProjectTurns& turns_;
    const std::string project_;
  };

  int Waiting(const std::string& project) const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  int free_;
  const int most_waiting_of_project_;
  ProjectLine line_;
  std::set<std::string> served_now_;
};

}  // namespace kvx

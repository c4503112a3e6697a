// Places for which nobody waits, shared by projects so that one alone cannot have them all: a project has at
// most as many as it leaves free. (Of 64, one alone has 32, the next 16.)
#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace kvx {

class ProjectShares {
 public:
  // Not `shared`: whoever comes may have all.
  ProjectShares(int places, bool shared) : free_(places), shared_(shared) {}

  using Place = std::shared_ptr<void>;        // taken while it is held, which is shorter than this lives
  Place TryTake(const std::string& project);  // null: there is none for it now
  int Taken() const;

 private:
  using Takers = std::map<std::string, int>;
  struct Held;
  void GiveBack(Takers::iterator who);

  mutable std::mutex mutex_;
  int free_, taken_ = 0;
  const bool shared_;
  Takers taken_by_;  // those who have any
};

}  // namespace kvx

// Those who wait in one line. Who is next depends on the projects in it: one that asks for much does not keep
// the others from their turn.
#pragma once
#include <cstdint>
#include <list>
#include <map>
#include <set>
#include <string>

namespace kvx {

// Its owner sees to it that one thread uses it at a time.
class ProjectLine {
 public:
  using Place = std::list<std::string>::const_iterator;
  Place Join(const std::string& project);
  void Leave(Place place) { waiting_.erase(place); }
  void Serve(Place place) noexcept;  // it leaves, and its turn counts
  // Whether its project was served longest ago of those that are not kept out, and nobody else of it came
  // before.
  bool IsNext(Place place, const std::set<std::string>& kept_out = {}) const;
  int Waiting() const { return int(waiting_.size()); }
  int WaitingOf(const std::string& project) const;

 private:
  uint64_t ServedAt(const std::string& project) const;

  std::list<std::string> waiting_;               // projects, in the order in which they came
  std::map<std::string, uint64_t> last_served_;  // by a count that goes up; 0: never
  uint64_t count_ = 0;
};

}  // namespace kvx

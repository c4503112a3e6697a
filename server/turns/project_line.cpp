// Lines are short: whoever asks looks through all of it.
#include "server/turns/project_line.h"

#include <algorithm>

namespace kvx {

ProjectLine::Place ProjectLine::Join(const std::string& project) {
  last_served_.try_emplace(project, 0);  // so that to serve needs no memory
  return waiting_.insert(waiting_.end(), project);
}

void ProjectLine::Serve(Place place) noexcept {
  last_served_.find(*place)->second = ++count_;
  Leave(place);
}

uint64_t ProjectLine::ServedAt(const std::string& project) const {
  const auto found = last_served_.find(project);
  return found == last_served_.end() ? 0 : found->second;
}

bool ProjectLine::IsNext(Place place, const std::set<std::string>& kept_out) const {
  auto next = waiting_.end();
  for (auto each = waiting_.begin(); each != waiting_.end(); ++each) {
    if (kept_out.contains(*each)) continue;
    if (next == waiting_.end() || ServedAt(*each) < ServedAt(*next)) next = each;
  }
  return next == place;
}

int ProjectLine::WaitingOf(const std::string& project) const {
  return int(std::ranges::count(waiting_, project));
}

}  // namespace kvx

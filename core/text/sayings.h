// What is said of several, said once.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

namespace kvx {

// Names by what is said of them, in the order in which it is first said.
class Sayings {
 public:
  struct Saying {
    std::string note;
    std::vector<std::string> names;
  };
  void Add(const std::string& name, const std::string& note) {
    auto said = std::ranges::find(sayings_, note, &Saying::note);
    if (said == sayings_.end()) said = sayings_.insert(said, {note, {}});
    said->names.push_back(name);
  }
  const std::vector<Saying>& all() const { return sayings_; }

 private:
  std::vector<Saying> sayings_;
};

}  // namespace kvx

// Who waits for an answer: the project that asked, and whether anybody still listens.
#pragma once
#include <functional>
#include <string>

namespace kvx {

struct Asker {
  std::string project{};
  std::function<bool()> abandoned{};  // true: nobody waits any more; may be empty

  bool HasGone() const { return abandoned && abandoned(); }
};

}  // namespace kvx
